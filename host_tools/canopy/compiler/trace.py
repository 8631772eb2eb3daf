# SPDX-License-Identifier: MIT
"""The trace of an application (docs/trace.md): its ids, its rates, and the values that it tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from canopy.compiler.blackboard import Entry
from canopy.compiler.bus_model import Bus
from canopy.compiler.bus_timing import frame_bits
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.leaf_c import entry_type
from canopy.compiler.limits import EVERY
from canopy.compiler.numbers import plain
from canopy.compiler.table import Table
from canopy.compiler.trace_layout import IDS, VERSION
from canopy.escape.c import mark_c

CHANGES_MAX = 8
"""Most CanopyChange frames of a tick; five nodes each, at best."""
VALUES_MAX = 3
"""Most CanopyValue frames of a tick: CANOPY_TRACE_VALUES_MAX is 7."""
TICKS_DEFAULT = 4
"""Ticks whose trace can wait while the bus lets nothing through."""
CHANGES_WAITING = 2
"""CanopyChange and CanopyValue frames of each of them but one, which may be a full one."""
SLOTS_MAX = 4096
KNOWN_MS = 2000
"""All nodes, and all values, are told once in this time, if one frame in each tick is enough for it."""
HEALTH_MS = 200
"""A page of CanopyHealth; each of the five pages once in a second."""
MODEL_MS = 1000
SNAPSHOT_NODES = 10
AGES_IN_INPUTS = 2
AGES_IN_FRAME = 7
HEALTH_PAGES = 5

_KINDS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("int32_t", "uint32_t"), ("WORD",)),
    **dict.fromkeys(("bool", "uint8_t"), ("U8",)),
    "int8_t": ("I8",),
    "uint16_t": ("U16",),
    "int16_t": ("I16",),
    **dict.fromkeys(("int64_t", "uint64_t"), ("LOW", "HIGH")),
    "float": ("FLOAT",),
    "double": ("DOUBLE_LOW", "DOUBLE_HIGH"),
}
"""C type -> canopy_trace_kind_t of each of its slots."""

Entries = Literal["all", "marked", "none"]


@dataclass(frozen=True)
class TraceOptions:
    """What the command line says. `base`: arbitration id of CanopyTick; the others follow it."""

    base: int
    guard: int | None = None
    """E2E data id of CanopyTick; None: not guarded."""
    entries: Entries = "all"
    ticks: int = TICKS_DEFAULT


@dataclass(frozen=True)
class TracedValue:
    """An entry, or a leaf's reason, in the trace. `member` is where it lies in the application's memory, in C."""

    kind: Literal["entry", "reason"]
    name: str
    path: str
    node: int | None
    type: str
    member: str
    slot: int
    kinds: tuple[str, ...]
    scale: str = ""
    names: tuple[str, ...] = ()
    """Of the numbers 0, 1, …, where they have names."""

    @property
    def slots(self) -> int:
        """How many it takes."""
        return len(self.kinds)

    def as_dict(self) -> dict[str, object]:
        """For the model file."""
        return {
            "kind": self.kind,
            "name": self.name,
            "path": self.path,
            **({"node": self.node} if self.node is not None else {}),
            "type": self.type,
            "slot": self.slot,
            "slots": self.slots,
            **({"scale": self.scale} if self.scale else {}),
            **({"enum": {name: number for number, name in enumerate(self.names)}} if self.names else {}),
        }


@dataclass(frozen=True)
class Trace:
    """The whole configuration; what the runtime's canopy_trace_config_t has, and what a receiver must know."""

    base: int
    extended: bool
    guard: int | None
    ticks: int
    changes_max: int
    values_max: int
    snapshot_every: int
    values_every: int
    health_every: int
    model_every: int
    known_within_ms: int
    values: tuple[TracedValue, ...]
    texts: tuple[str, ...]
    nodes: int
    messages: int

    @property
    def slots(self) -> int:
        """How many values of 32 bits are told."""
        return sum(value.slots for value in self.values)

    @property
    def arrivals_max(self) -> int:
        """Most CanopyArrivals frames of a tick: every message received, each very late, and 256 frames or more."""
        return -(-max(0, 4 + 3 * self.messages - AGES_IN_INPUTS) // AGES_IN_FRAME)

    @property
    def frames_max(self) -> int:
        """Most trace frames of one tick: six of one kind each (two of CanopyModel), and what varies."""
        return 6 + self.arrivals_max + self.changes_max + self.values_max

    @property
    def capacity(self) -> int:
        """Frames that can wait: those of a full tick, and of ticks - 1 in which little changes; a power of two."""
        frames = self.frames_max + (self.ticks - 1) * (2 + self._usual_arrivals + CHANGES_WAITING)
        return 1 << (frames - 1).bit_length()

    @property
    def _usual_arrivals(self) -> int:
        """CanopyArrivals frames of a tick that takes a young frame of every message."""
        return -(-max(0, self.messages - AGES_IN_INPUTS) // AGES_IN_FRAME)

    def frames_a_second(self, period_ms: int, *, worst: bool) -> float:
        """Frames on the bus. `worst`: all that can change changes in every tick; else nothing does.

        Without, the frames of arrivals are those of a tick that takes a young frame of every message.
        """
        varying = self.arrivals_max + self.changes_max + self.values_max if worst else self._usual_arrivals
        in_tick = 2 + varying
        slow = 1 / self.snapshot_every + 1 / self.health_every + 2 / self.model_every
        if self.values and not worst:
            slow += 1 / self.values_every
        return (in_tick + slow) * 1000 / period_ms

    def load_percent(self, period_ms: int, bitrate: int, *, worst: bool) -> float:
        """Share of the bit rate that the trace takes, with the most stuff bits."""
        bits = frame_bits(8, extended=self.extended, fd=False)
        return round(100 * self.frames_a_second(period_ms, worst=worst) * bits / bitrate, 2)

    def as_dict(self) -> dict[str, object]:
        """For the model file."""
        return {
            "version": VERSION,
            "base": self.base,
            "extended": self.extended,
            "guard": self.guard,
            "ticks": self.ticks,
            "changes_max": self.changes_max,
            "values_max": self.values_max,
            "snapshot_every": self.snapshot_every,
            "values_every": self.values_every,
            "health_every": self.health_every,
            "model_every": self.model_every,
            "known_within_ms": self.known_within_ms,
            "values": [value.as_dict() for value in self.values],
            "texts": list(self.texts),
        }


def _entry(entry: Entry, slot: int) -> TracedValue | None:
    """None: a type that the trace cannot tell, a queue or one of the user's."""
    if entry.type.capacity or entry.type.kind in ("user", "any"):
        return None
    c_type = str(entry_type(entry))
    kind = entry.type.kind if entry.type.kind in ("text", "duration") else c_type
    return TracedValue(
        kind="entry",
        name=entry.name,
        path=entry.path,
        node=None,
        type=kind,
        member=mark_c(f"entries.{entry.c_name}"),
        slot=slot,
        kinds=_KINDS[c_type],
        scale=plain(entry.type.scale) if entry.type.kind == "fixed" else "",
    )


def _reasons(table: Table, slot: int) -> list[TracedValue]:
    places = {id(row.node): index for index, row in enumerate(table.rows)}
    result: list[TracedValue] = []
    for use in table.leaves:
        for number, node in enumerate(use.nodes if use.leaf.reasons else ()):
            result.append(
                TracedValue(
                    kind="reason",
                    name=node.name,
                    path=node.path,
                    node=places[id(node)],
                    type="uint8_t",
                    member=mark_c(f"reason_of_{use.leaf.c_name}[{number}]"),
                    slot=slot + len(result),
                    kinds=("U8",),
                    names=("", *use.leaf.reasons),
                )
            )
    return result


def _values(table: Table, mode: Entries) -> tuple[TracedValue, ...]:
    values: list[TracedValue] = []
    slot = 0
    for entry in table.bindings.entries if mode != "none" else ():
        if mode == "marked" and not entry.is_traced:
            continue
        value = _entry(entry, slot)
        if value is not None:
            values.append(value)
            slot += value.slots
    return (*values, *_reasons(table, slot))


def _every(wanted_ms: int, period_ms: int) -> int:
    return min(EVERY.high, max(1, wanted_ms // period_ms))


def _check_ids(bus: Bus, base: int, extended: bool) -> None:
    place = Place("--trace")
    last = base + len(IDS) - 1
    if last > (0x1FFFFFFF if extended else 0x7FF):
        raise CompileError(
            place, f"the trace takes the ids 0x{base:X} to 0x{last:X}, which are no CAN ids", "take lower ones"
        )
    for message in bus.source.messages:
        taken = any(not (identifier ^ message.frame_id) & message.mask for identifier in range(base, last + 1))
        if message.is_extended == extended and taken:
            raise CompileError(
                place,
                f"the trace takes the ids 0x{base:X} to 0x{last:X}, and 0x{message.frame_id:X} is '{message.name}' of "
                f"{bus.path.name}",
                "take eight ids in a row that are free, with higher numbers than all that is urgent",
            )


def known_within_ms(period_ms: int, nodes: int, snapshot_every: int, slots: int, values_every: int) -> int:
    """How long a receiver takes until it knows everything again, at most [ms]."""
    parts = -(-nodes // SNAPSHOT_NODES)
    return period_ms * max(snapshot_every * (parts + 1), values_every * (slots + 1) if slots else 0)


def make_trace(table: Table, bus: Bus, period_ms: int, options: TraceOptions) -> Trace:
    """The trace's configuration.

    Raises:
        CompileError: the ids are taken, or there are too many values.
    """
    extended = options.base > 0x7FF
    _check_ids(bus, options.base, extended)
    values = _values(table, options.entries)
    slots = sum(value.slots for value in values)
    if slots > SLOTS_MAX:
        raise CompileError(
            Place(str(table.tree.path)),
            f"the trace can tell {SLOTS_MAX} values of 32 bits, and the tree has {slots}",
            'mark the nodes whose entries you want to see with _trace="yes", and give --trace-entries marked',
        )
    parts = -(-len(table.rows) // SNAPSHOT_NODES)
    snapshot_every = _every(KNOWN_MS, period_ms * (parts + 1))
    values_every = _every(KNOWN_MS, period_ms * (slots + 1))
    return Trace(
        base=options.base,
        extended=extended,
        guard=options.guard,
        ticks=options.ticks,
        changes_max=min(CHANGES_MAX, len(table.rows)),
        values_max=VALUES_MAX if slots else 0,
        snapshot_every=snapshot_every,
        values_every=values_every,
        health_every=_every(HEALTH_MS, period_ms),
        model_every=_every(MODEL_MS, period_ms),
        known_within_ms=known_within_ms(period_ms, len(table.rows), snapshot_every, slots, values_every),
        values=values,
        texts=table.bindings.texts,
        nodes=len(table.rows),
        messages=len(bus.receive),
    )
