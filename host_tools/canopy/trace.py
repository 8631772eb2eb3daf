# SPDX-License-Identifier: MIT
"""Decodes the trace frames of a controller (docs/trace.md) into the state of its tree, tick by tick.

Pure: no clock, no bus. Any bytes may be fed; what is no trace frame of this model is refused, counted, and changes
nothing else.

A status is shown only when it is certain. After a lost frame every status that was received before is unknown, until a
Change or a Snapshot brings it again: a tree of up to ten nodes is known again in the next tick. One thing no receiver
can see: when more nodes change in a tick than the controller may trace, the rest arrive with the next ticks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from canopy.model import Model


class Status(IntEnum):
    """Status codes of a trace. PREVIOUSLY + s: the node is IDLE now, its parent has reset it, and it was s before."""

    UNKNOWN = -1
    IDLE = 0
    RUNNING = 1
    SUCCESS = 2
    FAILURE = 3
    SKIPPED = 4
    PREVIOUSLY = 8


_NO_STATUS = 15
_NO_NODE = 0xFFFF
_SNAPSHOT_NODES = 10
_FRAME_BYTES = 8
_NODE_CODES = frozenset({0, 1, 2, 3, 4, 8, 9, 10, 11, 12})
_ROOT_CODES = frozenset({0, 1, 2, 3, 4})
_BACK = 1 << 31  # a tick number that seems to have advanced by more has gone back
_TICKS = 1 << 32


def status_name(code: int) -> str:
    """E.g. "RUNNING", "IDLE (was RUNNING)", "unknown"."""
    if code == Status.UNKNOWN:
        return "unknown"
    if code > Status.PREVIOUSLY:
        return f"IDLE (was {Status(code - Status.PREVIOUSLY).name})"
    return Status(code).name


def _plain(code: int) -> int:
    """IDLE that was IDLE before is just IDLE."""
    return int(Status.IDLE) if code == Status.PREVIOUSLY else code


_FILTERED = 0xFFFF


@dataclass(frozen=True)
class Health:
    """The controller's loss counters since its start; each stops at 65535."""

    rx_rejected: int = 0
    rx_unknown: int = 0
    """65535 also where the driver's filter hands over no unknown frames."""
    tx_dropped: int = 0
    """Commands that were replaced or expired before they left, and trace frames that found no room."""
    faults: int = 0

    @property
    def unknown(self) -> int | None:
        """Frames of no message of the controller; None: they are filtered, or too many to count."""
        return self.rx_unknown if self.rx_unknown != _FILTERED else None


CAN_STATES = ("error-active", "error-warning", "error-passive", "blocked", "bus-off", "down", "gone")
"""The state of the bus by its number in CanopyArrivals (runtime/include/canopy/can_state.h)."""


@dataclass(frozen=True)
class BusState:
    """What the controller said last of its bus."""

    can_state: int
    """Index of CAN_STATES."""
    overload: bool
    """Frames come faster than they are taken, or were lost: what the tree sees may not be all."""
    returning: bool
    """Safe values go out instead of the tree's, until the bus has shown that it works again."""

    @property
    def is_good(self) -> bool:
        """As it should be."""
        return not (self.can_state or self.overload or self.returning)

    def text(self) -> str:
        """For people, e.g. "blocked, overload"."""
        more = [*["overload"][: self.overload], *["sends safe values"][: self.returning]]
        return ", ".join([CAN_STATES[self.can_state], *more])


@dataclass(frozen=True)
class TreeView:
    """The tree after one tick, as far as the trace tells."""

    tick: int
    """Ticks since the controller's start; does not wrap."""
    root_status: int
    statuses: tuple[int, ...]
    """For each node a Status, or Status.PREVIOUSLY + one; Status.UNKNOWN where it is not certain."""
    complete: bool
    """All frames of this tick have been received."""
    overruns: int
    """Ticks that took too long since the controller's start: at least so many, exact when joined within 256 of them."""
    lost: int
    """Trace frames that never arrived, since the decoder's start: at least so many."""
    ticks_missed: int
    """Ticks of which not even CanopyTick arrived, since the decoder's start."""
    restarts: int
    """How often the controller was seen to start anew."""
    refused: int
    """Frames with a trace id that were no trace frames of this model."""
    health: Health | None
    """None until the first CanopyHealth."""
    bus: BusState | None
    """None until the first CanopyArrivals."""


def mismatch(model: Model, data: bytes) -> str | None:
    """Compares a model with a CanopyModel frame's 8 bytes: None when they agree, else what is wrong and the way out."""
    digits, nodes = f"{int.from_bytes(data[:4], 'little'):08x}", int.from_bytes(data[4:6], "little")
    if (digits, nodes) == (model.hash[:8], len(model.nodes)):
        return None
    return (
        f"{model.path}: is not the model of the tree that the controller runs: that one has {nodes} nodes and the hash "
        f"{digits}…, the file has {len(model.nodes)} nodes and {model.hash[:8]}…; give the model file that was built "
        "with the firmware, or with the tree image (canopy image build --model)"
    )


@dataclass
class _Tick:
    """The tick whose frames are arriving."""

    number: int
    root_status: int
    changes_left: int
    has_snapshot: bool
    intact: bool = True

    @property
    def frames_left(self) -> int:
        """How many frames of the tick are still to come."""
        return (self.changes_left + 1) // 2 + self.has_snapshot


@dataclass
class TraceDecoder:
    """Feed it the bus's data frames in their order; it gives a TreeView for each tick."""

    model: Model
    tree: int = 0
    lost: int = 0
    ticks_missed: int = 0
    restarts: int = 0
    refused: int = 0
    health: Health | None = None
    bus: BusState | None = None
    mismatch: str | None = None
    """Why the model is not that of the controller which the last CanopyModel came from; None while they agree."""

    _statuses: list[int] = field(init=False)
    _sequence: int | None = None
    _gap: int = 0  # lost frames since the last CanopyTick; counted when the next one shows that this was no restart
    _tick: _Tick | None = None
    _last_tick: int | None = None
    _overruns: int = 0

    def __post_init__(self) -> None:
        self._statuses = [int(Status.UNKNOWN)] * len(self.model.nodes)
        self._names = {identifier: name for name, identifier in self.model.trace.items()}

    def feed(self, identifier: int, data: bytes) -> tuple[TreeView, ...]:
        """Takes one data frame.

        Args:
            identifier: Arbitration id; other ids than the trace's are passed over.
            data: The frame's bytes.

        Returns:
            The views of the ticks that this frame completes: none, one, or two when a tick without further frames
            follows on one that stayed incomplete.
        """
        name = self._names.get(identifier)
        if name is None:
            return ()
        if len(data) != _FRAME_BYTES:
            self.refused += 1
            return ()
        if name == "CanopyTick":
            return self._take_tick(data)
        if name == "CanopyChange":
            return self._take_change(data)
        if name == "CanopySnapshot":
            return self._take_snapshot(data)
        if name == "CanopyHealth":
            self.health = Health(*(int.from_bytes(data[place : place + 2], "little") for place in (0, 2, 4, 6)))
        elif name == "CanopyModel":
            self.mismatch = mismatch(self.model, data)
        elif name == "CanopyArrivals":
            self._take_arrivals(data)
        return ()  # CanopyInputs is for replays

    def flush(self) -> tuple[TreeView, ...]:
        """Gives up waiting for the rest of the tick at hand; call it when the bus has been silent for some periods."""
        if self._tick is None:
            return ()
        self._tick.intact = False
        if self._tick.changes_left:
            self._forget()
        return self._finish()

    def _take_tick(self, data: bytes) -> tuple[TreeView, ...]:
        number = int.from_bytes(data[1:5], "little")
        root_status, tree = data[5] & 15, data[5] >> 4
        if root_status not in _ROOT_CODES:
            self.refused += 1
            return ()
        if tree != self.tree:
            return ()
        advance = (number - (self._last_tick or 0)) % _TICKS
        if self._last_tick is not None and (advance == 0 or advance >= _BACK):
            views = self.flush()
            self._restart(number, data)
        else:
            self._follow(data[0])
            self._count_losses(max(0, advance - 1) if self._last_tick is not None else 0)
            views = self.flush()
            self._overruns = data[7] if self._last_tick is None else self._overruns + (data[7] - self._overruns) % 256
            self._last_tick = number if self._last_tick is None else self._last_tick + advance
        self._gap = 0
        self._tick = _Tick(self._last_tick, root_status, data[6], "CanopySnapshot" in self.model.trace)
        return views + self._finish_when_all_is_there()

    def _take_change(self, data: bytes) -> tuple[TreeView, ...]:
        nodes = [(int.from_bytes(data[1:3], "little"), data[5] & 15)]
        second = (int.from_bytes(data[3:5], "little"), data[5] >> 4)
        if second != (_NO_NODE, _NO_STATUS):
            nodes.append(second)
        if not all(node < len(self._statuses) and code in _NODE_CODES for node, code in nodes):
            self.refused += 1
            return ()
        if data[6] & 15 != self.tree:
            return ()
        views = self._follow_in_tick(data[0])
        for node, code in nodes:
            self._statuses[node] = _plain(code)
        if self._tick is not None:
            self._tick.changes_left = max(0, self._tick.changes_left - len(nodes))
        return views + self._finish_when_all_is_there()

    def _take_snapshot(self, data: bytes) -> tuple[TreeView, ...]:
        first = int.from_bytes(data[1:3], "little")
        codes = [(byte >> shift) & 15 for byte in data[3:] for shift in (0, 4)]
        count = min(_SNAPSHOT_NODES, len(self._statuses) - first)
        if count <= 0 or not _NODE_CODES.issuperset(codes[:count]) or set(codes[count:]) - {_NO_STATUS}:
            self.refused += 1
            return ()
        views = self._follow_in_tick(data[0])
        self._statuses[first : first + count] = map(_plain, codes[:count])
        return views + self._finish()  # it is a tick's last frame: what has not come by now does not come

    def _take_arrivals(self, data: bytes) -> None:
        """The ages are for replays. Bit 7 is not used."""
        state = data[0] & 7
        if state >= len(CAN_STATES) or data[0] & 0x80:
            self.refused += 1
            return
        self.bus = BusState(state, bool(data[0] & 0x08), bool(data[0] & 0x40))

    def _follow_in_tick(self, sequence: int) -> tuple[TreeView, ...]:
        """_follow() for a frame within a tick: the one at hand, or a later one whose CanopyTick was lost.

        The former has only so many frames left. When as many are lost, this frame cannot be one of them.
        """
        tick = self._tick
        missing = self._follow(sequence)
        if tick is None or missing >= tick.frames_left:
            return self.flush()
        # Changes come first in a tick: what is missing before one of its frames were Changes, of two nodes each.
        tick.changes_left = max(0, tick.changes_left - 2 * missing)
        return ()

    def _follow(self, sequence: int) -> int:
        """Compares the frame's sequence number with the one that was due; returns how many are missing between."""
        gap = (sequence - self._sequence - 1) % 256 if self._sequence is not None else 0
        self._sequence = sequence
        if gap:
            self._gap += gap
            self._forget()
        return gap

    def _forget(self) -> None:
        self._statuses = [int(Status.UNKNOWN)] * len(self._statuses)
        if self._tick is not None:
            self._tick.intact = False

    def _count_losses(self, ticks_missed: int) -> None:
        """The sequence tells the number of lost frames modulo 256; each missed tick had at least one."""
        self.ticks_missed += ticks_missed
        wraps = -(-max(0, ticks_missed - self._gap) // 256)
        self.lost += self._gap + 256 * wraps
        if wraps:
            self._forget()

    def _restart(self, number: int, data: bytes) -> None:
        """The new run's sequence has nothing to do with the old one's: what is missing between them is not a loss."""
        self.restarts += 1
        self.health = None
        self.bus = None
        self._last_tick = number
        self._sequence = data[0]
        self._overruns = data[7]
        self._forget()

    def _finish_when_all_is_there(self) -> tuple[TreeView, ...]:
        return self._finish() if self._tick is not None and not self._tick.frames_left else ()

    def _finish(self) -> tuple[TreeView, ...]:
        tick = self._tick
        if tick is None:
            return ()
        self._tick = None
        view = TreeView(
            tick=tick.number,
            root_status=tick.root_status,
            statuses=tuple(self._statuses),
            complete=tick.intact and not tick.changes_left,
            overruns=self._overruns,
            lost=self.lost,
            ticks_missed=self.ticks_missed,
            restarts=self.restarts,
            refused=self.refused,
            health=self.health,
            bus=self.bus,
        )
        return (view,)
