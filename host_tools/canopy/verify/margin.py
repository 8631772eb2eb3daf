# SPDX-License-Identifier: MIT
"""The distance between two sets in the largest difference of a variable: the margin of a safeguarding tree."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from canopy.verify.invariant import greatest
from canopy.verify.linear import Affine, Atom, Formula, Polyhedron, State
from canopy.verify.smt import all_of


@dataclass(frozen=True)
class Margin:
    """The infimum of the distance, and two states about that far apart. `steps`: for a solver, a smaller distance."""

    distance: Fraction
    success: State
    outside: State
    steps: list[str]


def _apart(one: Polyhedron, other: Polyhedron) -> Polyhedron:
    """(s, x, d): s in one, x in the other, and no variable of them differs by more than d."""
    width = one.width
    total = 2 * width + 1
    atoms = [Atom((*item.direction, *(0,) * (width + 1)), item.bound, item.strict) for item in one.atoms]
    atoms += [Atom((*(0,) * width, *item.direction, 0), item.bound, item.strict) for item in other.atoms]
    for index, sign in product(range(width), (1, -1)):
        difference = [0] * total
        difference[index], difference[width + index], difference[-1] = sign, -sign, -1
        atoms.append(Atom(tuple(difference), Fraction(0), False))
    return Polyhedron(total, atoms)


def distance(success: Formula, outside: Formula) -> Margin | None:
    """How far apart two sets are; None: one of them is empty."""
    width = success.width
    least: Margin | None = None
    pairs = [_apart(one, other) for one, other in product(success.parts, outside.parts)]
    pairs = [pair for pair in pairs if not pair.is_empty]
    shorter = Affine((*(Fraction(0),) * (2 * width), Fraction(-1)), Fraction(0))
    for pair in pairs:
        top = greatest(pair, shorter)
        assert top is not None
        if least is None or -top[0] < least.distance:
            near = pair.meet([Atom((*(0,) * (2 * width), 1), -top[0] + Fraction(1, 100), False)])
            point = Formula(near.width, (near,)).point()
            assert point is not None
            least = Margin(-top[0], point[:width], point[width : 2 * width], [])
    if least is None:
        return None
    below = Atom((*(0,) * (2 * width), 1), least.distance, True)
    return Margin(least.distance, least.success, least.outside, [all_of([*pair.atoms, below]) for pair in pairs])
