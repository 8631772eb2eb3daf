# SPDX-License-Identifier: MIT
"""Claims that one step decides: is a given set an invariant (inductive), and does the tree slide along a border?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from canopy.verify import smt
from canopy.verify.invariant import combined
from canopy.verify.linear import Affine, Atom, Direction, Formula, Polyhedron, State, atom, nice_point
from canopy.verify.system import System, widened


@dataclass(frozen=True)
class Leak:
    """A step that leaves a set, from `state` of `piece` to `after`, in `target`."""

    piece: int
    state: State
    target: int
    after: State


def leaves_set(system: System, kept: Formula) -> tuple[Leak | None, list[str]]:
    """A step from a set to outside of it, within the state space; and the steps of the proof that there is none."""
    steps = []
    outside = ~kept
    for index, piece in enumerate(system.pieces):
        for part in kept.parts:
            inside = piece.states.meet(part)
            if inside.is_empty:
                continue
            for other, target in enumerate(system.pieces):
                for rest in outside.parts:
                    goal = target.states.meet(rest)
                    if goal.is_empty:
                        continue
                    steps.append(smt.leads(system, index, goal, part.atoms))
                    state = Formula(system.width, (system.before(index, goal).meet(part),)).point()
                    if state is not None:
                        after = system.next(index, state, goal)
                        assert after is not None
                        return Leak(index, state, other, after), steps
    return None, steps


@dataclass(frozen=True)
class Sliding:
    """A state of the border of two pieces from which each of them moves to the other's side, or along the border."""

    state: State
    one: int
    other: int


def _closed(states: Polyhedron) -> list[Atom]:
    return [Atom(item.direction, item.bound, False) for item in states.atoms]


def _borders(system: System) -> Iterator[tuple[int, int, Direction, Polyhedron]]:
    """(piece on the lower side, piece on the upper side, normal, border) of what acts beside something else."""
    for one, below in enumerate(system.pieces):
        for other, above in enumerate(system.pieces):
            if not (below.acting and above.acting) or below.acting == above.acting:
                continue
            opposite = {tuple(-value for value in item.direction): -item.bound for item in above.states.atoms}
            for item in below.states.atoms:
                if opposite.get(item.direction) == item.bound:
                    minus = Atom(tuple(-value for value in item.direction), -item.bound, False)
                    border = Polyhedron(system.width, [*_closed(below.states), *_closed(above.states), minus])
                    if not border.is_empty:
                        yield one, other, item.direction, border


def _movement(system: System, index: int, normal: Direction) -> Affine:
    """How far a step of a piece moves along a normal, over (state, choices)."""
    after = combined(normal, system.open[index].maps)
    width = len(after.coefficients)
    before = widened(Atom(normal, after.constant, False), width).direction
    return Affine(tuple(a - b for a, b in zip(after.coefficients, before, strict=True)), after.constant)


def _moving(system: System, index: int, normal: Direction, border: Polyhedron, *, up: bool) -> Polyhedron:
    """The states of a border from which a piece's step may go up or along it, or down or along it."""
    movement = _movement(system, index, normal)
    one = system.open[index]
    sign = -1 if up else 1
    wanted = atom(
        Affine(tuple(sign * value for value in movement.coefficients), sign * movement.constant), strict=False
    )
    total = one.states.width
    choices = [item for item in one.states.atoms if any(item.direction[system.width :])]
    states = Polyhedron(total, [*choices, *(widened(item, total) for item in border.atoms), wanted])
    return states if total == system.width else states.eliminated(system.width)


def sliding(system: System, where: Formula) -> Sliding | None:
    """A state of a border, within `where`, at which neither side moves away from it."""
    for one, other, normal, border in _borders(system):
        both = _moving(system, one, normal, border, up=True).meet(_moving(system, other, normal, border, up=False))
        for part in where.parts:
            found = both.meet(part)
            if not found.is_empty:
                return Sliding(nice_point(found), one, other)
    return None
