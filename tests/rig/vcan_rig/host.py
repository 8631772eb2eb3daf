# SPDX-License-Identifier: MIT
"""What the guest needs of the host: a CPU, room for its memory, and an end with nothing left behind."""

import os
import random
import shutil
import signal
import socket
import time
from pathlib import Path


def memory_folder(size: int) -> Path | None:
    """A folder for the unlinked file that is the guest's RAM, executable, with room for `size` bytes; None: no such."""
    for folder in ("/dev/shm", os.environ.get("TMPDIR") or "/tmp", "/var/tmp"):
        if not os.access(folder, os.W_OK):
            continue
        state = os.statvfs(folder)
        if not state.f_flag & os.ST_NOEXEC and state.f_bavail * state.f_frsize >= size + (128 << 20):
            return Path(folder)
    return None


def pick_cpu(wanted: str) -> tuple[int | None, socket.socket | None]:
    """A CPU for the guest (None: not pinned), and the socket whose life reserves it.

    User-Mode Linux has one CPU, and its kernel and its processes wake each other on every system call; spread over two
    CPUs that costs two to five times as much, and differs from run to run (measured: 18-70 µs a call, pinned 15-18 µs).
    The name of an abstract socket is the lock: parallel guests take different CPUs, and no file is left behind.
    """
    if wanted == "none":
        return None, None
    if wanted != "auto":
        return int(wanted), None
    allowed = sorted(os.sched_getaffinity(0))
    random.shuffle(allowed)
    for cpu in allowed:
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lock.bind(f"\0with-vcan.cpu{cpu}")
        except OSError:
            lock.close()
        else:
            return cpu, lock
    return allowed[0], None


def _live_members(session: int) -> list[int]:
    members = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            # After the name in brackets, which may hold anything: state, parent, group, session.
            fields = (entry / "stat").read_bytes().rpartition(b")")[2].split()
        except OSError:
            continue  # it has ended meanwhile
        if int(fields[3]) == session and fields[0] not in (b"Z", b"X"):
            members.append(int(entry.name))
    return members


def kill_session(session: int) -> None:
    """Kills every process of a session, and those they start meanwhile; waits up to a second until they are gone."""
    for _ in range(50):
        members = _live_members(session)
        if not members:
            return
        for process in members:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue
        _reap()
        time.sleep(0.02)


def _reap() -> None:
    try:
        while os.waitpid(-1, os.WNOHANG)[0] != 0:
            pass
    except ChildProcessError:
        return


def start_watchdog(session: int, state: Path) -> int:
    """Starts a process that cleans up after the guest when this one is killed, however.

    Returns:
        A file descriptor; write a byte to it to say that everything has been cleaned up already.
    """
    read_end, write_end = os.pipe()
    if os.fork() == 0:
        try:
            os.setsid()
            os.close(write_end)
            if os.fork() != 0:
                os._exit(0)
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_IGN)
            # Not to keep the caller's pipes open.
            null = os.open(os.devnull, os.O_RDWR)
            for descriptor in (0, 1, 2):
                os.dup2(null, descriptor)
            os.closerange(3, read_end)
            os.closerange(read_end + 1, min(os.sysconf("SC_OPEN_MAX"), 65536))
            if os.read(read_end, 1) == b"":
                kill_session(session)
                shutil.rmtree(state, ignore_errors=True)
        finally:
            os._exit(0)
    os.close(read_end)
    os.wait()
    return write_end
