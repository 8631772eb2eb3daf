# SPDX-License-Identifier: MIT
"""Decodes the trace frames of a controller (docs/trace.md) into the state of its tree, tick by tick.

Pure: no clock, no bus. Any bytes may be fed; what is no trace frame of this model is refused, counted, and changes
nothing else.

What is shown as certain is so. After a lost frame every code that was received before is unknown, until a CanopyChange
or a CanopySnapshot brings it again; and where the controller says that it could not tell all, what it has not told is
not certain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from canopy.live.codes import NO_CODE, NOTHING_KNOWN, UNKNOWN, NodeState, Status
from canopy.live.frames import SNAPSHOT_NODES, ArrivalsFrame, ChangeFrame, SnapshotFrame, TickFrame, ValueFrame
from canopy.live.health import CAN_STATES, BusState, Health, read_bus_state, read_health
from canopy.live.tick import OpenTick
from canopy.live.trace_model import VERSION
from canopy.live.values import Slots, ValueState
from canopy.model import Model
from canopy.replay import e2e

__all__ = ["CAN_STATES", "BusState", "Health", "NodeState", "Status", "TraceDecoder", "TreeView", "ValueState"]

_FRAME_BYTES = 8
_SEQUENCES = 64
_TICKS = 1 << 32
_MORE_AGES = 3
_HEALTH_OVERRUNS_MAX = 0xFFFF

Views = tuple["TreeView", ...]


@dataclass(frozen=True)
class TreeView:
    """The tree after one tick, as far as the trace tells."""

    tick: int
    """Ticks since the controller's start; does not wrap."""
    root_status: Status
    nodes: tuple[NodeState, ...]
    values: tuple[ValueState, ...]
    """In the order of the model's."""
    complete: bool
    """All frames that this tick has announced have been received."""
    overruns: int
    """Ticks that took too long since the controller's start: at least so many."""
    lost: int
    """Trace frames that never arrived, since the decoder's start: at least so many."""
    ticks_missed: int
    """Ticks of which not even CanopyTick arrived, since the decoder's start."""
    restarts: int
    """How often the controller was seen to start anew."""
    refused: int
    """Frames with a trace id that were no trace frames of this model, those with a wrong CRC too."""
    crc_errors: int
    """Of these: CanopyTick frames with a wrong CRC. Only where they are guarded."""
    health: Health
    bus: BusState | None
    """None until the first CanopyInputs."""

    @property
    def statuses(self) -> tuple[Status, ...]:
        """What each node is; UNKNOWN where that is not certain."""
        return tuple(node.status for node in self.nodes)


def mismatch(model: Model, data: bytes) -> str | None:
    """Compares a model with a CanopyModel frame's 8 bytes: None when they agree, else what is wrong and the way out."""
    if data[0] >> 4 != VERSION:
        return other_version(model, data[0] >> 4)
    if data[0] & 0x0F:
        return None  # the page of the time
    digits, nodes = f"{int.from_bytes(data[1:5], 'little'):08x}", int.from_bytes(data[5:7], "little")
    if (digits, nodes) == (model.hash[:8], len(model.nodes)):
        return None
    return (
        f"{model.path}: is not the model of the tree that the controller runs: that one has {nodes} nodes and the hash "
        f"{digits}…, the file has {len(model.nodes)} nodes and {model.hash[:8]}…; give the model file that was built "
        "with the firmware, or with the tree image (canopy image build --model)"
    )


def other_version(model: Model, version: int) -> str:
    """What to say of a trace of another version."""
    return (
        f"{model.path}: the frames with the id 0x{model.trace.base:X} are no CanopyTick of trace version {VERSION}, "
        f"but of version {version}, or of an older one without a number, or somebody else's; use the release of Canopy "
        "that the firmware was built with"
    )


class TraceDecoder:
    """Feed it the bus's data frames in their order; it gives a TreeView for each tick."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.lost = 0
        self.ticks_missed = 0
        self.restarts = 0
        self.refused = 0
        self.crc_errors = 0
        self.health = Health()
        self.bus: BusState | None = None
        self.mismatch: str | None = None
        """Why nothing can be told of this controller with this model: another tree, another version; None: it can."""
        self._codes = [UNKNOWN] * len(model.nodes)
        """Told last."""
        self._states = (NOTHING_KNOWN,) * len(model.nodes)
        self._settled = True
        """Of the last tick every known code was certain, and none has changed since."""
        self._slots = Slots(model.trace)
        self._tick: OpenTick | None = None
        self._newest: OpenTick | None = None
        """The tick at hand, or one that is over without a stray frame."""
        self._last_tick: int | None = None
        self._sequence: int | None = None
        self._gap = 0  # lost frames since the last CanopyTick; counted when the next one shows that this was no restart
        self._overruns = 0
        self._takers: dict[int, Callable[[bytes], Views]] = {
            model.trace.ids[name]: taker
            for name, taker in (
                ("CanopyTick", self._take_tick),
                ("CanopyInputs", self._take_inputs),
                ("CanopyArrivals", self._take_arrivals),
                ("CanopySnapshot", self._take_snapshot),
                ("CanopyChange", self._take_change),
                ("CanopyValue", self._take_value),
                ("CanopyHealth", self._take_health),
                ("CanopyModel", self._take_model),
            )
        }

    def feed(self, identifier: int, data: bytes) -> Views:
        """Takes one data frame.

        Args:
            identifier: Arbitration id; other ids than the trace's are passed over.
            data: The frame's bytes.

        Returns:
            The views of the ticks that this frame completes: none, one, or two when a tick without further frames
            follows on one that stayed incomplete.
        """
        taker = self._takers.get(identifier)
        if taker is None:
            return ()
        if len(data) != _FRAME_BYTES:
            return self._refuse()
        refused, tick = self.refused, self._tick
        views = taker(data)
        if self._tick is None:
            return views
        self._tick.is_followed |= self._tick is tick and self.refused == refused
        return views + self._finish() if self._tick.is_over else views

    def flush(self) -> Views:
        """Gives up waiting for the rest of the tick at hand; call it when the bus has been silent for some periods."""
        return self._finish()

    def _refuse(self) -> Views:
        self.refused += 1
        return ()

    def _take_tick(self, data: bytes) -> Views:
        frame = TickFrame.read(data)
        guard = self.model.trace.guard
        if guard is not None and e2e.crc(guard, data) != data[0]:
            self.crc_errors += 1
            return self._refuse()
        if frame.version != VERSION:
            self.mismatch = other_version(self.model, frame.version)
            return self._refuse()
        if frame.root_status not in range(Status.RUNNING, Status.SKIPPED + 1):
            return self._refuse()
        views = self._finish()
        goes_on = self._last_tick is not None and self._last_tick % _TICKS == _TICKS - 1
        if self._last_tick is None:
            self._last_tick, self._overruns = frame.tick, frame.overruns
            self._follow(frame.sequence)
            self.lost += self._gap
        else:
            self._advance(self._last_tick, frame)
        if frame.tick == frame.sequence == 0 and not goes_on:
            self._know_the_start()
        self._gap = 0
        self._slots.begin()
        self._tick = self._newest = OpenTick(self._last_tick, frame)
        return views

    def _advance(self, last: int, frame: TickFrame) -> None:
        """From the CanopyTick before to this one: what is missing in between, or that the controller was restarted."""
        advance = frame.tick - last % _TICKS
        if advance == 1 - _TICKS:
            advance = 1  # 0 behind the largest number
        if advance < 1:
            self.restarts += 1
            self.health, self.bus = Health(), None
            self._last_tick, self._sequence, self._overruns = frame.tick, frame.sequence, frame.overruns
            self._forget_all()
            return
        self._follow(frame.sequence)
        self._last_tick = last + advance
        self._overruns += (frame.overruns - self._overruns) % 4
        # The sequence tells the number of lost frames modulo 64; each missed tick had at least one.
        self.ticks_missed += advance - 1
        self.lost += self._gap + _SEQUENCES * -(-max(0, advance - 1 - self._gap) // _SEQUENCES)
        if advance > 1:
            self._forget_all()

    def _know_the_start(self) -> None:
        self._codes = [0] * len(self._codes)
        self._states = (NodeState(0, True, 0, True),) * len(self._codes)
        self._settled = True
        self._slots.know()

    def _take_inputs(self, data: bytes) -> Views:
        state = read_bus_state(data)
        if state is None:
            return self._refuse()
        if self._tick is None or self._tick.is_followed:
            return self._take_foreign(None)
        self.bus = state
        self._tick.take_inputs(data[5] >> 5 & 3 == _MORE_AGES)
        return ()

    def _take_arrivals(self, data: bytes) -> Views:
        frame = ArrivalsFrame.read(data)
        if frame is None:
            return self._refuse()
        if self._newest is None or not self._newest.may_have(frame):
            return self._take_foreign(None)
        self._newest.take_arrivals(frame)
        return ()

    def _take_snapshot(self, data: bytes) -> Views:
        frame = SnapshotFrame.read(data)
        codes = frame.codes[: len(self._codes) - frame.first] if frame.first < len(self._codes) else ()
        if not codes or NO_CODE in codes or set(frame.codes[len(codes) :]) - {NO_CODE}:
            return self._refuse()
        tick = self._tick
        if tick is None or not tick.expects_snapshot(frame):
            return self._take_foreign(frame.sequence)
        self._follow(frame.sequence)
        tick.take_snapshot()
        self._tell(tick, range(frame.first, frame.first + SNAPSHOT_NODES), codes)
        return ()

    def _take_change(self, data: bytes) -> Views:
        frame = ChangeFrame.read(data)
        if frame is None or frame.nodes[-1] >= len(self._codes):
            return self._refuse()
        tick, missing = self._tick, self._missing(frame.sequence)
        if tick is None or not tick.expects_change(frame, self.model.trace.changes_max):
            return self._take_foreign(frame.sequence)
        if not tick.goes_round(frame):
            return self._refuse()
        if missing and tick.last is not None:
            self._forget_between(tick.last, frame.nodes[0])
            self._follow(frame.sequence, forget=False)
        else:
            self._follow(frame.sequence)
        tick.take_change(frame, missing)
        self._tell(tick, frame.nodes, frame.codes)
        return ()

    def _take_value(self, data: bytes) -> Views:
        frame = ValueFrame.read(data)
        if not self._slots.has(frame.slot):
            return self._refuse()
        tick = self._tick
        if tick is None or not tick.expects_value(frame):
            return self._take_foreign(None)
        if self._slots.was_told(frame.slot):
            return self._refuse()
        tick.take_value()
        self._slots.take(frame.slot, frame.bits, frame.more)
        return ()

    def _take_foreign(self, sequence: int | None) -> Views:
        """A frame of a tick whose CanopyTick was lost. So the one at hand is over."""
        views = self._finish()
        self._newest = None
        if sequence is not None:
            self._follow(sequence)
        self._forget_codes()
        return views

    def _take_health(self, data: bytes) -> Views:
        health = read_health(data, self.health)
        if health is None:
            return self._refuse()
        self.health = health
        if health.overruns is not None and health.overruns < _HEALTH_OVERRUNS_MAX:
            self._overruns = max(self._overruns, health.overruns)
        return ()

    def _take_model(self, data: bytes) -> Views:
        if data[0] & 0x0F > 1:
            return self._refuse()
        if data[0] >> 4 != VERSION or data[0] & 0x0F == 0:
            self.mismatch = mismatch(self.model, data)
        return ()

    def _missing(self, sequence: int) -> int:
        """How many frames are missing before the one with this number, modulo 64."""
        return (sequence - self._sequence - 1) % _SEQUENCES if self._sequence is not None else 0

    def _follow(self, sequence: int, forget: bool = True) -> None:
        missing = self._missing(sequence)
        self._sequence = sequence
        self._gap += missing
        if missing and forget:
            self._forget_codes()

    def _tell(self, tick: OpenTick, nodes: range | tuple[int, ...], codes: tuple[int, ...]) -> None:
        for node, code in zip(nodes, codes, strict=False):
            self._codes[node] = code
            tick.told.add(node)
        self._settled = False

    def _forget_codes(self) -> None:
        self._codes = [UNKNOWN] * len(self._codes)
        self._settled = False

    def _forget_between(self, last: int, first: int) -> None:
        """The nodes behind `last` and before `first`, going around."""
        count = len(self._codes)
        for step in range(1, (first - last) % count):
            self._codes[(last + step) % count] = UNKNOWN
        self._settled = False

    def _forget_all(self) -> None:
        self._forget_codes()
        self._states = (NOTHING_KNOWN,) * len(self._codes)
        self._slots.forget()

    def _finish(self) -> Views:
        tick, self._tick = self._tick, None
        if tick is None:
            return ()
        if not (self._settled and tick.tells_all):
            self._states = tuple(
                self._state(tick, code, before, node)
                for node, (code, before) in enumerate(zip(self._codes, self._states, strict=True))
            )
            self._settled = tick.tells_all
        if tick.nodes_left:
            self._forget_codes()
        view = TreeView(
            tick=tick.number,
            root_status=Status(tick.root_status),
            nodes=self._states,
            values=self._slots.end(not tick.values_left),
            complete=tick.is_complete,
            overruns=self._overruns,
            lost=self.lost,
            ticks_missed=self.ticks_missed,
            restarts=self.restarts,
            refused=self.refused,
            crc_errors=self.crc_errors,
            health=self.health,
            bus=self.bus,
        )
        return (view,)

    @staticmethod
    def _state(tick: OpenTick, code: int, before: NodeState, node: int) -> NodeState:
        """Of a node when a tick is over; `before`: when the last one was, with nothing known where one was missed."""
        if code == UNKNOWN:
            return NOTHING_KNOWN
        if not tick.tells(node):
            return NodeState(code, False, None, False)
        if not before.certain:
            return NodeState(code, True, tick.number, False)
        return before if before.code == code else NodeState(code, True, tick.number, True)
