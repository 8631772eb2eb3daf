# SPDX-License-Identifier: MIT
"""Whole numbers in a circuit: two's complement, with as many bits as their range needs, so that nothing overflows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from canopy.verify.logic.circuit import FALSE, TRUE, Circuit

INT64 = (-(2**63), 2**63 - 1)
MAX_PRODUCT = 600
"""Bits of one factor times bits of the other, where neither is constant."""


class NotModelledError(Exception):
    """What a circuit of reasonable size cannot compute."""


@dataclass(frozen=True)
class Word:
    """A number in [low, high]; `bits` are literals, the lowest first, the sign last."""

    bits: tuple[int, ...]
    low: int
    high: int

    @property
    def constant(self) -> int | None:
        """The number, if it can be one only."""
        return self.low if self.low == self.high else None

    def value(self, holds: Callable[[int], bool]) -> int:
        """The number where `holds` says which literals are 1."""
        places = [1 << place for place, bit in enumerate(self.bits[:-1]) if holds(bit)]
        return sum(places) - (holds(self.bits[-1]) << (len(self.bits) - 1))


def width(low: int, high: int) -> int:
    """Bits of a number in [low, high], the sign's too."""
    return max((end if end >= 0 else ~end).bit_length() for end in (low, high)) + 1


class Words:
    """Arithmetic in a circuit. What might need more than 64 bits raises NotModelledError."""

    def __init__(self, circuit: Circuit) -> None:
        self._circuit = circuit

    def constant(self, value: int) -> Word:
        """A number."""
        return self._fitted(
            [TRUE if value >> place & 1 else FALSE for place in range(width(value, value))], value, value
        )

    def truth(self, literal: int) -> Word:
        """1 where the literal holds, else 0."""
        return Word((literal, FALSE), 0, 1)

    def input(self, low: int, high: int) -> Word:
        """Any number of a range."""
        free = [self._circuit.input() for _ in range((high - low).bit_length())]
        above = self.limited(self._fitted([*free, FALSE], 0, 2 ** len(free) - 1), 0, high - low)
        return self.add(above, self.constant(low))

    def latch(self, start: int, low: int, high: int) -> Word:
        """A number that is remembered; keep() says what comes next."""
        return Word(
            tuple(self._circuit.latch(bool(start >> place & 1)) for place in range(width(low, high))), low, high
        )

    def keep(self, latch: Word, value: Word) -> None:
        """The latch's number in the next tick, which is in its range."""
        for bit, new in zip(latch.bits, self._extended(value.bits, len(latch.bits)), strict=True):
            self._circuit.follow(bit, new)

    @staticmethod
    def _extended(bits: Sequence[int], size: int) -> list[int]:
        return [bits[min(place, len(bits) - 1)] for place in range(size)]

    def _fitted(self, bits: Sequence[int], low: int, high: int) -> Word:
        if low < INT64[0] or high > INT64[1]:
            raise NotModelledError("it may need more than 64 bits")
        return Word(tuple(self._extended(bits, width(low, high))), low, high)

    def _sum(self, a: Sequence[int], b: Sequence[int], carry: int, size: int) -> list[int]:
        circuit = self._circuit
        result = []
        for x, y in zip(self._extended(a, size), self._extended(b, size), strict=True):
            differ = circuit.differ(x, y)
            result.append(circuit.differ(differ, carry))
            carry = circuit.choose(differ, carry, x)
        return result

    def add(self, a: Word, b: Word) -> Word:
        """The sum."""
        low, high = a.low + b.low, a.high + b.high
        return self._fitted(self._sum(a.bits, b.bits, FALSE, width(low, high)), low, high)

    def subtract(self, a: Word, b: Word) -> Word:
        """The difference."""
        low, high = a.low - b.high, a.high - b.low
        return self._fitted(self._sum(a.bits, [bit ^ 1 for bit in b.bits], TRUE, width(low, high)), low, high)

    def multiply(self, a: Word, b: Word) -> Word:
        """The product."""
        if a.constant is not None:
            a, b = b, a
        if b.constant is None and len(a.bits) * len(b.bits) > MAX_PRODUCT:
            raise NotModelledError("it multiplies two large numbers")
        ends = [x * y for x in (a.low, a.high) for y in (b.low, b.high)]
        size = width(min(ends), max(ends))
        total: list[int] = [FALSE] * size
        for place, bit in enumerate(self._extended(b.bits, min(len(b.bits), size))):
            row = [FALSE] * place + [self._circuit.both(bit, one) for one in self._extended(a.bits, size - place)]
            is_sign = place == len(b.bits) - 1
            total = self._sum(total, [one ^ 1 for one in row] if is_sign else row, TRUE if is_sign else FALSE, size)
        return self._fitted(total, min(ends), max(ends))

    def inverted(self, a: Word) -> Word:
        """All bits of the number inverted."""
        return self._fitted([bit ^ 1 for bit in a.bits], ~a.high, ~a.low)

    def bitwise(self, sign: str, a: Word, b: Word) -> Word:
        """The bits of both (&), of either (|), or of one of them (^)."""
        size = max(len(a.bits), len(b.bits))
        rows = zip(self._extended(a.bits, size), self._extended(b.bits, size), strict=True)
        gates = {"&": self._circuit.both, "|": self._circuit.either, "^": self._circuit.differ}
        low = 0 if a.low >= 0 and b.low >= 0 else -(2 ** (size - 1))
        return self._fitted([gates[sign](x, y) for x, y in rows], low, 2 ** (size - 1) - 1)

    def less(self, a: Word, b: Word) -> int:
        """The literal that says a < b."""
        if a.high < b.low or a.low >= b.high:
            return TRUE if a.high < b.low else FALSE
        return self._sum(a.bits, [bit ^ 1 for bit in b.bits], TRUE, max(len(a.bits), len(b.bits)) + 1)[-1]

    def equal(self, a: Word, b: Word) -> int:
        """The literal that says a == b."""
        size = max(len(a.bits), len(b.bits))
        rows = zip(self._extended(a.bits, size), self._extended(b.bits, size), strict=True)
        return self._circuit.all(self._circuit.differ(x, y) ^ 1 for x, y in rows)

    def is_not_zero(self, a: Word) -> int:
        """The literal that says a != 0."""
        return self._circuit.any(a.bits)

    def choose(self, condition: int, yes: Word, no: Word) -> Word:
        """`yes` where the condition holds, else `no`."""
        low, high = min(yes.low, no.low), max(yes.high, no.high)
        size = width(low, high)
        rows = zip(self._extended(yes.bits, size), self._extended(no.bits, size), strict=True)
        return Word(tuple(self._circuit.choose(condition, x, y) for x, y in rows), low, high)

    def limited(self, a: Word, low: int, high: int) -> Word:
        """The nearest number of a range."""
        result = a
        if a.low < low:
            result = self.choose(self.less(a, self.constant(low)), self.constant(low), result)
        if a.high > high:
            result = self.choose(self.less(self.constant(high), a), self.constant(high), result)
        low, high = min(max(a.low, low), high), max(min(a.high, high), low)
        return self._fitted(result.bits, low, high)
