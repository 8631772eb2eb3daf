# SPDX-License-Identifier: MIT
"""Exact unrolling: which states can still be on their way after k steps, and which can come to a bad set in k.

Both go backwards from a set of states, one step at a time, over the polyhedra of the pieces. So an answer "no" comes
with a state to start from and the steps from there.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from canopy.verify.linear import Formula, Polyhedron, State, nice_point
from canopy.verify.system import System


@dataclass(frozen=True)
class Visit:
    """A moment of a trace: the state, and what acts there."""

    state: State
    label: str
    status: str


@dataclass(frozen=True)
class Found:
    """How far the unrolling came. `trace`: from a start as bad as can be. `complete`: nothing is further away."""

    steps: int
    trace: tuple[Visit, ...]
    complete: bool
    note: str = ""
    endless: bool = False
    levels: tuple[tuple[tuple[int, Polyhedron], ...], ...] = ()
    """The (piece, states) that can be so many steps away from where it began: what a solver checks again."""


@dataclass(frozen=True)
class _Front:
    """States of a piece, and where a step from there leads: `then`, one level closer to the target."""

    states: Polyhedron
    piece: int
    then: _Front | None


class Limit:
    """How much an unrolling may cost."""

    def __init__(self, seconds: float, levels: int = 5_000, width: int = 3_000) -> None:
        self.end = time.monotonic() + seconds
        self.levels = levels
        self.width = width

    def passed(self, level: int, width: int) -> str:
        """Why it is enough, or nothing."""
        if level > self.levels:
            return f"more than {self.levels} steps"
        if width > self.width:
            return f"more than {self.width} regions in one step"
        return "out of time" if time.monotonic() > self.end else ""


def _earlier(system: System, fronts: Sequence[_Front], among: Iterable[int]) -> list[_Front]:
    """The fronts one step before."""
    result: list[_Front] = []
    for index in among:
        kept: list[_Front] = []
        for front in fronts:
            before = system.before(index, front.states)
            if before.is_empty or any(before.within(other.states) for other in kept):
                continue
            kept = [other for other in kept if not other.states.within(before)]
            kept.append(_Front(before, index, front))
        result += kept
    return result


def _started(fronts: Sequence[_Front], start: Formula) -> tuple[_Front, State] | None:
    for front in fronts:
        for part in start.parts:
            both = front.states.meet(part)
            if not both.is_empty:
                return front, nice_point(both)
    return None


def trace(system: System, front: _Front, state: State) -> tuple[Visit, ...]:
    """The steps from a state through the fronts."""
    visits = []
    while True:
        piece = system.pieces[front.piece]
        visits.append(Visit(state, piece.label, piece.status))
        if front.then is None:
            return tuple(visits)
        following = system.next(front.piece, state, front.then.states)
        assert following is not None
        state, front = following, front.then


def longest(system: System, outside: Sequence[int], start: Formula, limit: Limit) -> Found:
    """Most steps that a run from `start` can make within the pieces `outside` (those that are not the goal).

    After `steps` steps every run has left them; the trace is one that needs so many. Not complete: some run needs at
    least `steps` + 1.
    """
    fronts = [_Front(system.pieces[index].states, index, None) for index in outside]
    best = _started(fronts, start)
    if best is None:
        return Found(0, (), True)
    level = 0
    levels = [_plain(fronts)]
    while True:
        level += 1
        earlier = _earlier(system, fronts, outside)
        levels.append(_plain(earlier))
        found = _started(earlier, start)
        if found is None:
            return Found(level, _with_end(system, trace(system, *best)), True, levels=tuple(levels))
        best = found
        if _same(earlier, fronts):
            return Found(level, trace(system, *best), False, "some runs never end", endless=True)
        why = limit.passed(level, len(earlier))
        if why:
            return Found(level, trace(system, *best), False, why)
        fronts = earlier


def _same(one: Sequence[_Front], other: Sequence[_Front]) -> bool:
    return {(front.piece, front.states) for front in one} == {(front.piece, front.states) for front in other}


def _with_end(system: System, visits: tuple[Visit, ...]) -> tuple[Visit, ...]:
    """And the state that the last step leads to."""
    last = visits[-1]
    for index in system.at(last.state):
        if system.pieces[index].label == last.label:
            state = system.next(index, last.state, system.domain)
            if state is not None and (there := system.at(state)):
                piece = system.pieces[there[0]]
                return (*visits, Visit(state, piece.label, piece.status))
    return visits


def into(system: System, bad: Formula, start: Formula, limit: Limit) -> Found:
    """The fewest steps in which a run from `start` comes into `bad`. Complete with an empty trace: none ever does."""
    fronts = [
        _Front(both, index, None)
        for index, piece in enumerate(system.pieces)
        for part in bad.parts
        if not (both := piece.states.meet(part)).is_empty
    ]
    seen: list[_Front] = []
    level = 0
    while fronts:
        found = _started(fronts, start)
        if found is not None:
            return Found(level, trace(system, *found), True)
        seen += fronts
        why = limit.passed(level, len(fronts))
        if why:
            return Found(level, (), False, why)
        level += 1
        fronts = [
            front
            for front in _earlier(system, fronts, range(len(system.pieces)))
            if not any(front.piece == other.piece and front.states.within(other.states) for other in seen)
        ]
    return Found(level, (), True, levels=(_plain(seen),))


def _plain(fronts: Iterable[_Front]) -> tuple[tuple[int, Polyhedron], ...]:
    return tuple((front.piece, front.states) for front in fronts)


def visits_of(system: System, acting: tuple[str, ...], steps: int) -> list[_Front]:
    """Where runs are that are about to enter what is `acting`, to stay for `steps` steps, and to go on elsewhere."""
    inside = [index for index, piece in enumerate(system.pieces) if piece.acting == acting]
    others = [index for index, piece in enumerate(system.pieces) if piece.acting and piece.acting != acting]
    fronts = [_Front(system.pieces[index].states, index, None) for index in others]
    for _ in range(steps):
        fronts = _earlier(system, fronts, inside)
    return _earlier(system, fronts, others)


def shortest_visit(
    system: System, steps: int, start: Formula, reached: Sequence[Polyhedron | None]
) -> tuple[tuple[Visit, ...], bool]:
    """A run from `start` in which something acts for `steps` steps only; and whether one may begin in `reached`."""
    possible = False
    for acting in dict.fromkeys(piece.acting for piece in system.pieces if piece.acting):
        fronts = visits_of(system, acting, steps)
        found = _started(fronts, start)
        if found is not None:
            return trace(system, *found), True
        for front in fronts:
            states = reached[front.piece]
            possible = possible or (states is not None and not front.states.meet(states).is_empty)
    return (), possible
