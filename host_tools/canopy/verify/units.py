# SPDX-License-Identifier: MIT
"""Units as products of symbols: `m`, `%/m`, `m/s^2`. Symbols are not converted: m and mm are two units."""

from __future__ import annotations

import re
from dataclasses import dataclass

_SYMBOL = re.compile(r"^([^\s*/^]+)(?:\^(-?\d{1,2}))?$")


@dataclass(frozen=True)
class Unit:
    """Symbols with their exponents, sorted; none for a number without a dimension."""

    powers: tuple[tuple[str, int], ...] = ()

    def __mul__(self, other: Unit) -> Unit:
        powers = dict(self.powers)
        for symbol, exponent in other.powers:
            powers[symbol] = powers.get(symbol, 0) + exponent
        return Unit(tuple(sorted((symbol, exponent) for symbol, exponent in powers.items() if exponent)))

    def inverse(self) -> Unit:
        """1 / self."""
        return Unit(tuple((symbol, -exponent) for symbol, exponent in self.powers))

    def __str__(self) -> str:
        above = "*".join(s if e == 1 else f"{s}^{e}" for s, e in self.powers if e > 0)
        below = "/".join(s if e == -1 else f"{s}^{-e}" for s, e in self.powers if e < 0)
        return f"{above or '1'}/{below}" if below else above or "1"


def parse_unit(text: str) -> Unit:
    """Reads a unit.

    Raises:
        ValueError: It is none.
    """
    result = Unit()
    text = text.strip()
    if text in ("", "1"):
        return result
    for index, part in enumerate(re.split(r"([*/])", text)):
        if index % 2:
            divide = part == "/"
            continue
        found = _SYMBOL.match(part.strip())
        if found is None:
            raise ValueError(f"'{text}' is not a unit; write symbols with * and /, such as m/s or %/m")
        if found[1] == "1":
            continue
        one = Unit(((found[1], int(found[2] or 1)),)) if found[2] != "0" else Unit()
        result = result * (one.inverse() if index and divide else one)
    return result
