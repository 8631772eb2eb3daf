# SPDX-License-Identifier: MIT
"""Are two machines the same, tick by tick? All that can happen is tried, or, where that is too much, a seeded part.

A machine is deterministic: from a state and what the world answers in one tick it goes to a state, and shows something.
Two machines are compared from their first states on, over every pair of states that they can reach together. Answers
are asked for when they are needed, and both machines get the same ones: so only what decides is tried, and when every
pair of states is done, the two are equal for runs of any length.
"""

from __future__ import annotations

import random
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

LIMIT = 200_000
"""Cases (one tick of both machines each) that are tried before the search gives up and walks at random instead."""
WALK = 100
"""Ticks of one random walk."""

Key = Hashable
State = Any
"""Hashable, and only the machine knows what it is."""
Shown = Any
"""Hashable: compared, and printed where two differ."""


class Rules(Protocol):
    """What is known about the world: which answers go together."""

    def allows(self, given: dict[Key, int], key: Key, value: int) -> bool:
        """May `key` have this answer, in a tick in which the others are `given`?"""


class AnythingGoes:
    """Nothing is known about the world."""

    def allows(self, given: dict[Key, int], key: Key, value: int) -> bool:
        """Every answer goes with every other one."""
        return True


class Answers:
    """What the world answers in one tick: chosen when it is asked for, and then the same until the tick ends."""

    def __init__(self, rules: Rules, chosen: Sequence[int] = (), rng: random.Random | None = None) -> None:
        self.given: dict[Key, int] = {}
        self.trail: list[tuple[int, int]] = []
        self._rules = rules
        self._chosen = chosen
        self._rng = rng

    def ask(self, key: Key, options: Sequence[int]) -> int:
        """One of `options`, that goes together with the other answers of this tick.

        Raises:
            ValueError: none does: the facts contradict each other, or what the leaf can return.
        """
        if key in self.given:
            return self.given[key]
        allowed = [option for option in options if self._rules.allows(self.given, key, option)]
        if not allowed:
            raise ValueError(f"the facts leave no answer for {key}")
        if self._rng is not None:
            which = self._rng.randrange(len(allowed))
        else:
            which = self._chosen[len(self.trail)] if len(self.trail) < len(self._chosen) else 0
        self.trail.append((which, len(allowed)))
        self.given[key] = allowed[which]
        return allowed[which]


class Machine(Protocol):
    """Something that is ticked."""

    def start(self) -> State:
        """The state before the first tick."""

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """One tick: the next state, and what an observer sees of the tick."""


@dataclass(frozen=True)
class Difference:
    """The tick in which two machines differ, and the answers of the ticks before it."""

    before: tuple[dict[Key, int], ...]
    given: dict[Key, int]
    one: Shown
    other: Shown


@dataclass
class Verdict:
    """What was compared. `exhaustive`: everything that can happen; else random walks from `seed` came on top."""

    cases: int = 0
    states: int = 0
    exhaustive: bool = True
    seed: int = 0
    difference: Difference | None = None

    @property
    def equal(self) -> bool:
        """Was no difference found?"""
        return self.difference is None

    def __str__(self) -> str:
        if self.exhaustive:
            return f"{self.cases} cases in {self.states} states, exhaustive"
        searched = f"a search of {self.states} states, then random walks (seed {self.seed})"
        return f"{self.cases} cases, not exhaustive: {searched}"


@dataclass
class _Search:
    one: Machine
    other: Machine
    rules: Rules
    limit: int
    verdict: Verdict
    origin: dict[tuple[State, State], tuple[tuple[State, State], dict[Key, int]] | None] = field(default_factory=dict)

    def _try(self, pair: tuple[State, State], answers: Answers) -> tuple[State, State]:
        """One case; the states that follow."""
        first, shown = self.one.step(pair[0], answers)
        second, shown_too = self.other.step(pair[1], answers)
        self.verdict.cases += 1
        if shown != shown_too:
            self.verdict.difference = Difference(self._before(pair), dict(answers.given), shown, shown_too)
        return first, second

    def _before(self, pair: tuple[State, State]) -> tuple[dict[Key, int], ...]:
        trace: list[dict[Key, int]] = []
        step = self.origin.get(pair)
        while step is not None:
            trace.append(step[1])
            step = self.origin[step[0]]
        return tuple(reversed(trace))

    def _assignments(self) -> Iterator[Answers]:
        """Every combination of answers, one after the other; which are needed shows while they are used."""
        chosen: list[int] = []
        while True:
            answers = Answers(self.rules, chosen)
            yield answers
            trail = answers.trail
            while trail and trail[-1][0] + 1 == trail[-1][1]:
                trail.pop()
            if not trail:
                return
            chosen = [which for which, _ in trail[:-1]] + [trail[-1][0] + 1]

    def everything(self) -> bool:
        """Tries all; False when there is more than the limit."""
        first = (self.one.start(), self.other.start())
        self.origin[first] = None
        waiting = [first]
        for pair in waiting:
            self.verdict.states += 1
            for answers in self._assignments():
                if self.verdict.cases == self.limit:
                    return False
                following = self._try(pair, answers)
                if self.verdict.difference is not None:
                    return True
                if following not in self.origin:
                    self.origin[following] = (pair, dict(answers.given))
                    waiting.append(following)
        return True

    def at_random(self, rng: random.Random) -> None:
        """As many cases again, in walks from the first states."""
        first = (self.one.start(), self.other.start())
        pair, trace = first, list[dict[Key, int]]()
        for number in range(self.limit):
            if number % WALK == 0:
                pair, trace = first, []
            answers = Answers(self.rules, rng=rng)
            pair = self._try(pair, answers)
            found = self.verdict.difference
            if found is not None:
                self.verdict.difference = Difference(tuple(trace), found.given, found.one, found.other)
                return
            trace.append(dict(answers.given))


def compare(
    one: Machine,
    other: Machine,
    rules: Rules | None = None,
    *,
    limit: int = LIMIT,
    seed: int = 1,
    walk: bool = True,
) -> Verdict:
    """Compares two machines: exhaustively if that takes no more than `limit` cases, else a part, and as many at random.

    Without `walk` nothing is tried at random: for callers to whom only a proof is of use.

    Raises:
        ValueError: the rules contradict each other.
    """
    verdict = Verdict(seed=seed)
    search = _Search(one, other, rules or AnythingGoes(), limit, verdict)
    verdict.exhaustive = search.everything()
    if not verdict.exhaustive and walk:
        search.at_random(random.Random(seed))
    return verdict
