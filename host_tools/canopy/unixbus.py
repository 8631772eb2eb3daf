# SPDX-License-Identifier: MIT
"""python-can interface ``canopy``: the unixbus, a virtual CAN bus over Unix datagram sockets in a folder.

Needs neither root nor CAN in the kernel. The protocol is in docs/unixbus.md; the C driver for the same bus is
drivers/can/unixbus. Every tool of python-can works on it, for example ``python -m can.viewer -i canopy -c bus0``.
"""

from __future__ import annotations

import contextlib
import errno
import os
import queue
import re
import secrets
import socket
import stat
import struct
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import can
from can.typechecking import AutoDetectedConfig, CanFilters, Channel

VERSION = 1
HEADER = struct.Struct("<BBBxI")  # version, flags, length, reserved (checked apart), id
RESERVED_OFFSET = 3
DATAGRAM_MAX = HEADER.size + 64

EXTENDED, REMOTE, ERROR, FD, BITRATE_SWITCH, ERROR_STATE = (1 << bit for bit in range(6))
ALL_FLAGS = (1 << 6) - 1
FD_LENGTHS = frozenset([*range(9), 12, 16, 20, 24, 32, 48, 64])

SEND_WAIT_S = 0.1
"""Longest time that a send without a timeout of its own can take for participants that are full [s]."""

SETTLE_NS = 100_000_000
"""A folder read within this time after its mtime is read again: the kernel's clock for stamps is coarse [ns]."""

PATH_MAX = 107
"""Bytes of a Unix socket's path (sun_path without its final 0)."""

SOCKET_NAME_LENGTH = len("4194304-0badc0de.sock")
SOCKET_NAME = re.compile(r"[0-9]{1,10}-[0-9a-f]{8}\.sock")


def buses_folder() -> Path:
    """Folder that holds the buses with a name: CANOPY_BUS_DIR, or in XDG_RUNTIME_DIR, or in /tmp (docs/unixbus.md)."""
    if configured := os.environ.get("CANOPY_BUS_DIR"):
        return Path(configured)
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and Path(runtime).is_dir():
        return Path(runtime, "canopy")
    return _shared_folder()


def _shared_folder() -> Path:
    """Where buses lie when nothing says where: in a place where others could have made the folder first."""
    return Path(f"/tmp/canopy-{os.geteuid()}")


def bus_folder(bus: str) -> Path:
    """Finds the folder of a bus, and makes it if need be.

    Args:
        bus: a name such as ``bus0``, or the path of a folder if it contains a slash.

    Raises:
        ValueError: the name is empty, ``.`` or ``..``.
        OSError: the folder cannot be made; PermissionError: others could have put it into /tmp.
    """
    if bus in ("", ".", ".."):
        raise ValueError(f"{bus!r} is no bus: give a name such as bus0, or a folder's path with a slash")
    if "/" in bus:
        folder = Path(bus)
    else:
        base = buses_folder()
        base.mkdir(mode=0o700, exist_ok=True)
        if base == _shared_folder():
            status = base.lstat()
            if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & 0o022:
                raise PermissionError(errno.EPERM, "not a folder that only you can write", str(base))
        folder = base / bus
    if len(os.fsencode(folder)) + 1 + SOCKET_NAME_LENGTH > PATH_MAX:
        raise OSError(errno.ENAMETOOLONG, "a socket's path has at most 107 bytes", str(folder))
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def encode(msg: can.Message) -> bytes:
    """Writes a frame as a datagram.

    Raises:
        ValueError: the frame cannot exist on a CAN bus.
    """
    flags = (
        EXTENDED * msg.is_extended_id
        | REMOTE * msg.is_remote_frame
        | ERROR * msg.is_error_frame
        | FD * msg.is_fd
        | BITRATE_SWITCH * msg.bitrate_switch
        | ERROR_STATE * msg.error_state_indicator
    )
    data = b"" if flags & REMOTE else bytes(msg.data)
    datagram = HEADER.pack(VERSION, flags, msg.dlc, msg.arbitration_id) + data
    if decode(datagram) is None:
        raise ValueError(f"no frame that a CAN bus can carry: {msg}")
    return datagram


def decode(datagram: bytes) -> can.Message | None:
    """Reads a datagram; None when it is not exactly one frame that can exist on a CAN bus."""
    if len(datagram) < HEADER.size or datagram[RESERVED_OFFSET] != 0:
        return None
    version, flags, length, arbitration_id = HEADER.unpack_from(datagram)
    fd = bool(flags & FD)
    if version != VERSION or flags & ~ALL_FLAGS:
        return None
    if flags & ((REMOTE | ERROR) if fd else (BITRATE_SWITCH | ERROR_STATE)):
        return None
    if arbitration_id > (0x1FFFFFFF if flags & (EXTENDED | ERROR) else 0x7FF):
        return None
    if length not in FD_LENGTHS or (length > 8 and not fd):
        return None
    if len(datagram) != HEADER.size + (0 if flags & REMOTE else length):
        return None
    return can.Message(
        arbitration_id=arbitration_id,
        is_extended_id=bool(flags & EXTENDED),
        is_remote_frame=bool(flags & REMOTE),
        is_error_frame=bool(flags & ERROR),
        is_fd=fd,
        bitrate_switch=bool(flags & BITRATE_SWITCH),
        error_state_indicator=bool(flags & ERROR_STATE),
        dlc=length,
        data=datagram[HEADER.size :],
    )


class _Receiver:
    """Moves frames from the socket to a queue at once, in a thread: the socket's own queue holds only a few.

    Knows nothing of the bus object, so that one that was forgotten is still collected, and closes.
    """

    def __init__(self, sock: socket.socket, channel: str, size: int) -> None:
        self.frames: queue.Queue[can.Message] = queue.Queue(maxsize=size)
        self.malformed = 0
        self.dropped = 0
        self.failure: OSError | None = None
        self._socket = sock
        self._channel = channel
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=f"unixbus {channel}", daemon=True)
        self._thread.start()

    def put(self, msg: can.Message) -> None:
        try:
            self.frames.put_nowait(msg)
        except queue.Full:
            self.dropped += 1

    def stop(self) -> None:
        self._stopping = True
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RD)
        if threading.current_thread() is not self._thread:  # the garbage collector may run anywhere
            self._thread.join()

    def _run(self) -> None:
        while True:
            try:
                datagram = self._socket.recv(DATAGRAM_MAX + 1)
            except OSError as error:
                if not self._stopping:
                    self.failure = error
                return
            if self._stopping:
                return
            msg = decode(datagram)
            if msg is None:
                self.malformed += 1
                continue
            msg.timestamp = time.time()
            msg.channel = self._channel
            self.put(msg)


class _Peers:
    """The other participants' sockets, read again when the folder has changed."""

    def __init__(self, folder: Path, own: Path) -> None:
        self.slow: set[str] = set()
        """Those that have let a send wait in vain, and have taken no frame since."""
        self._folder = folder
        self._own = own
        self._paths: list[str] = []
        self._modified_ns = 0
        self._settled = False

    def paths(self) -> list[str]:
        """Paths of the sockets.

        Raises:
            can.CanOperationError: the folder or the own socket in it is gone.
        """
        try:
            modified_ns = self._folder.stat().st_mtime_ns
            if not self._settled or modified_ns != self._modified_ns:
                self._settled = time.time_ns() - modified_ns > SETTLE_NS
                self._modified_ns = modified_ns
                names = os.listdir(self._folder)
                if self._own.name not in names:
                    raise FileNotFoundError(errno.ENOENT, "somebody deleted it", str(self._own))
                self._paths = [
                    str(self._folder / name) for name in names if SOCKET_NAME.fullmatch(name) and name != self._own.name
                ]
                self.slow.intersection_update(self._paths)
        except OSError as error:
            self._settled = False
            raise can.CanOperationError(f"left the bus: {error}; open it anew", error.errno) from error
        return self._paths.copy()

    def forget(self, path: str) -> None:
        self._paths.remove(path)
        self.slow.discard(path)


class UnixBus(can.BusABC):
    """A participant of a unixbus.

    Threads: recv, send and shutdown may be called from any thread; send takes a lock.

    Attributes:
        channel_info: the bus and its folder, for people.
    """

    def __init__(
        self,
        channel: Channel = "bus0",
        can_filters: CanFilters | None = None,
        receive_own_messages: bool = False,
        rx_queue_size: int = 65536,
        **kwargs: object,
    ) -> None:
        """Joins a bus; its folder is made if need be.

        Args:
            channel: name of the bus, or the path of its folder if it contains a slash.
            can_filters: filters as python-can has them (applied here, in software).
            receive_own_messages: recv() also gives what this object has sent (with ``is_rx`` false).
            rx_queue_size: frames that can wait for recv(); more are dropped and counted.
            **kwargs: settings for all interfaces, such as ``bitrate`` and ``fd``, which a virtual bus has no use for.

        Raises:
            can.CanInitializationError: the folder or the socket cannot be made.
        """
        self.channel = str(channel)
        self._receive_own_messages = receive_own_messages
        self._lock = threading.Lock()
        self._sent = 0
        self._tx_dropped = 0
        self._can_protocol = can.CanProtocol.CAN_FD
        try:
            folder = bus_folder(self.channel)
            self._own = folder / f"{os.getpid()}-{secrets.token_hex(4)}.sock"
            self._socket = self._join()
        except (OSError, ValueError) as error:
            raise can.CanInitializationError(
                f"cannot join the bus {self.channel!r}: {error}; CANOPY_BUS_DIR names another folder for buses",
                error.errno if isinstance(error, OSError) else None,
            ) from error
        self._peers = _Peers(folder, self._own)
        self._receiver = _Receiver(self._socket, self.channel, rx_queue_size)
        self.channel_info = f"canopy unixbus {self.channel} ({folder})"
        super().__init__(channel, can_filters, **kwargs)

    def _join(self) -> socket.socket:
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        # bind() makes the file first and the way to the socket after it. A sender that comes between the two would take
        # the socket for a dead one's and unlink it. So the name that senders look for is given when all is done.
        hidden = self._own.with_suffix(".new")
        try:
            sock.bind(str(hidden))
            hidden.rename(self._own)
        except OSError:
            sock.close()
            with contextlib.suppress(OSError):
                hidden.unlink()
            raise
        return sock

    @property
    def counters(self) -> dict[str, int]:
        """What was lost and seen since the bus was joined: ``sent``, ``tx_dropped``, ``rx_dropped``, ``malformed``.

        ``tx_dropped`` counts once for each frame and participant that could not take it.
        """
        return {
            "sent": self._sent,
            "tx_dropped": self._tx_dropped,
            "rx_dropped": self._receiver.dropped,
            "malformed": self._receiver.malformed,
        }

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            # In slices, so that the end of the receive thread does not leave a caller waiting for ever.
            left = 0.5 if end is None else min(0.5, end - time.monotonic())
            try:
                return (
                    self._receiver.frames.get(timeout=left) if left > 0 else self._receiver.frames.get_nowait()
                ), False
            except queue.Empty:
                if self._receiver.failure is not None:
                    raise can.CanOperationError(f"cannot receive: {self._receiver.failure}") from None
                if self._is_shutdown:
                    raise can.CanOperationError("the bus was shut down") from None
                if left <= 0:
                    return None, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Sends a frame to all other participants.

        Args:
            msg: the frame.
            timeout: None: waits for participants that are full at most SEND_WAIT_S in all, then drops the frame for
                them and counts it; one that has let a send wait in vain is not waited for again until it has taken a
                frame. 0: never waits. Positive: waits for all of them up to this time in all [s].

        Raises:
            can.CanTimeoutError: a positive timeout was given, and a participant could not take the frame in it.
            can.CanOperationError: the bus is shut down, the folder is gone, or the frame cannot exist on a CAN bus.
        """
        if self._is_shutdown:
            raise can.CanOperationError("the bus was shut down")
        try:
            datagram = encode(msg)
        except (ValueError, struct.error) as error:
            raise can.CanOperationError(str(error)) from error
        explicit = timeout is not None and timeout > 0
        wait_s = SEND_WAIT_S if timeout is None else max(timeout, 0.0)
        with self._lock:
            lost = self._send_to_all(datagram, wait_s, patient=explicit)
            self._sent += 1
            self._tx_dropped += lost
        if self._receive_own_messages:
            self._receiver.put(_own_copy(msg, self.channel))
        if lost and explicit:
            raise can.CanTimeoutError(f"{lost} participants of {self.channel} did not take the frame in {timeout} s")

    def _send_to_all(self, datagram: bytes, wait_s: float, *, patient: bool) -> int:
        """Sends to every participant, and returns how many did not take the frame."""
        lost = 0
        end: float | None = None
        for path in self._peers.paths():
            try:
                try:
                    self._socket.sendto(datagram, socket.MSG_DONTWAIT, path)
                except BlockingIOError:
                    if wait_s <= 0 or (path in self._peers.slow and not patient):
                        raise
                    end = time.monotonic() + wait_s if end is None else end
                    self._send_waiting(datagram, path, end - time.monotonic(), wait_s)
                self._peers.slow.discard(path)
            except BlockingIOError:
                lost += 1
            except ConnectionRefusedError:  # its owner died without closing
                with contextlib.suppress(OSError):
                    os.unlink(path)
                self._peers.forget(path)
            except (FileNotFoundError, BrokenPipeError):  # it is leaving the bus in good order
                self._peers.forget(path)
            except OSError:
                lost += 1
        return lost

    def _send_waiting(self, datagram: bytes, path: str, left_s: float, wait_s: float) -> None:
        """Sends to a participant that is full; BlockingIOError when it is still full after the time left."""
        left_us = int(left_s * 1e6)
        if left_us <= 0:  # 0 would mean for ever
            raise BlockingIOError
        timeval = struct.pack("@ll", *divmod(left_us, 1_000_000))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeval)
        try:
            self._socket.sendto(datagram, path)
        except BlockingIOError:
            # Only one that had a real chance is called slow, not one for which an earlier one left no time.
            if left_s > wait_s / 2:
                self._peers.slow.add(path)
            raise

    def shutdown(self) -> None:
        """Leaves the bus and removes the own socket. Can be called again."""
        if self._is_shutdown:
            return
        super().shutdown()
        with contextlib.suppress(FileNotFoundError):
            self._own.unlink()
        self._receiver.stop()
        with self._lock:
            self._socket.close()

    @staticmethod
    def _detect_available_configs() -> Sequence[AutoDetectedConfig]:
        """The buses that exist, for ``can.detect_available_configs``."""
        base = buses_folder()
        if not base.is_dir():
            return []
        return [{"interface": "canopy", "channel": folder.name} for folder in sorted(base.iterdir()) if folder.is_dir()]


def _own_copy(msg: can.Message, channel: str) -> can.Message:
    """A sent frame as the sender itself receives it."""
    return can.Message(
        timestamp=time.time(),
        arbitration_id=msg.arbitration_id,
        is_extended_id=msg.is_extended_id,
        is_remote_frame=msg.is_remote_frame,
        is_error_frame=msg.is_error_frame,
        channel=channel,
        dlc=msg.dlc,
        data=msg.data,
        is_fd=msg.is_fd,
        is_rx=False,
        bitrate_switch=msg.bitrate_switch,
        error_state_indicator=msg.error_state_indicator,
    )
