# SPDX-License-Identifier: MIT
"""An invariant for each piece, found by iteration: bounds in a few directions that hold whenever a run is in the piece.

Boxes are not enough: while a robot drives to its charger both its distance and its charge fall. What stays is a
combination, whose direction is normal to the step. So the directions are the axes, the normals of every border, and
the normals of every mode's displacement (template polyhedra).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import combinations
from math import gcd, lcm

from canopy.verify.linear import Affine, Atom, Direction, Formula, Polyhedron
from canopy.verify.simplex import Supremum
from canopy.verify.system import System, widened

RAISES = 3
"""So often a bound may rise before it is given up (widening)."""
NARROWINGS = 2

Bounds = dict[Direction, tuple[Fraction, bool]]
"""direction -> (bound, is it not reached?)."""


def _primitive(values: Sequence[Fraction]) -> Direction | None:
    scale = lcm(*(value.denominator for value in values))
    whole = [int(value * scale) for value in values]
    factor = gcd(*whole)
    return tuple(value // factor for value in whole) if factor else None


def displacement(maps: Sequence[Affine]) -> tuple[Fraction, ...] | None:
    """The step of a map that adds the same to every state; None: it does not."""
    for index, one in enumerate(maps):
        if any(value != int(i == index) for i, value in enumerate(one.coefficients)):
            return None
    return tuple(one.constant for one in maps)


def directions(system: System, formulas: Iterable[Formula]) -> list[Direction]:
    """The template."""
    width = system.width
    found: dict[Direction, None] = {}
    for index in range(width):
        found[tuple(int(i == index) for i in range(width))] = None
    sets = [piece.states for piece in system.pieces] + [part for one in formulas for part in one.parts]
    for one in sets:
        found.update(dict.fromkeys(item.direction for item in one.atoms))
    for piece in system.pieces:
        step = displacement(piece.step.maps)
        if step is None or any(piece.step.shorter):
            continue
        for i, k in combinations(range(width), 2):
            normal = [Fraction(0)] * width
            normal[i], normal[k] = step[k], -step[i]
            made = _primitive(normal)
            if made is not None:
                found[made] = None
    both = [tuple(sign * value for value in one) for one in found if any(one) for sign in (1, -1)]
    return list(dict.fromkeys(both))


def greatest(where: Polyhedron, expression: Affine) -> tuple[Fraction, bool] | None:
    """The supremum of an affine expression, and whether it is not reached; None: unbounded. Not for an empty set."""
    direction = _primitive(expression.coefficients)
    if direction is None:
        return expression.constant, False
    index = next(i for i, value in enumerate(direction) if value)
    scale = expression.coefficients[index] / direction[index]
    top: Supremum | None = where.supremum(direction)
    return None if top is None else (top.bound * scale + expression.constant, top.strict)


def combined(direction: Direction, maps: Sequence[Affine]) -> Affine:
    """Direction · maps."""
    width = len(maps[0].coefficients)
    coefficients = (
        sum((d * one.coefficients[i] for d, one in zip(direction, maps, strict=True)), Fraction(0))
        for i in range(width)
    )
    constant = sum((d * one.constant for d, one in zip(direction, maps, strict=True)), Fraction(0))
    return Affine(tuple(coefficients), constant)


def _higher(one: tuple[Fraction, bool], other: tuple[Fraction, bool]) -> bool:
    """Is the first bound weaker? At the same value one that is reached is."""
    return (one[0], not one[1]) > (other[0], not other[1])


class Invariant:
    """For each piece, the states of it that runs from `start` can come to, or more. None: they never come there."""

    def __init__(self, system: System, start: Formula, template: Sequence[Direction]) -> None:
        self.system = system
        self.start = start
        self.template = tuple(template)
        self.bounds: list[Bounds | None] = [self._initial(index) for index in range(len(system.pieces))]
        self._rise()
        for _ in range(NARROWINGS):
            self._narrow()

    def states(self, index: int) -> Polyhedron | None:
        """The invariant of a piece, within the piece."""
        bounds = self.bounds[index]
        if bounds is None:
            return None
        atoms = (Atom(direction, bound, strict) for direction, (bound, strict) in bounds.items())
        return self.system.pieces[index].states.meet(atoms)

    def crossing(self, index: int, target: int) -> Polyhedron | None:
        """(State, choices) in the invariant of a piece that go to another piece; None: there is none."""
        states = self.states(index)
        if states is None:
            return None
        total = self.system.open[index].states.width
        one = self.system.into(index, self.system.pieces[target].states)
        one = one.meet([widened(item, total) for item in states.atoms])
        return None if one.is_empty else one

    def _initial(self, index: int) -> Bounds | None:
        bounds: Bounds | None = None
        for part in self.start.parts:
            both = self.system.pieces[index].states.meet(part)
            if not both.is_empty:
                bounds = _join(bounds, self._bounds(both, None))
        return bounds

    def _bounds(self, where: Polyhedron, maps: Sequence[Affine] | None) -> Bounds:
        result: Bounds = {}
        for direction in self.template:
            expression = (
                Affine(tuple(map(Fraction, direction)), Fraction(0)) if maps is None else combined(direction, maps)
            )
            top = greatest(where, expression)
            if top is not None:
                result[direction] = top
        return result

    def _arrivals(self, target: int) -> Bounds | None:
        bounds: Bounds | None = None
        for index in range(len(self.system.pieces)):
            one = self.crossing(index, target)
            if one is not None:
                bounds = _join(bounds, self._bounds(one, self.system.open[index].maps))
        return bounds

    def _rise(self) -> None:
        raised: dict[tuple[int, Direction], int] = {}
        changed = True
        while changed:
            changed = False
            for target in range(len(self.system.pieces)):
                arrivals = self._arrivals(target)
                if arrivals is None:
                    continue
                old = self.bounds[target]
                if old is None:
                    self.bounds[target], changed = arrivals, True
                    continue
                for direction in list(old):
                    top = arrivals.get(direction)
                    if top is not None and not _higher(top, old[direction]):
                        continue
                    changed = True
                    count = raised[target, direction] = raised.get((target, direction), 0) + 1
                    if top is not None and count > RAISES:
                        top = self._threshold(direction, top) if count <= RAISES + len(self.bounds) else None
                    if top is None:
                        del old[direction]
                    else:
                        old[direction] = top

    def _threshold(self, direction: Direction, least: tuple[Fraction, bool]) -> tuple[Fraction, bool] | None:
        """The next bound of another piece in the same direction: what is kept on the way there may be kept here."""
        known = [bounds[direction] for bounds in self.bounds if bounds is not None and direction in bounds]
        return min(
            (one for one in known if not _higher(least, one)), key=lambda one: (one[0], not one[1]), default=None
        )

    def _narrow(self) -> None:
        """What follows in one step from an invariant, or is a start, is one, too; and smaller."""
        self.bounds = [_join(self._initial(index), self._arrivals(index)) for index in range(len(self.system.pieces))]


def _join(one: Bounds | None, other: Bounds | None) -> Bounds | None:
    if one is None or other is None:
        return other if one is None else one
    return {
        direction: max(bound, other[direction], key=lambda item: (item[0], not item[1]))
        for direction, bound in one.items()
        if direction in other
    }
