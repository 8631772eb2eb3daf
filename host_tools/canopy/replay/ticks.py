# SPDX-License-Identifier: MIT
"""One tick as the trace tells it, and the running check over what it has taken (docs/trace.md)."""

from __future__ import annotations

from dataclasses import dataclass, field

from canopy.live.frames import ArrivalsFrame

NOW_BITS = 24
"""Of a tick's time in CanopyInputs; the others are in CanopyModel."""
_TAKEN_WRAPS = 256
_MORE_AGES = 3
_AGES_IN_INPUTS = 2
_LONG_AGE = 255
_MANY_BYTES = 4


def next_check(check: int, fold: int) -> int:
    """The running check after one more frame, age, or state of the bus: canopy_bus_check() of the runtime."""
    return ((check << 3) | (check >> 5)) & 0xFF ^ fold


@dataclass
class Tick:
    """One tick, as CanopyTick, CanopyInputs and CanopyArrivals tell."""

    number: int
    place: int
    """Number of its CanopyTick in the log, from 1."""
    inputs: bytes = b""
    """Of CanopyInputs; empty: not come yet."""
    now: int = 0
    """Its time [us]; known when the whole log was read."""
    upper: int | None = None
    """The time's bits from NOW_BITS on, where CanopyModel tells them of this tick."""
    frames: int = 0
    """How many it has taken."""
    ages: list[int] = field(default_factory=list)
    """Of each message of which it has taken frames [ms], in the order of the ids."""
    list_of_ages: bytes = b""
    """As it is on the bus."""
    is_whole: bool = False
    """The list of ages has come to its end."""

    @property
    def now_low(self) -> int:
        """The lower bits of its time."""
        return int.from_bytes(self.inputs[:3], "little")

    @property
    def taken(self) -> int:
        """Frames taken since the start, modulo 256."""
        return self.inputs[3]

    @property
    def check(self) -> int:
        """Of all frames, ages and states since the start."""
        return self.inputs[4]

    @property
    def can_state(self) -> int:
        """The state of the bus."""
        return self.inputs[5] & 7

    @property
    def overload(self) -> bool:
        """Not all frames were taken."""
        return bool(self.inputs[5] & 0x08)

    @property
    def returning(self) -> bool:
        """Safe values went out instead of the tree's."""
        return bool(self.inputs[5] & 0x10)

    @property
    def may_lack(self) -> bool:
        """The controller cannot have heard all."""
        return self.can_state != 0 or self.overload

    def take_inputs(self, data: bytes) -> None:
        """Adds what the 8 bytes of a CanopyInputs frame say."""
        ages = data[5] >> 5 & 3
        self.inputs = data
        self.list_of_ages = data[6 : 6 + min(ages, _AGES_IN_INPUTS)]
        self.is_whole = ages != _MORE_AGES

    def take_arrivals(self, frame: ArrivalsFrame) -> None:
        """Adds what a CanopyArrivals frame says."""
        self.list_of_ages += frame.ages
        self.is_whole = frame.is_last

    def read_ages(self, taken_before: int) -> bool:
        """Reads the whole list of ages. False: it says what cannot be.

        Args:
            taken_before: `taken` of the tick before.
        """
        rest = self.list_of_ages
        self.frames = (self.taken - taken_before) % _TAKEN_WRAPS
        if self.inputs[5] & 0x80:
            told, rest = int.from_bytes(rest[:_MANY_BYTES], "little"), rest[_MANY_BYTES:]
            if told < _TAKEN_WRAPS or told % _TAKEN_WRAPS != self.frames:
                return False
            self.frames = told
        while rest:
            size = 3 if rest[0] == _LONG_AGE else 1
            if len(rest) < size:
                return False
            self.ages.append(int.from_bytes(rest[1:3], "little") if size == 3 else rest[0])
            rest = rest[size:]
        return bool(self.frames) == bool(self.ages) and len(self.ages) <= self.frames

    def check_of_ages(self, check: int) -> int:
        """The running check after this tick's ages and the state of the bus, from the one after its frames."""
        for age in self.ages:
            check = next_check(check, (age & 0xFF) ^ (age >> 8))
        return next_check(check, self.inputs[5] & 0x0F)


def find_times(ticks: list[Tick]) -> int:
    """Gives each tick its time, from the lower bits in all and the upper ones where CanopyModel tells them.

    It tells them in the first tick, and whenever they change. Where that frame is missing the lower bits show it, for
    they go back; a next CanopyModel that says otherwise shows that a tick took longer than they can count.

    Returns:
        Of how many ticks, from the first one on, the time is known.
    """
    told = [place for place, tick in enumerate(ticks) if tick.upper is not None]
    if not told:
        return 0
    upper = _upper_before(ticks, told[0])
    known, is_guess = 0, False
    for place, tick in enumerate(ticks):
        goes_back = place > 0 and tick.now_low < ticks[place - 1].now_low
        if tick.upper is None:
            upper += goes_back
            is_guess |= goes_back
        elif is_guess and tick.upper != upper + goes_back:
            return known
        else:
            upper, is_guess, known = tick.upper, False, place + 1
        tick.now = upper << NOW_BITS | tick.now_low
        if place and tick.now < ticks[place - 1].now:
            return place
    return len(ticks) if upper >= 0 and ticks[0].now >= 0 else 0


def _upper_before(ticks: list[Tick], told: int) -> int:
    """The upper bits of the first tick, when those of a later one are the first that are told."""
    upper = ticks[told].upper
    assert upper is not None
    for place in range(told):
        upper -= ticks[place + 1].now_low < ticks[place].now_low
    return upper
