# SPDX-License-Identifier: MIT
"""python-can interface ``canopy``: the unixbus, a virtual CAN bus over Unix datagram sockets in a folder.

Needs neither root nor CAN in the kernel. The protocol is in docs/unixbus.md; the C driver for the same bus is
drivers/can/unixbus. Every tool of python-can works on it, for example ``python -m can.viewer -i canopy -c bus0``.
"""

from __future__ import annotations

import contextlib
import os
import queue
import secrets
import socket
import struct
import threading
import time
from collections.abc import Sequence

import can
from can.typechecking import AutoDetectedConfig, CanFilters, Channel

from canopy.can_bus.folder import NoSuchBusError, bus_folder, bus_names, join
from canopy.can_bus.sender import LOST_OFFSET, LeftBusError, Sender

VERSION = 1
HEADER = struct.Struct("<BBBxI")  # version, flags, length, (LOST_OFFSET: lost frames), id
DATAGRAM_MAX = HEADER.size + 64

EXTENDED, REMOTE, ERROR, FD, BITRATE_SWITCH, ERROR_STATE = (1 << bit for bit in range(6))
ALL_FLAGS = (1 << 6) - 1
CHECK_S = 0.5
"""How often a silent participant looks whether its bus is still there [s]."""

RETRY_S = 0.01
"""Between two receives of which the first has failed [s]."""

FD_LENGTHS = frozenset([*range(9), 12, 16, 20, 24, 32, 48, 64])


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
    if len(datagram) < HEADER.size:
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
        """Frames that found the queue full, and frames that senders say were lost for this participant."""
        self.failure: OSError | None = None
        """Of a receive that failed, until recv() has told it. The next one is tried all the same."""
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
                if self._stopping:
                    return
                self.failure = error
                if self._socket.fileno() < 0:
                    return
                time.sleep(RETRY_S)  # for want of memory, for example: it passes
                continue
            if self._stopping:
                return
            msg = decode(datagram)
            if msg is None:
                self.malformed += 1
                continue
            self.dropped += datagram[LOST_OFFSET]
            msg.timestamp = time.time()
            msg.channel = self._channel
            self.put(msg)


class UnixBus(can.BusABC):
    """A participant of a unixbus.

    Threads: recv, send and shutdown may be called from any thread; send takes a lock, and waits for no participant.

    Attributes:
        channel_info: the bus and its folder, for people.
    """

    def __init__(
        self,
        channel: Channel = "bus0",
        can_filters: CanFilters | None = None,
        receive_own_messages: bool = False,
        rx_queue_size: int = 65536,
        create: bool = True,
        **kwargs: object,
    ) -> None:
        """Joins a bus.

        Args:
            channel: name of the bus, or the path of its folder if it contains a slash.
            can_filters: filters as python-can has them (applied here, in software).
            receive_own_messages: recv() also gives what this object has sent (with ``is_rx`` false).
            rx_queue_size: frames that can wait for recv(); more are dropped and counted.
            create: whether the bus's folder is made if it is missing.
            **kwargs: settings for all interfaces, such as ``bitrate`` and ``fd``, which a virtual bus has no use for.

        Raises:
            can.CanInitializationError: the folder or the socket cannot be made, or the bus is full; with `create`
                false, there is no such bus (error_code ENOENT).
        """
        self.channel = str(channel)
        self._receive_own_messages = receive_own_messages
        self._sent = 0
        self._check_due = time.monotonic() + CHECK_S
        self._can_protocol = can.CanProtocol.CAN_FD
        try:
            folder = bus_folder(self.channel, create)
            self._own = folder / f"{os.getpid()}-{secrets.token_hex(4)}.sock"
            self._socket = self._join()
        except NoSuchBusError as error:
            raise can.CanInitializationError(str(error.strerror), error.errno) from error
        except (OSError, ValueError) as error:
            raise can.CanInitializationError(
                f"cannot join the bus {self.channel!r}: {error}; CANOPY_BUS_DIR names another folder for buses",
                error.errno if isinstance(error, OSError) else None,
            ) from error
        self._sender = Sender(self._own)
        self._receiver = _Receiver(self._socket, self.channel, rx_queue_size)
        self.channel_info = f"canopy unixbus {self.channel} ({folder})"
        super().__init__(channel, can_filters, **kwargs)

    def _join(self) -> socket.socket:
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            join(sock, self._own)
        except OSError:
            sock.close()
            raise
        return sock

    @property
    def counters(self) -> dict[str, int]:
        """What was lost and seen since the bus was joined: ``sent``, ``tx_dropped``, ``rx_dropped``, ``malformed``.

        ``tx_dropped`` counts once for each frame and participant that did not take it in time; ``rx_dropped`` what this
        participant was too slow for, also where a sender has seen it and told.
        """
        return {
            "sent": self._sent,
            "tx_dropped": self._sender.dropped,
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
                self._tell_trouble()
                if left <= 0:
                    return None, False

    def _tell_trouble(self) -> None:
        """Nothing has come: is that because nothing can come?"""
        failure, self._receiver.failure = self._receiver.failure, None
        if failure is not None:
            raise can.CanOperationError(f"cannot receive: {failure}", failure.errno)
        if self._is_shutdown:
            raise can.CanOperationError("the bus was shut down")
        now = time.monotonic()
        if now >= self._check_due:
            self._check_due = now + CHECK_S
            try:
                self._sender.check()
            except LeftBusError as error:
                raise _left(error) from error
            except OSError as error:
                raise can.CanOperationError(f"cannot look at the bus: {error}", error.errno) from error

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Sends a frame to all other participants.

        Args:
            msg: the frame.
            timeout: None or 0: waits for nobody; one that is full is offered the frame for LATE_S more, then it is lost
                for him and counted. Positive: waits for all of them up to this time in all [s].

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
        patience_s = max(timeout or 0.0, 0.0)
        try:
            lost = self._sender.send(datagram, patience_s)
        except LeftBusError as error:
            raise _left(error) from error
        except OSError as error:
            raise can.CanOperationError(f"cannot send: {error}", error.errno) from error
        self._sent += 1
        if self._receive_own_messages:
            self._receiver.put(_own_copy(msg, self.channel))
        if lost and patience_s:
            raise can.CanTimeoutError(f"{lost} participants of {self.channel} did not take the frame in {timeout} s")

    def shutdown(self) -> None:
        """Leaves the bus and removes the own socket. Can be called again."""
        if self._is_shutdown:
            return
        super().shutdown()
        self._sender.close()
        with contextlib.suppress(OSError):
            self._own.unlink()
        self._receiver.stop()
        self._socket.close()

    @staticmethod
    def _detect_available_configs() -> Sequence[AutoDetectedConfig]:
        """The buses that exist, for ``can.detect_available_configs``."""
        return [{"interface": "canopy", "channel": name} for name in bus_names()]


def _left(error: LeftBusError) -> can.CanOperationError:
    return can.CanOperationError(f"left the bus: {error}; open it anew", error.errno)


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
