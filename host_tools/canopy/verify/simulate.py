# SPDX-License-Identifier: MIT
"""Runs in exact arithmetic from chosen starts: what they show is a fact, not a guess."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product

from canopy.verify.linear import Atom, Formula, Polyhedron, State, nice_point
from canopy.verify.system import System
from canopy.verify.unroll import Visit

MAX_CORNERS = 64


@dataclass(frozen=True)
class Run:
    """A run up to the goal. `ended`: it comes there; else `why` says what happened, or that it was cut off."""

    visits: tuple[Visit, ...]
    ended: bool
    why: str = ""
    cut: bool = False


def _corner(part: Polyhedron, signs: Iterable[int]) -> State:
    """A state of a part that is as far out as it can be, one variable after the other, where that is reached."""
    for index, sign in enumerate(signs):
        direction = tuple(sign * int(i == index) for i in range(part.width))
        top = part.supremum(direction)
        if top is None:
            continue
        edge = Atom(tuple(-value for value in direction), -top.bound, False)
        if not part.meet([edge]).is_empty:
            part = part.meet([edge])
    return nice_point(part)


def candidates(system: System, start: Formula, among: Iterable[int]) -> Iterator[State]:
    """Starts worth trying: corners of each part of the start in each piece."""
    for index in among:
        for part in start.parts:
            both = system.pieces[index].states.meet(part)
            if both.is_empty:
                continue
            for number, signs in enumerate(product((1, -1), repeat=system.width)):
                if number < MAX_CORNERS:
                    yield _corner(both, signs)


def simulate(system: System, start: State, goal: frozenset[int], most: int) -> Run:
    """Runs until the goal, a state that was there before, or `most` steps; a free choice falls on the first there is.

    The pieces of the goal are asked last: a run that may be somewhere else is not at its goal yet.
    """
    visits: list[Visit] = []
    seen: dict[tuple[int, State], int] = {}
    state = start
    while len(visits) <= most:
        here = sorted(system.at(state), key=lambda index: index in goal)
        if not here:
            return Run(tuple(visits), False, "it leaves the state space")
        piece = system.pieces[here[0]]
        visits.append(Visit(state, piece.label, piece.status))
        if here[0] in goal:
            return Run(tuple(visits), True)
        if (here[0], state) in seen:
            return Run(tuple(visits), False, f"its last state is that of step {seen[here[0], state]}")
        seen[here[0], state] = len(visits) - 1
        following = system.next(here[0], state, system.domain)
        if following is None:
            return Run(tuple(visits), False, "it leaves the state space")
        state = following
    return Run(tuple(visits), False, f"it is cut off after {most} steps", cut=True)
