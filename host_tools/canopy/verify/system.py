# SPDX-License-Identifier: MIT
"""Steps of a piecewise affine system, forwards and backwards, exactly.

What is left open in a step (a disturbance, or where an arbitrary subtree goes) is a variable of its own: the step is
then an affine map of the state and these, and "some disturbance leads there" is a projection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from canopy.verify.linear import Affine, Atom, Polyhedron, State, nice_point, substituted
from canopy.verify.regions import Piece


@dataclass(frozen=True)
class Open:
    """A piece over (state, choices): where the choice is possible, and the maps to the next state."""

    states: Polyhedron
    maps: tuple[Affine, ...]
    deterministic: bool


def widened(one: Atom, width: int) -> Atom:
    """An inequality over more variables, which do not matter to it."""
    return Atom((*one.direction, *(0,) * (width - len(one.direction))), one.bound, one.strict)


def opened(piece: Piece, domain: Polyhedron) -> Open:
    """The piece with its choices as further variables."""
    width, step = domain.width, piece.step
    choices = [i for i in range(width) if step.shorter[i] is not None or any(step.noise[i])]
    total = width + len(choices)
    atoms = [widened(one, total) for one in piece.states.atoms]
    maps = [Affine((*one.coefficients, *(Fraction(0),) * len(choices)), one.constant) for one in step.maps]
    for number, index in enumerate(choices):
        unit = tuple(int(i == width + number) for i in range(total))
        minus = tuple(-value for value in unit)
        limit = step.shorter[index]
        if limit is None:
            low, high = step.noise[index]
            atoms += [Atom(unit, high, False), Atom(minus, -low, False)]
            old = maps[index]
            coefficients = tuple(a + b for a, b in zip(old.coefficients, unit, strict=True))
            maps[index] = Affine(coefficients, old.constant)
            continue
        away = tuple(u - int(i == index) for i, u in enumerate(unit))  # x' - x
        atoms += [Atom(away, limit, True), Atom(tuple(-value for value in away), limit, True)]
        maps[index] = Affine(tuple(map(Fraction, unit)), Fraction(0))
        for one in domain.atoms:  # an arbitrary step stays in the state space
            if one.direction[index]:
                atoms.append(Atom(tuple(one.direction[index] * value for value in unit), one.bound, False))
    return Open(Polyhedron(total, atoms), tuple(maps), not choices)


class System:
    """Pieces over a state space."""

    def __init__(self, pieces: Sequence[Piece], domain: Polyhedron) -> None:
        self.pieces = tuple(pieces)
        self.domain = domain
        self.width = domain.width
        self.open = tuple(opened(piece, domain) for piece in self.pieces)

    def into(self, index: int, target: Polyhedron) -> Polyhedron:
        """(State, choices) of a piece that lead into `target`."""
        one = self.open[index]
        return one.states.meet([substituted(item, one.maps) for item in target.atoms])

    def before(self, index: int, target: Polyhedron) -> Polyhedron:
        """The states of a piece from which some choice leads into `target`."""
        one = self.into(index, target)
        return one if self.open[index].deterministic or one.is_empty else one.eliminated(self.width)

    def at(self, state: State) -> list[int]:
        """The pieces that a state is in; several where a leaf is free."""
        return [index for index, piece in enumerate(self.pieces) if piece.states.holds(state)]

    def next(self, index: int, state: State, target: Polyhedron) -> State | None:
        """A next state in `target`, with round numbers where there is a choice; None: there is none."""
        one = self.open[index]
        if one.deterministic:
            reached = tuple(item.at(state) for item in one.maps)
            return reached if target.holds(reached) else None
        fixed = []
        for i, value in enumerate(state):
            unit = tuple(int(k == i) for k in range(one.states.width))
            fixed += [Atom(unit, value, False), Atom(tuple(-u for u in unit), -value, False)]
        possible = self.into(index, target).meet(fixed)
        if possible.is_empty:
            return None
        choice = nice_point(possible)
        return tuple(item.at(choice) for item in one.maps)
