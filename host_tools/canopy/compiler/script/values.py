# SPDX-License-Identifier: MIT
"""What an expression of a script is at compile time.

A number is `c * scale`: a C integer expression, and a constant step. So a signal in steps of 0.1 % is computed with as
the whole number it is, and nothing is rounded. The range of `c` is known, and with it whether 32 bits are enough.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from math import gcd, lcm

from canopy.compiler.numbers import plain

INT32 = (-(2**31), 2**31 - 1)
INT64 = (-(2**63), 2**63 - 1)


@dataclass(frozen=True)
class Const:
    """A number that is known at compile time, exactly."""

    value: Fraction
    is_bool: bool = False


@dataclass(frozen=True)
class Num:
    """A number: the C expression `c` of type `c_type`, in [low, high], times `scale`.

    `choices` are the names of a signal's values, with `c`'s value for each. `zeros` and `ones` are bits of `c` that are
    known, from a mask: C compilers warn of comparisons that these decide.
    """

    c: str
    c_type: str
    low: int
    high: int
    scale: Fraction = Fraction(1)
    is_bool: bool = False
    literal: int | None = None
    choices: dict[str, int] = field(default_factory=dict)
    zeros: int = 0
    ones: int = 0

    @property
    def wide(self) -> bool:
        """Does it need 64 bits?"""
        return self.low < INT32[0] or self.high > INT32[1]

    def as_type(self, wide: bool) -> str:
        """`c` as int32_t or int64_t."""
        if self.literal is not None:
            return number(self.literal, wide)
        wanted = "int64_t" if wide else "int32_t"
        return self.c if self.c_type == wanted else f"({wanted}){self.c}"


@dataclass(frozen=True)
class Double:
    """A floating-point number."""

    c: str


@dataclass(frozen=True)
class TextConst:
    """A text that is known at compile time."""

    text: str


@dataclass(frozen=True)
class TextVar:
    """A text out of the application's table of texts: `c` is its index."""

    c: str


Value = Const | Num | Double | TextConst | TextVar


def number(value: int, wide: bool) -> str:
    """A C literal."""
    bits = 64 if wide else 32
    if value == -(2 ** (bits - 1)):
        return f"(INT{bits}_C({value + 1}) - 1)"
    return f"INT{bits}_C({value})"


def literal(value: int, scale: Fraction) -> Num:
    """A number that is known at compile time, in steps of `scale`."""
    wide = not INT32[0] <= value <= INT32[1]
    return Num(number(value, wide), "int64_t" if wide else "int32_t", value, value, scale, literal=value)


def result(c: str, low: int, high: int, scale: Fraction) -> Num:
    """A number that was computed in the smallest type that holds its range."""
    wide = low < INT32[0] or high > INT32[1]
    return Num(c, "int64_t" if wide else "int32_t", low, high, scale)


def boolean(c: str) -> Num:
    """The result of a comparison."""
    return Num(c, "bool", 0, 1, is_bool=True)


def common_scale(first: Fraction, second: Fraction) -> Fraction:
    """The largest step of which both are multiples."""
    if first == 0 or second == 0:
        return first or second or Fraction(1)
    den = lcm(first.denominator, second.denominator)
    return Fraction(gcd(int(first * den), int(second * den)), den)


def describe(value: Value) -> str:
    """For messages."""
    if isinstance(value, (TextConst, TextVar)):
        return "a text"
    if isinstance(value, Double):
        return "a floating-point number"
    if isinstance(value, Const):
        return f"the number {plain(value.value)}"
    return "a whole number" if value.scale.denominator == 1 else f"a number in steps of {plain(value.scale)}"
