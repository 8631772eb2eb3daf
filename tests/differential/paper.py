# SPDX-License-Identifier: MIT
"""Definitions 2 to 4 of Colledanchise & Ögren, "How Behavior Trees Modularize Hybrid Control Systems", as they stand.

A behaviour tree is r, which gives a return status for a state x, and f, which gives what acts in that state. The state
space is discrete and random; instead of the next state itself, f(x) is the set of leaves whose f_i acts, so that two
trees can be told apart even where their leaves happen to lead to the same state.

Sequence, Fallback and Parallel of the paper are ReactiveSequence, ReactiveFallback and ReactiveParallel here.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from canopy.semantics.spec import FAILURE, HALTED, RUNNING, SUCCESS, Spec
from differential.tree import Tree

State = int
Acting = frozenset[int]
"""Numbers of the leaves that act, in the order of the tree."""


class Behaviour(NamedTuple):
    """A behaviour tree T_i = {f_i, r_i}."""

    f: Callable[[State], Acting]
    r: Callable[[State], int]


def sequence(one: Behaviour, two: Behaviour) -> Behaviour:
    """Definition 2: if x in S1, then r0 = r2 and f0 = f2; else r0 = r1 and f0 = f1."""
    return Behaviour(
        lambda x: two.f(x) if one.r(x) == SUCCESS else one.f(x),
        lambda x: two.r(x) if one.r(x) == SUCCESS else one.r(x),
    )


def fallback(one: Behaviour, two: Behaviour) -> Behaviour:
    """Definition 3: if x in F1, then r0 = r2 and f0 = f2; else r0 = r1 and f0 = f1."""
    return Behaviour(
        lambda x: two.f(x) if one.r(x) == FAILURE else one.f(x),
        lambda x: two.r(x) if one.r(x) == FAILURE else one.r(x),
    )


def parallel(enough: int, parts: list[Behaviour]) -> Behaviour:
    """Definition 4, N parts: f0 = (f1, ..., fN); r0 = S with M successes, F with more than N - M failures, else R."""

    def r(x: State) -> int:
        statuses = [part.r(x) for part in parts]
        if statuses.count(SUCCESS) >= enough:
            return SUCCESS
        return FAILURE if statuses.count(FAILURE) > len(parts) - enough else RUNNING

    return Behaviour(lambda x: frozenset().union(*(part.f(x) for part in parts)), r)


def nested(compose: Callable[[Behaviour, Behaviour], Behaviour], parts: list[Behaviour]) -> Behaviour:
    """Any number of children: T1 composed with (T2 composed with (...))."""
    return parts[0] if len(parts) == 1 else compose(parts[0], nested(compose, parts[1:]))


@dataclass
class Experiment:
    """A random tree over a random state space, and a walk through its states."""

    tree: Tree
    behaviour: Behaviour
    states: list[State]


def experiment(rng: random.Random, ticks: int = 50) -> Experiment:
    """A random experiment: up to 12 states, up to some 60 nodes."""
    space = rng.randint(2, 12)
    states = [rng.randrange(space)]
    moves = [[rng.randrange(space) for _ in range(space)] for _ in range(8)]
    count = 0

    def build(depth: int) -> tuple[Spec, Behaviour]:
        nonlocal count
        number = count
        count += 1
        if depth == 0 or rng.random() < 0.3:
            region = [rng.choice((RUNNING, SUCCESS, FAILURE)) for _ in range(space)]
            leaf = Spec("StatefulAction", [])
            leaves.append((leaf, region))
            return leaf, Behaviour(lambda _x: frozenset([number]), lambda x: region[x])
        built = [build(depth - 1) for _ in range(rng.randint(1, 4))]
        specs, parts = [spec for spec, _ in built], [part for _, part in built]
        kind = rng.choice(("ReactiveSequence", "ReactiveFallback", "ReactiveParallel"))
        if kind == "ReactiveParallel":
            enough = rng.randint(1, len(parts))
            return Spec(kind, specs, (enough,)), parallel(enough, parts)
        return Spec(kind, specs), nested(sequence if kind == "ReactiveSequence" else fallback, parts)

    leaves: list[tuple[Spec, list[int]]] = []
    root, behaviour = build(rng.randint(1, 4))
    while len(states) < ticks:  # x_{k+1} = f0(x_k): each acting leaf moves the state
        x = states[-1]
        for number in sorted(behaviour.f(x)):
            x = moves[number % len(moves)][x]
        states.append(x)
    for leaf, region in leaves:
        leaf.answers = bytes(region[x] for x in states)
    return Experiment(Tree(root, tuple(range(ticks))), behaviour, states)


def acted(root: Spec, calls: list[tuple[int, int]]) -> Acting:
    """The leaves whose f acted in a tick of the engine: in a Sequence or Fallback those below the last ticked child."""
    ticked = {number for number, kind in calls if kind != HALTED}
    count = 0

    def below(spec: Spec) -> Acting:
        nonlocal count
        number = count
        count += 1
        if not spec.children:
            return frozenset([number]) & ticked
        parts = [part for part in (below(child) for child in spec.children) if part]
        if not parts:
            return frozenset()
        return frozenset().union(*parts) if spec.kind == "ReactiveParallel" else parts[-1]

    return below(root)
