# SPDX-License-Identifier: MIT
"""Numbers as people write them, exactly."""

from __future__ import annotations

import re
from fractions import Fraction

_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?")
DIGITS_MAX = 400


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


def plain(value: Fraction) -> str:
    """A number for messages."""
    if value.denominator == 1:
        return str(value.numerator)
    try:
        text = repr(float(value))
    except OverflowError:
        return f"{value.numerator}/{value.denominator}"
    return text if Fraction(text) == value else f"{value.numerator}/{value.denominator}"
