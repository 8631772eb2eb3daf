# SPDX-License-Identifier: MIT
"""What numbers may be that become C integers, and the one check for all of them, made where each is read."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.numbers import exact, plain


@dataclass(frozen=True)
class Limits:
    """The smallest and the largest value, and the unit for messages."""

    low: int
    high: int
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.low} to {self.high}{' ' if self.unit else ''}{self.unit}"

    def __contains__(self, value: object) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and self.low <= value <= self.high


COUNT = Limits(0, 0xFFFF)
"""uint16_t: how many there are of something in the tables."""
EVERY = Limits(1, 0xFFFF, "ticks")
"""canopy_tx_message_t.every, canopy_trace_config_t.snapshot_every and so on."""
TIME_MS = Limits(0, 2**32 - 1, "ms")
"""Cycle times and timeouts: uint32_t in ms, 49 days."""
PERIOD_MS = Limits(1, 3_600_000, "ms")
"""One hour; in microseconds it fits a uint32_t."""
DATA_ID = Limits(-1, 0xFFFF)
"""E2EDataId; -1: none."""
RAW = Limits(-(2**63), 2**64 - 1)
"""What the widest signals hold."""
FRAMES = Limits(1, 2**32 - 1)
"""canopy_app_t.rx_max: frames that the bus can carry in a period."""
BITRATE = Limits(1_000, 100_000_000, "bit/s")
TRACE_TICKS = Limits(1, 1_000, "ticks")
"""canopy_app_t.trace_ticks."""

PORTS_MAX = 1_000
"""Of one node type: a member of a struct each, in three places."""
REASONS_MAX = 255
"""Of one leaf: a byte, and 0 is none."""


def _exactly(value: int | float | Decimal | Fraction | str) -> Fraction | None:
    """The number; None when it is none, or too long to compute with."""
    try:
        return exact(str(value)) if isinstance(value, (float, Decimal, str)) else Fraction(value)
    except ValueError:
        return None


def _shown(value: object) -> str:
    text = plain(Fraction(value)) if isinstance(value, (int, Fraction)) else str(value)
    return text if len(text) <= 40 else f"{text[:20]}… ({len(text)} characters)"


def whole(
    value: int | float | Decimal | Fraction | str, limits: Limits, what: str, place: Place, help_text: str = ""
) -> int:
    """A whole number that lies within the limits. `what` says whose it is, for the message.

    Raises:
        CompileError: it is no whole number, or outside the limits.
    """
    number = _exactly(value)
    if number is None or number.denominator != 1 or not limits.low <= number <= limits.high:
        raise CompileError(place, f"{what} is {_shown(value)}, and must be a whole number, {limits}", help_text)
    return int(number)


def count(things: int | Sized, what: str, place: Place, help_text: str = "") -> int:
    """How many things there are, when the tables can count so many.

    Raises:
        CompileError: there are more.
    """
    number = things if isinstance(things, int) else len(things)
    if number > COUNT.high:
        raise CompileError(place, f"{what}: {number}, and at most {COUNT.high} are possible", help_text)
    return number
