# SPDX-License-Identifier: MIT
"""A CAN bus that outlives its interface: link down, up, gone and made anew are states, and no end.

What happens is said once when it begins and once when it is over, counted, and handed out as a Gap.
"""

from __future__ import annotations

import errno
import socket
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import can
from can.interfaces.socketcan import SocketcanBus

from canopy.can_bus.folder import NoSuchBusError, bus_folder
from canopy.can_bus.link import is_up
from canopy.canbus import CanBusError, open_bus, receive_losses, split_spec
from canopy.process.say import Voice

RETRY_S = 0.05
"""Between two looks at a bus that is away [s]."""

LOOK_S = 0.5
"""How often a silent interface is asked whether it is up [s]."""

GAPS_MAX = 1000
"""The newest gaps are kept; all are counted."""

FAILURES_MAX = 20
"""Receives in a row that fail before the bus is opened again."""

_OVER = {None, errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.EBADF}
_NO_ROOM = {errno.ENOBUFS, errno.EAGAIN}


@dataclass(frozen=True)
class Gap:
    """A time in which nothing could be received."""

    began: float
    """Seconds since 1970."""
    seconds: float
    why: str


class SteadyBus(can.BusABC):
    """A bus by its name in Canopy's tools. Where recv() finds it away, it waits like on a silent one.

    send() raises can.CanOperationError with ENETDOWN while the bus is away.

    Attributes:
        heard: frames received.
        outages: how often the bus went away.
        gaps: the newest GAPS_MAX of these times, once they are over.
        on_gap: called with each Gap when it is over.
    """

    def __init__(
        self, spec: str, voice: Voice, *, create: bool = False, receive_buffer: int | None = None, fd: bool = False
    ) -> None:
        """Opens the bus. A unixbus that is not there yet is waited for, in recv().

        Args:
            spec: as for canopy.canbus.open_bus().
            voice: says what happens.
            create: whether a unixbus is made if it is missing: for participants, not for listeners.
            receive_buffer: bytes to ask the kernel for, for SocketCAN.
            fd: whether CAN FD frames are received, for SocketCAN. A unixbus always does.

        Raises:
            CanBusError: There is no such bus, and nobody can be waited for who would make it.
        """
        self.heard = 0
        self.outages = 0
        self.gaps: deque[Gap] = deque(maxlen=GAPS_MAX)
        self.on_gap: Callable[[Gap], None] | None = None
        self._kind, self._channel = split_spec(spec)
        self._spec = spec
        self._voice = voice
        self._create = create
        self._receive_buffer = receive_buffer
        self._options = {"fd": True} if fd and self._kind == "socketcan" else {}
        self._inner: can.BusABC | None = None
        self._counted: dict[str, int] = {}
        self._lost: int | None = 0
        self._away_since = 0.0
        self._away_wall = 0.0
        self._why, self._is_said = "", False
        self._retry_at = 0.0
        self._failures = 0
        self._look_at = 0.0
        self._can_protocol = can.CanProtocol.CAN_FD if fd else can.CanProtocol.CAN_20
        self.channel_info = spec
        if self._kind == "socketcan" and is_up(self._channel) is False:
            self._go_away("is down", first=True)
        elif not self._is_awaited_unixbus():
            self._open()
        super().__init__(spec)

    @property
    def is_away(self) -> bool:
        """Nothing can be received or sent just now."""
        return self._inner is None

    @property
    def counters(self) -> dict[str, int]:
        """The driver's own counters where it has some, of all times that it was open, and `outages`."""
        total = dict(self._counted)
        for name, value in getattr(self._inner, "counters", {}).items():
            total[name] = total.get(name, 0) + value
        return {**total, "outages": self.outages}

    def losses(self) -> int | None:
        """Frames that came and were lost because nobody fetched them in time; None where that is not to be known."""
        now = receive_losses(self._inner) if self._inner is not None else 0
        return None if now is None or self._lost is None else self._lost + now

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            now = time.monotonic()
            left = LOOK_S if end is None else max(0.0, min(LOOK_S, end - now))
            if self._inner is None and not self._come_back():
                self._say_away()
                if end is not None and now >= end:
                    return None, True
                time.sleep(min(left, RETRY_S))
                continue
            message = self._receive(left)
            if message is not None:
                self.heard += 1
                return message, True
            if end is not None and time.monotonic() >= end:
                return None, True

    def _receive(self, timeout: float) -> can.Message | None:
        assert self._inner is not None
        try:
            message = self._inner.recv(timeout)
        except (can.CanError, OSError, ValueError) as error:  # ValueError: select() on a socket that is closed
            self._failures += 1
            if self._failures >= FAILURES_MAX or self._is_over(error):
                self._go_away(self._reason(error))
            else:  # for want of memory, for example: it passes
                self._voice.say(f"{self._spec}: {error}", "receive")
                time.sleep(min(timeout, RETRY_S))
            return None
        self._failures = 0
        now = time.monotonic()
        if message is None and self._kind == "socketcan" and now >= self._look_at:
            self._look_at = now + LOOK_S
            if is_up(self._channel) is False:  # a socket tells only once
                self._go_away("is down")
        return message

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """As python-can's, but that a bus that went away is no error of the frame's.

        Raises:
            can.CanOperationError: The frame is not out: ENETDOWN while the bus is away, ENOBUFS or EAGAIN when there is
                no room, otherwise no bus can carry it.
        """
        if self._inner is None and not self._come_back():
            raise can.CanOperationError(f"{self._spec} {self._why}", errno.ENETDOWN)
        assert self._inner is not None
        try:
            self._inner.send(msg, timeout)
        except (can.CanError, OSError) as error:
            number = error.error_code if isinstance(error, can.CanError) else error.errno
            if number is None or number in _NO_ROOM or not self._is_over(error):
                raise can.CanOperationError(str(error), number) from error
            self._go_away(self._reason(error))
            raise can.CanOperationError(f"{self._spec} {self._why}", errno.ENETDOWN) from error

    def shutdown(self) -> None:
        """Leaves the bus. Can be called again."""
        super().shutdown()
        self._close()

    def _is_awaited_unixbus(self) -> bool:
        """Looks for a bus that is missing, but that a controller could make any time."""
        if self._kind != "unixbus" or self._create:
            return False
        try:
            folder = bus_folder(self._channel, create=False)
        except NoSuchBusError as error:
            if "/" in self._channel and not Path(self._channel).parent.is_dir():
                raise CanBusError(f"cannot open {self._spec}: {error.strerror}") from error
            self._go_away(f"is not there yet ({error.strerror})", first=True)
            return True
        except (OSError, ValueError):
            return False  # open_bus() says it better
        return not folder.is_dir()

    def _open(self) -> None:
        options = {"create": self._create} if self._kind == "unixbus" else self._options
        bus = open_bus(self._spec, **options)
        if isinstance(bus, SocketcanBus) and self._receive_buffer is not None:  # the kernel gives as much as it likes
            bus.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self._receive_buffer)
        self._inner = bus
        self._look_at = time.monotonic() + LOOK_S
        self._failures = 0

    def _is_over(self, error: Exception) -> bool:
        """Whether only opening the bus again can help."""
        number = error.error_code if isinstance(error, can.CanError) else getattr(error, "errno", None)
        if self._kind == "socketcan":
            return number in _OVER or is_up(self._channel) is not True
        return number in (None, errno.ENOENT, errno.ENOTDIR)

    def _reason(self, error: Exception) -> str:
        if self._kind == "socketcan":
            up = is_up(self._channel)
            if up is not True:
                return "is gone" if up is None else "is down"
        return f"has failed: {error}"

    def _go_away(self, why: str, first: bool = False) -> None:
        self._close()
        self._why, self._is_said = why, False
        self._away_since, self._away_wall = time.monotonic(), time.time()
        self._retry_at = self._away_since + RETRY_S
        self.outages += not first
        if not first:  # else when somebody waits for it
            self._say_away()

    def _say_away(self) -> None:
        if not self._is_said:
            self._is_said = True
            self._voice.say(f"{self._spec} {self._why}; waiting for it", "away")

    def _come_back(self) -> bool:
        """Tries, now and then, to open the bus again."""
        now = time.monotonic()
        if now < self._retry_at:
            return False
        self._retry_at = now + RETRY_S
        if self._kind == "socketcan" and not is_up(self._channel):
            return False
        try:
            self._open()
        except (CanBusError, OSError):
            return False
        seconds = time.monotonic() - self._away_since
        if self._is_said:
            self._voice.say(f"{self._spec} is there after {seconds:.1f} s", "back")
        gap = Gap(self._away_wall, round(seconds, 3), self._why)
        self.gaps.append(gap)
        if self.on_gap is not None:
            self.on_gap(gap)
        return True

    def _close(self) -> None:
        inner, self._inner = self._inner, None
        if inner is None:
            return
        for name, value in getattr(inner, "counters", {}).items():
            self._counted[name] = self._counted.get(name, 0) + value
        lost = receive_losses(inner)
        self._lost = None if lost is None or self._lost is None else self._lost + lost
        try:
            inner.shutdown()
        except (can.CanError, OSError) as error:
            self._voice.say(f"leaving {self._spec}: {error}", "leaving")
