# SPDX-License-Identifier: MIT
"""Leaves that decide by what they measure: the state as it is, or as it was some steps ago, plus a bounded error.

A piece is then about the measurement: the plant may be in it wherever some error and some age put the measurement into
it. Errors widen a piece exactly. Ages widen it by all that the plant can move in that time: that is enough for a proof,
and more than there is; so a run that refutes a claim is checked against the definition (Sensing.explains()).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product

from canopy.verify.invariant import greatest
from canopy.verify.linear import Affine, Atom, Polyhedron, State
from canopy.verify.regions import Piece
from canopy.verify.unroll import Visit

Interval = tuple[Fraction, Fraction]
ZERO: Interval = (Fraction(0), Fraction(0))
REFINEMENTS = 3
MAX_AGE = 100
MAX_CASES = 5_000
"""Combinations of ages, one a variable, that are tried for a moment of a run."""


def widened(states: Polyhedron, domain: Polyhedron, boxes: Sequence[Interval]) -> Polyhedron:
    """The states of the domain to which something of the boxes can be added so that the sum is in `states`."""
    width = states.width
    loose = [index for index, box in enumerate(boxes) if box != ZERO]
    if not loose or states.is_empty:
        return states
    total = width + len(loose)
    atoms = []
    for one in states.atoms:
        added = tuple(one.direction[index] for index in loose)
        atoms.append(Atom((*one.direction, *added), one.bound, one.strict))
    atoms += [Atom((*one.direction, *(0,) * len(loose)), one.bound, one.strict) for one in domain.atoms]
    for number, index in enumerate(loose):
        unit = tuple(int(place == width + number) for place in range(total))
        low, high = boxes[index]
        atoms += [Atom(unit, high, False), Atom(tuple(-value for value in unit), -low, False)]
    return Polyhedron(total, atoms).eliminated(width)


@dataclass(frozen=True)
class Sensing:
    """`error`: least and greatest of measured minus true; `age`: most steps that a measurement is old; per variable."""

    error: tuple[Interval, ...]
    age: tuple[int, ...]

    @property
    def is_exact(self) -> bool:
        """Is every run of the widened pieces one that can happen?"""
        return not any(self.age)

    def applied(self, made: Sequence[Piece], domain: Polyhedron) -> list[Piece]:
        """The pieces over the true state."""
        boxes = list(self.error)
        if not self.is_exact:
            moved = _moved(made, [domain] * len(made))
            for _ in range(REFINEMENTS):
                boxes = self._boxes(moved)
                moved = _moved(made, [_widened(piece, domain, boxes) for piece in made])
            boxes = self._boxes(moved)
        return [replace(piece, states=_widened(piece, domain, boxes)) for piece in made]

    def _boxes(self, moved: Sequence[Interval]) -> list[Interval]:
        """What a measurement may differ by: its error, and what the plant has moved since."""
        both = zip(self.error, self.age, moved, strict=True)
        return [
            (error[0] - age * max(step[1], Fraction(0)), error[1] - age * min(step[0], Fraction(0)))
            for error, age, step in both
        ]

    def explains(self, visits: Sequence[Visit], made: Sequence[Piece], domain: Polyhedron) -> bool:
        """Can each but the last moment of a run have been measured so that what acted there acts?

        Before its start the plant is taken to have stood still.
        """
        measured = [widened(piece.seen or piece.states, domain, self.error) for piece in made]
        for moment, visit in enumerate(visits[:-1]):
            places = [
                place for place, piece in enumerate(made) if (piece.label, piece.status) == (visit.label, visit.status)
            ]
            if not any(measured[place].holds(state) for state in self._seen(visits, moment) for place in places):
                return False
        return True

    def _seen(self, visits: Sequence[Visit], moment: int) -> list[State]:
        """The states, each variable as old as it may be."""
        ages = [range(min(age, moment) + 1) for age in self.age]
        cases = 1
        for one in ages:
            cases *= len(one)
        if cases > MAX_CASES:
            return []
        return [
            tuple(visits[moment - age].state[index] for index, age in enumerate(chosen)) for chosen in product(*ages)
        ]


def _widened(piece: Piece, domain: Polyhedron, boxes: Sequence[Interval]) -> Polyhedron:
    """The states in which the piece may be measured, and in which the plant does what it does there."""
    states = widened(piece.seen or piece.states, domain, boxes)
    return states if piece.where is None else states.meet(piece.where)


def _moved(made: Sequence[Piece], where: Sequence[Polyhedron]) -> list[Interval]:
    """Least and greatest movement of each variable in one step from these states."""
    result = []
    for index in range(made[0].states.width if made else 0):
        ends: list[Fraction] = [Fraction(0)]
        for piece, states in zip(made, where, strict=True):
            if states.is_empty:
                continue
            limit = piece.step.shorter[index]
            if limit is not None:
                ends += [limit, -limit]
                continue
            coefficients = list(piece.step.maps[index].coefficients)
            coefficients[index] -= 1
            step = Affine(tuple(coefficients), piece.step.maps[index].constant)
            minus = Affine(tuple(-value for value in coefficients), -step.constant)
            most, least = greatest(states, step), greatest(states, minus)
            assert most is not None and least is not None, "the state space is bounded"
            low, high = piece.step.noise[index]
            ends += [most[0] + high, -least[0] + low]
        result.append((min(ends), max(ends)))
    return result
