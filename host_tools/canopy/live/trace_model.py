# SPDX-License-Identifier: MIT
"""What the model file says of a controller's trace: where it is on the bus, how often what comes, and its values."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

VERSION = 2
"""Of the trace's format (docs/trace.md)."""

MESSAGES = (
    "CanopyTick",
    "CanopyInputs",
    "CanopyArrivals",
    "CanopySnapshot",
    "CanopyChange",
    "CanopyValue",
    "CanopyHealth",
    "CanopyModel",
)
"""In the order of their ids, from the base on."""

TYPES = {
    "bool": 1,
    "int8_t": 1,
    "uint8_t": 1,
    "int16_t": 1,
    "uint16_t": 1,
    "int32_t": 1,
    "uint32_t": 1,
    "int64_t": 2,
    "uint64_t": 2,
    "float": 1,
    "double": 2,
    "text": 1,
    "duration": 1,
}
"""How many slots a value of a type has. A duration is in ms."""


@dataclass(frozen=True)
class TraceValue:
    """One value that the trace carries: an entry of a blackboard, or the reason that a leaf has given."""

    kind: str
    """"entry" or "reason"."""
    name: str
    path: str
    """Of the entry's scope, e.g. "arm/gripper"; "" for the main tree's. Of a reason: of its node."""
    node: int | None
    """Of a reason: whose."""
    type: str
    """One of TYPES."""
    slot: int
    """The first one, with the low half."""
    scale: Fraction
    """A whole number on the bus times this is the value."""
    unit: str
    words: dict[int, str]
    """Names of its numbers, where it has some."""

    @property
    def slots(self) -> int:
        """1, or 2 for 64 bits."""
        return TYPES[self.type]

    @property
    def title(self) -> str:
        """The entry's name with its scope before it; of a reason the node's path."""
        return (self.path if self.kind == "reason" else f"{self.path}/{self.name}") if self.path else self.name


@dataclass(frozen=True)
class Trace:
    """The trace that is built into a controller."""

    base: int
    """Arbitration id of the first of MESSAGES."""
    extended: bool
    """29-bit ids."""
    guard: int | None
    """E2E data id of CanopyTick; None: it is not protected."""
    ticks: int
    """Ticks whose trace has room while the bus lets nothing through."""
    changes_max: int
    """Most CanopyChange frames in a tick."""
    known_within_ms: int
    """So long after its last loss a receiver knows all again, at most [ms]."""
    values: tuple[TraceValue, ...]
    texts: tuple[str, ...]
    """What the values of the type text stand for."""

    @property
    def waits_periods(self) -> int:
        """Periods after its tick in which a frame can still leave: CANOPY_TRACE_PERIODS, and as many as `ticks`."""
        return 4 + self.ticks

    @cached_property
    def ids(self) -> dict[str, int]:
        """The arbitration id of each message."""
        return {name: self.base + place for place, name in enumerate(MESSAGES)}

    @cached_property
    def names(self) -> dict[int, str]:
        """The message of each arbitration id."""
        return {identifier: name for name, identifier in self.ids.items()}

    @cached_property
    def slots(self) -> int:
        """How many slots there are."""
        return sum(value.slots for value in self.values)


NO_TRACE = Trace(base=0, extended=False, guard=None, ticks=0, changes_max=0, known_within_ms=0, values=(), texts=())
"""Of an application that was built without one."""
