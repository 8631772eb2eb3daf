# SPDX-License-Identifier: MIT
"""The way out to the other participants of a unixbus: nobody is waited for, and everybody loses his own frames only.

Each participant is sent to through a socket of its own: what one does not read fills no buffer that another one needs.
A frame that a full participant does not take at once is offered again for LATE_S, by a thread that lives as long as
somebody is behind; then it is lost for that participant, and counted, and told with the next frame that he takes.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import stat
import threading
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from canopy.can_bus.folder import PARTICIPANTS_MAX, SOCKET_NAME

LATE_S = 0.1
"""How long a frame is offered to a participant that is full: an old command must not arrive late [s]."""

BACKLOG = 4096
"""Newest sent frames that are kept for participants that are full."""

LOST_OFFSET = 3
"""Byte of the header: how many frames of the sender the receiver has lost before this one."""

SETTLE_NS = 100_000_000
"""A folder read within this time after its mtime is read again: the kernel's clock for stamps is coarse [ns]."""

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.001, 0.016
_TOLD_MAX = 255
_GONE = {errno.ECONNREFUSED, errno.ENOENT, errno.EPIPE, errno.ECONNRESET, errno.ENOTCONN, errno.EPROTOTYPE}


class LeftBusError(OSError):
    """The folder of the bus, or the own socket in it, is gone."""


@dataclass
class _Frame:
    datagram: bytes
    late_at: float


@dataclass
class _Peer:
    path: str
    next: int
    """Number of the frame that it gets next."""
    sock: socket.socket | None = None
    untold: int = 0
    """Frames that it has lost and was not told of."""
    pause: float = 0.0
    retry_at: float = 0.0

    def close(self) -> None:
        if self.sock is not None:
            self.sock.close()
            self.sock = None


class Sender:
    """Sends datagrams to everybody in a folder but oneself. Any thread.

    Attributes:
        dropped: frames lost on the way out, counted once for each participant that lost one.
    """

    def __init__(self, own: Path) -> None:
        self.dropped = 0
        self._own = own
        self._lock = threading.Lock()
        self._peers: dict[str, _Peer] = {}
        self._unreached = 0
        self._frames: deque[_Frame] = deque(maxlen=BACKLOG)
        self._head = 0
        self._modified_ns = 0
        self._settled = False
        self._was_read = False
        self._is_catching_up = False
        self._closed = False

    def check(self) -> None:
        """Looks whether the bus is still there.

        Raises:
            LeftBusError: It is not.
            OSError: The folder could not be read yet.
        """
        with self._lock:
            self._refresh()

    def send(self, datagram: bytes, patience_s: float = 0.0) -> int:
        """Sends to every participant.

        Args:
            datagram: A frame, as docs/unixbus.md has it.
            patience_s: Until when to wait for those that are full [s]; 0: not at all.

        Returns:
            How many have not got it in that time.

        Raises:
            LeftBusError: The bus is gone.
            OSError: The folder could not be read yet.
        """
        end = time.monotonic() + patience_s
        with self._lock:
            self._refresh()
            number = self._head
            self._head += 1
            self._frames.append(_Frame(datagram, max(end, time.monotonic() + LATE_S)))
            self.dropped += self._unreached
            behind = self._serve_all(keeping_up_only=True)
            if behind and not self._is_catching_up:
                self._is_catching_up = True
                threading.Thread(target=self._catch_up, name=f"unixbus {self._own.name}", daemon=True).start()
        while behind and time.monotonic() < end:
            time.sleep(_FIRST_PAUSE_S)
            with self._lock:
                behind = any(peer.next <= number for peer in self._peers.values())
        with self._lock:
            return sum(peer.next <= number for peer in self._peers.values())

    def close(self) -> None:
        """Waits, LATE_S at most, until everybody who takes frames has got all of them."""
        end = time.monotonic() + LATE_S
        while time.monotonic() < end:
            with self._lock:
                if all(peer.next == self._head or peer.untold for peer in self._peers.values()):
                    break
            time.sleep(_FIRST_PAUSE_S)
        with self._lock:
            self._closed = True
            for peer in self._peers.values():
                peer.close()
            self._peers.clear()

    def _catch_up(self) -> None:
        """The thread: as long as somebody is behind."""
        while True:
            room = select.poll()
            with self._lock:
                if self._closed or not self._serve_all(keeping_up_only=False):
                    self._is_catching_up = False
                    return
                behind = [peer for peer in self._peers.values() if peer.next < self._head]
                waiting = {peer.sock.fileno(): peer for peer in behind if peer.sock is not None}
                pause = max(0.0, min(peer.retry_at for peer in behind) - time.monotonic())
            for number in waiting:
                room.register(number, select.POLLOUT)
            for number, _ in room.poll(1 + 1000 * pause):
                waiting[number].retry_at = 0.0

    def _serve_all(self, *, keeping_up_only: bool) -> bool:
        """Gives everybody what is due; returns whether somebody is still behind. With the lock."""
        now = time.monotonic()
        behind = False
        for path, peer in list(self._peers.items()):
            due = now >= peer.retry_at and (not keeping_up_only or peer.next == self._head - 1)
            if due and not self._serve(peer, now):
                peer.close()
                del self._peers[path]
                continue
            behind = behind or peer.next < self._head
        return behind

    def _serve(self, peer: _Peer, now: float) -> bool:
        """Gives one participant what it has not got; False: it is gone."""
        while peer.next < self._head:
            place = len(self._frames) - (self._head - peer.next)
            if place < 0:
                self._lose(peer, -place)
            elif now > self._frames[place].late_at:
                self._lose(peer, 1)
            else:
                try:
                    self._deliver(peer, self._frames[place].datagram)
                except OSError as error:
                    if error.errno in _GONE:
                        if error.errno == errno.ECONNREFUSED:  # its owner died without closing
                            with contextlib.suppress(OSError):
                                os.unlink(peer.path)
                        return False
                    # Full, or something that passes: no memory, no descriptor, no right yet.
                    peer.pause = min(max(2 * peer.pause, _FIRST_PAUSE_S), _LONGEST_PAUSE_S)
                    peer.retry_at = now + peer.pause
                    return True
                peer.next += 1
                peer.pause = peer.retry_at = 0.0
        return True

    def _deliver(self, peer: _Peer, datagram: bytes) -> None:
        if peer.sock is None:
            if not stat.S_ISSOCK(os.lstat(peer.path).st_mode):  # a link could lead out of the bus
                raise OSError(errno.EPROTOTYPE, "is no socket", peer.path)
            sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            sock.setblocking(False)
            try:
                sock.connect(peer.path)
            except OSError:
                sock.close()
                raise
            peer.sock = sock
        told = min(peer.untold, _TOLD_MAX)
        if told:
            datagram = datagram[:LOST_OFFSET] + bytes([told]) + datagram[LOST_OFFSET + 1 :]
        peer.sock.send(datagram)
        peer.untold -= told

    def _lose(self, peer: _Peer, frames: int) -> None:
        peer.next += frames
        peer.untold += frames
        self.dropped += frames

    def _refresh(self) -> None:
        """Reads the folder again where it has changed; what cannot be read just now is read the next time."""
        try:
            modified_ns = self._own.parent.stat().st_mtime_ns
            if self._settled and modified_ns == self._modified_ns:
                return
            now_ns = time.time_ns()
            names = os.listdir(self._own.parent)
            if self._own.name not in names:
                raise FileNotFoundError(errno.ENOENT, "somebody deleted it", str(self._own))
        except (FileNotFoundError, NotADirectoryError) as error:
            self._settled = False
            raise LeftBusError(error.errno, error.strerror, error.filename) from error
        except OSError:
            self._settled = False
            if not self._was_read:  # nobody knows who is there
                raise
            return
        self._was_read = True
        self._modified_ns = modified_ns
        self._settled = now_ns - modified_ns > SETTLE_NS
        folder = str(self._own.parent)
        there = [f"{folder}/{name}" for name in names if SOCKET_NAME.fullmatch(name) and name != self._own.name]
        self._unreached = max(0, len(there) - PARTICIPANTS_MAX)
        there = there[:PARTICIPANTS_MAX]
        for path in self._peers.keys() - set(there):
            self._peers.pop(path).close()
        for path in there:
            if path not in self._peers:
                self._peers[path] = _Peer(path, self._head)
