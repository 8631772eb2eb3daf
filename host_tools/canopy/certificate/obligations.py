# SPDX-License-Identifier: MIT
"""What has to be shown for a claim: conjunctions that must have no solution. Prover and checker both ask here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import floor
from typing import Any

from canopy.certificate.formula import EVERYTHING, Part, RejectedError, Row, Sum, Union, meet
from canopy.certificate.system import Builder, Files, Piece, S

Rows = list[Row]
Inside = Callable[[Rows, int], int]
"""Which member of the backward set, of this piece, holds all solutions of the rows; -1: there are no solutions."""

CLAIM_KEYS = ("name", "kind", "of", "arbitrary", "disturbance", "expect", "from", "within", "avoid")
"""What a claim may say; anything else might change what it means."""


@dataclass(frozen=True)
class Open:
    """A piece with its choices as further variables: rows, and the next state."""

    rows: Rows
    sums: tuple[Sum, ...]


@dataclass(frozen=True)
class Leaving:
    """In a piece direction · x grows by `speed` a step, from `low` to `high`.

    `end` ("low", "high" or "") is not reached. Without a direction no step stays in the piece.
    """

    piece: int
    direction: tuple[Fraction, ...] | None
    speed: Fraction
    low: Fraction
    high: Fraction
    end: str

    @property
    def steps(self) -> int:
        """Most steps before the piece is left."""
        if self.direction is None:
            return 1
        ratio = (self.high - self.low) / self.speed
        whole = floor(ratio)
        return whole if self.end and whole == ratio and whole > 0 else whole + 1


def _padded(row: Row, width: int) -> Row:
    zeros = (Fraction(0),) * (width - len(row.coefficients))
    return Row((*row.coefficients, *zeros), row.bound, row.strict)


def _after(row: Row, sums: tuple[Sum, ...]) -> Row:
    """The row of the next state, as one of this state and the choices."""
    width = len(sums[0].coefficients)
    total = Sum((Fraction(0),) * width, Fraction(0)).at(row.coefficients, sums)
    return Row(total.coefficients, row.bound - total.constant, row.strict)


def opened(piece: Piece, domain: Part) -> Open:
    """Disturbances and arbitrary steps become variables after those of the state."""
    width, step = len(piece.step.sums), piece.step
    choices = [i for i in range(width) if step.shorter[i] is not None or any(step.noise[i])]
    total = width + len(choices)
    rows = [_padded(row, total) for row in piece.rows]
    sums = [Sum((*one.coefficients, *(Fraction(0),) * len(choices)), one.constant) for one in step.sums]
    for number, index in enumerate(choices):
        unit = [Fraction(int(i == width + number)) for i in range(total)]
        limit = step.shorter[index]
        if limit is None:
            low, high = step.noise[index]
            rows += [Row(tuple(unit), high, False), Row(tuple(-u for u in unit), -low, False)]
            sums[index] = sums[index].plus(Sum(tuple(unit), Fraction(0)), Fraction(1))
            continue
        apart = [u - int(i == index) for i, u in enumerate(unit)]
        rows += [Row(tuple(apart), limit, True), Row(tuple(-u for u in apart), limit, True)]
        sums[index] = Sum(tuple(unit), Fraction(0))
        rows += [_after(row, tuple(sums)) for row in domain if row.coefficients[index]]
    return Open(rows, tuple(sums))


class Claim:
    """A claim of a model file with its pieces."""

    def __init__(self, files: Files, index: int) -> None:
        claims = files.content.get("claims", [])
        if not 0 <= index < len(claims):
            raise RejectedError(f"the model has no claim {index}")
        self.options: dict[str, Any] = claims[index]
        self.kind = self.options["kind"]
        if self.kind not in ("reaches", "avoids") or "goal" in self.options:
            raise RejectedError(f"claims of kind '{self.kind}', or with a goal of their own, have no certificates")
        unknown = [key for key in self.options if key not in CLAIM_KEYS]
        if unknown:
            raise RejectedError(f"claims with the key '{unknown[0]}' have no certificates")
        self.width = files.width
        self.builder = Builder(files, self.options)
        self.pieces = self.builder.pieces()
        self.domain = files.domain[0]
        self.open = [opened(piece, self.domain) for piece in self.pieces]
        start = files.reader.condition(self.options["from"]) if "from" in self.options else EVERYTHING
        self.start: Union = meet(files.domain, start)
        self.bad = files.reader.condition(self.options["avoid"]) if self.kind == "avoids" else ()

    def _into(self, index: int, rows: Part, target: Part) -> Rows:
        """(State, choices) of a piece, with `rows` too, that go into `target`."""
        one = self.open[index]
        total = len(one.sums[0].coefficients)
        return [*one.rows, *(_padded(row, total) for row in rows), *(_after(row, one.sums) for row in target)]

    def model(self) -> Iterator[Rows]:
        """The model is one: regions and modes cover, and no step leaves the state space."""
        for part in self.builder.gaps():
            yield list(part)
        for one in self.open:
            for row in self.domain:
                yield [*one.rows, _after(row.opposite(), one.sums)]

    def invariant(self, kept: list[Part | None]) -> Iterator[Rows]:
        """Starts are in it, and no step leaves it."""
        if len(kept) != len(self.pieces):
            raise RejectedError("the invariant is of another number of pieces")
        for index, piece in enumerate(self.pieces):
            rows = kept[index]
            for part in self.start:
                begin = [*piece.rows, *part]
                yield from ([begin] if rows is None else ([*begin, row.opposite()] for row in rows))
            for source, states in enumerate(kept):
                if states is None:
                    continue
                step = self._into(source, states, piece.rows)
                sums = self.open[source].sums
                yield from ([step] if rows is None else ([*step, _after(row.opposite(), sums)] for row in rows))

    def excluded(self, kept: list[Part | None]) -> Iterator[Rows]:
        """No state of the invariant is bad."""
        for piece, rows in zip(self.pieces, kept, strict=True):
            if rows is not None:
                yield from ([*piece.rows, *rows, *part] for part in self.bad)

    def ranked(self, kept: list[Part | None], ranking: list[Leaving], absent: list[tuple[int, int]]) -> Iterator[Rows]:
        """Each piece on the way is left in time, and never comes back."""
        outside = [i for i, piece in enumerate(self.pieces) if piece.status != S and kept[i] is not None]
        if sorted(one.piece for one in ranking) != outside:
            raise RejectedError("the ranking is not one of the pieces on the way")
        for place, one in enumerate(ranking):
            rows = kept[one.piece]
            assert rows is not None
            for other in ranking[:place]:
                yield self._into(one.piece, rows, self.pieces[other.piece].rows)
            again = self._into(one.piece, rows, self.pieces[one.piece].rows)
            if one.direction is None:
                yield again
                continue
            if one.speed <= 0 or one.end not in ("", "low", "high") or len(one.direction) != self.width:
                raise RejectedError("the ranking is not one")
            sums = self.open[one.piece].sums
            before = _padded(Row(one.direction, Fraction(0), True), len(sums[0].coefficients))
            after = _after(Row(one.direction, Fraction(0), True), sums)
            gain = tuple(a - b for a, b in zip(after.coefficients, before.coefficients, strict=True))
            yield [*again, Row(gain, one.speed + after.bound, True)]
            here = [*self.pieces[one.piece].rows, *rows]
            yield [*here, Row(one.direction, one.low, one.end != "low")]
            yield [*here, Row(tuple(-d for d in one.direction), -one.high, one.end != "high")]
        for first, second in absent:
            rows = kept[ranking[first].piece]
            assert rows is not None
            yield self._into(ranking[first].piece, rows, self.pieces[ranking[second].piece].rows)

    def backward(self, members: list[tuple[int, Part]], inside: Inside) -> Iterator[Rows]:
        """A set that has the bad states and whatever leads into it, and no start."""
        if not all(0 <= piece < len(self.pieces) for piece, _ in members):
            raise RejectedError("the backward set has a piece that does not exist")

        def within(rows: Rows, piece: int) -> Iterator[Rows]:
            which = inside(rows, piece)
            if which < 0:
                yield rows
                return
            if which >= len(members) or members[which][0] != piece:
                raise RejectedError("the backward set has no such member")
            width = len(rows[0].coefficients) if rows else self.width
            yield from ([*rows, _padded(row.opposite(), width)] for row in members[which][1])

        for index, piece in enumerate(self.pieces):
            for part in self.bad:
                yield from within([*piece.rows, *part], index)
            for other, states in members:
                yield from within(self._into(index, (), (*self.pieces[other].rows, *states)), index)
        for other, states in members:
            yield from ([*self.pieces[other].rows, *states, *part] for part in self.start)


def longest(ranking: list[Leaving], absent: list[tuple[int, int]]) -> int:
    """Steps along the longest way through the ranking; no step goes along the pairs in `absent`."""
    missing = set(absent)
    if not all(0 <= first < second < len(ranking) for first, second in missing):
        raise RejectedError("the ranking leaves out steps that it does not have")
    best: list[int] = []
    for place in reversed(range(len(ranking))):
        ahead = [best[len(ranking) - 1 - n] for n in range(place + 1, len(ranking)) if (place, n) not in missing]
        best.append(ranking[place].steps + max(ahead, default=0))
    return max(best, default=0)
