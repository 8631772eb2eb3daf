# SPDX-License-Identifier: MIT
"""One tick as the trace tells it, and the running check over what it has taken (docs/trace.md)."""

from __future__ import annotations

from dataclasses import dataclass, field

AGES_IN_FRAME = 3
CONDITIONS = 0x4F
"""Of CanopyArrivals' first byte: CanState, Overload, Returning."""
CHECKED_CONDITIONS = 0x0F
"""Of these, what goes into the check: CanState, Overload."""


def next_check(check: int, fold: int) -> int:
    """The running check after one more frame, age, or state of the bus: canopy_bus_check() of the runtime."""
    return ((check << 3) | (check >> 5)) & 0xFF ^ fold


@dataclass
class Tick:
    """One tick, as CanopyTick, CanopyInputs and CanopyArrivals tell."""

    number: int
    place: int
    """Number of its CanopyTick in the log, from 1."""
    conditions: int = 0
    """State of the bus, overload, return, as in CanopyArrivals' first byte. Without one: of the tick before."""
    inputs: bytes = b""
    """Of CanopyInputs; empty: not come yet."""
    ages: list[int] = field(default_factory=list)
    """Of each message of which it has taken frames [ms], in the order of the ids."""
    counts: list[int] = field(default_factory=list)
    """How many ages each of its CanopyArrivals frames has."""

    @property
    def taken(self) -> int:
        """Frames taken since the start, modulo 256."""
        return self.inputs[6]

    @property
    def check(self) -> int:
        """Of all frames, ages and states since the start."""
        return self.inputs[7]

    def take_arrivals(self, data: bytes) -> None:
        """Adds what the 8 bytes of a CanopyArrivals frame say."""
        count = data[0] >> 4 & 3
        self.conditions = data[0] & CONDITIONS
        self.counts.append(count)
        self.ages += [int.from_bytes(data[place : place + 2], "little") for place in (1, 3, 5)[:count]]

    def check_of_ages(self, check: int) -> int:
        """The running check after this tick's ages and the state of the bus, from the one after its frames."""
        for age in self.ages:
            check = next_check(check, (age & 0xFF) ^ (age >> 8))
        return next_check(check, self.conditions & CHECKED_CONDITIONS)

    def lacks_arrivals(self, before: Tick | None) -> bool:
        """Is a CanopyArrivals frame missing, as far as the tick and the one before it tell without the taken frames?

        The frames themselves tell of the rest: Check holds the ages.
        """
        taken, check = (before.taken, before.check) if before is not None else (0, 0)
        frames = (self.taken - taken) % 256
        if not self.ages:
            return frames != 0 or self.check != self.check_of_ages(check)
        full = all(count == AGES_IN_FRAME for count in self.counts[:-1])
        return not full or self.counts[-1] == 0 or (0 < frames < len(self.ages))
