# SPDX-License-Identifier: MIT
"""Mode uml: boots User-Mode Linux and hands streams, signals and the exit status through."""

import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from vcan_rig import EXIT_RIG, RigError, log
from vcan_rig.guest import write_files
from vcan_rig.host import kill_session, memory_folder, pick_cpu, start_watchdog
from vcan_rig.options import Options
from vcan_rig.relay import Outcome, Pipes, Relay

# They take the boot from 3.0 s to 1.0 s: no speed test of RAID 6 (0.85 s), no 256 old-style pseudo-terminals.
FAST_BOOT = ["initcall_blacklist=raid6_select_algo", "pty.legacy_count=0"]

# What the guest's kernel says on a processor for which it needs big_xstate.c.
XSTATE_REFUSED = b"ptrace set fp regs failed"

PR_SET_PDEATHSIG = 1
PR_SET_CHILD_SUBREAPER = 36


def _arguments(kernel: str, options: Options, state: Path, pipes: Pipes) -> list[str]:
    return [
        kernel,
        f"mem={options.memory >> 10}K",
        "rootfstype=hostfs",
        "ro",
        f"init={state}/init",
        f"STATE={state}",
        f"uml_dir={state}/",
        "umid=guest",
        "con=null",
        f"con0=null,fd:{pipes.messages[1]}",
        "ssl=null",
        f"ssl0=null,fd:{pipes.out[1]}",
        f"ssl1=null,fd:{pipes.err[1]}",
        f"ssl2=fd:{pipes.signals[0]},null",
        f"ssl3=null,fd:{pipes.status[1]}",
        "noreboot",
        "panic=-1",
        "quiet",
        *FAST_BOOT,
        *options.karg,
    ]


def _compile_big_xstate(folder: Path) -> str:
    library = folder / "big_xstate.so"
    source = Path(__file__).with_name("big_xstate.c")
    compiler = ["cc", "-shared", "-fPIC", "-O2", "-o", str(library), str(source), "-ldl"]
    try:
        subprocess.run(compiler, check=True, capture_output=True, text=True)
    except FileNotFoundError:
        raise RigError("User-Mode Linux needs a C compiler (cc) on this processor: apt-get install gcc") from None
    except subprocess.CalledProcessError as error:
        raise RigError(f"{source.name} does not compile: {error.stderr}") from None
    return str(library)


def _child_setup(cpu: int | None) -> Callable[[], None]:
    libc = ctypes.CDLL(None)

    def setup() -> None:
        os.setsid()
        if cpu is not None:
            os.sched_setaffinity(0, {cpu})
        libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        signal.pthread_sigmask(signal.SIG_SETMASK, [])

    # So that kill_session() can wait for the guest's helper processes too.
    libc.prctl(PR_SET_CHILD_SUBREAPER, 1)
    return setup


def _boot(kernel: str, options: Options, memory: Path, stdin: bytes, big_xstate: bool) -> Outcome:
    state = Path(tempfile.mkdtemp(prefix="with-vcan."))
    pipes = Pipes()
    session = watchdog = lock = None
    try:
        write_files(state, options, stdin)
        preload = {"LD_PRELOAD": _compile_big_xstate(state)} if big_xstate else {}
        cpu, lock = pick_cpu(options.cpu)
        process = subprocess.Popen(
            _arguments(kernel, options, state, pipes),
            env={"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": str(state), "TMPDIR": str(memory), **preload},
            cwd="/",
            stdin=subprocess.DEVNULL,
            stdout=pipes.messages[1],
            stderr=pipes.messages[1],
            pass_fds=pipes.guest_ends(),
            preexec_fn=_child_setup(cpu),
        )
        session = process.pid
        watchdog = start_watchdog(session, state)
        pipes.close_guest_ends()
        return Relay(options, pipes).run()
    finally:
        if session is not None:
            kill_session(session)
        pipes.close()
        if lock is not None:
            lock.close()
        shutil.rmtree(state, ignore_errors=True)
        if watchdog is not None:
            os.write(watchdog, b"k")
            os.close(watchdog)


def run_uml(kernel: str, options: Options) -> int:
    """Boots the guest, runs the command, returns its exit status; boots again when the guest did not come up."""
    memory = memory_folder(options.memory)
    if memory is None:
        log(f"no folder has room for {options.memory >> 20} MB of guest memory (/dev/shm, TMPDIR, /var/tmp); see --mem")
        return EXIT_RIG
    stdin = sys.stdin.buffer.read() if options.stdin and not sys.stdin.isatty() else b""
    big_xstate = False
    tries_left = 1 + options.retries
    while tries_left > 0:
        try:
            outcome = _boot(kernel, options, memory, stdin, big_xstate)
        except RigError as error:
            log(str(error))
            return EXIT_RIG
        if outcome.status is not None:
            if options.times:
                log(outcome.times())
            return outcome.status
        if not big_xstate and XSTATE_REFUSED in outcome.messages:
            big_xstate = True
            continue
        sys.stderr.write(outcome.messages.decode(errors="replace")[-4000:])
        log("the guest died while the command ran" if outcome.came_up else "the guest did not boot")
        tries_left = 0 if outcome.came_up else tries_left - 1
    return EXIT_RIG
