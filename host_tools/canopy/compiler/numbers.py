# SPDX-License-Identifier: MIT
"""Numbers as people write them, exactly."""

from __future__ import annotations

import re
from fractions import Fraction

_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?")
DIGITS_MAX = 400
_SHOWN_MAX = 10**300


def exact(text: str) -> Fraction:
    """The number that a text is, decimal or hexadecimal.

    Raises:
        ValueError: it is none, or one so long that computing with it would take long.
    """
    stripped = text.strip()
    if len(stripped) <= DIGITS_MAX:
        if stripped[:2].lower() == "0x":
            return Fraction(int(stripped, 16))
        if _DECIMAL.fullmatch(stripped):
            return Fraction(stripped)
    raise ValueError(f"'{text}' is no number")


def _digits(number: int) -> int:
    """The digits of a whole number, one more or less."""
    return int(abs(number).bit_length() * 0.30103)


def plain(value: Fraction) -> str:
    """A number for messages."""
    if max(abs(value.numerator), value.denominator) >= _SHOWN_MAX:  # Python would refuse to write the longest ones
        return f"about {'-' if value < 0 else ''}1e{_digits(value.numerator) - _digits(value.denominator)}"
    if value.denominator == 1:
        return str(value.numerator)
    text = repr(float(value))
    return text if Fraction(text) == value else f"{value.numerator}/{value.denominator}"
