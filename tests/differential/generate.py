# SPDX-License-Identifier: MIT
"""Random trees: up to 200 nodes, 30 levels, 50 ticks; every one is made from (seed, number) alone."""

from __future__ import annotations

import random
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

from canopy.semantics.spec import COMPARISONS, FAILURE, RUNNING, SKIPPED, SUCCESS, Script, Spec
from differential.tree import (
    ASSIGNMENTS,
    BUILT_IN_LEAVES,
    ENTRIES,
    PRECONDITIONS,
    SCRIPTED,
    SHAPES,
    SWITCHED,
    USER_LEAVES,
    Tree,
)

NODES_MAX = 200
DEPTH_MAX = 30
TICKS = 50

_POOL = 1 << 16
_STEPS_US = (0, 1, 499, 999, 1000, 1001, 5_000, 10_000, 10_000, 10_000, 50_000, 1_000_000)
_MSEC = (0, 1, 5, 10, 10, 30, 50, 100, 1000)


@dataclass(frozen=True)
class Wanted:
    """What may be in the trees."""

    kinds: tuple[str, ...]
    nonsense: bool = True
    """Leaves that answer with no valid status, or RUNNING where it may not be: in some trees none, in others many."""
    odd_times: bool = True
    """Times that stand still, wrap around, or go back."""
    seldom: tuple[str, ...] = ()
    """Kinds that only one tree in four has."""
    conditions_skip: bool = True
    """Whether what stands in the place of a condition of IfThenElse and WhileDoElse may answer SKIPPED."""
    running_skips: bool = True
    """Whether a RUNNING action may answer SKIPPED."""


# How a leaf tends to answer: weights of SUCCESS, FAILURE, RUNNING, SKIPPED.
_MOODS = (
    (6, 2, 3, 1),
    (2, 6, 3, 1),
    (3, 3, 8, 1),
    (4, 1, 0, 0),
    (1, 4, 0, 0),
    (1, 1, 1, 6),
    (1, 1, 1, 1),
    (5, 0, 5, 0),
)


@cache
def _answers(mood: int) -> bytes:
    """A long run of answers, from which each leaf takes a piece. Of one mood; RUNNING comes in runs."""
    rng = random.Random(mood)
    answers = bytearray()
    while len(answers) < _POOL:
        answer = rng.choices((SUCCESS, FAILURE, RUNNING, SKIPPED), _MOODS[mood])[0]
        answers += bytes([answer]) * (rng.choice((1, 1, 2, 3, 8)) if answer == RUNNING else 1)
    return bytes(answers)


def _translation(mapping: dict[int, int]) -> bytes:
    return bytes(mapping.get(byte, byte) for byte in range(256))


# What a leaf that is no StatefulAction answers in place of RUNNING.
_SYNCHRONOUS = tuple(_translation({RUNNING: answer}) for answer in (SUCCESS, FAILURE))
_RUNNING_SKIPS = bytes((RUNNING, SKIPPED))
_NEVER_SKIPPED = _translation({SKIPPED: FAILURE})
_NONSENSE = tuple(_translation({SKIPPED: answer}) for answer in (0, 5, 8, 255))


class Generator:
    """The trees of one seed."""

    def __init__(self, seed: int, wanted: Wanted) -> None:
        self.seed = seed
        self.wanted = wanted
        kinds = wanted.kinds
        # The user's leaves are most of what robots have; the rest keeps the built-in ones company.
        self._plain_leaves = [kind for kind in USER_LEAVES if kind in kinds] * 2 + ["StatefulAction"] * 3
        self._plain_leaves += [kind for kind in BUILT_IN_LEAVES if kind in kinds and kind not in SCRIPTED]
        self._script_leaves = [kind for kind in BUILT_IN_LEAVES if kind in kinds and kind in SCRIPTED]

    def _choose_kinds(self) -> None:
        """Which kinds this tree is made of: now all of them, now a few, so that each meets itself, too."""
        rng = self._rng
        kinds = [kind for kind in self.wanted.kinds if kind not in self.wanted.seldom or rng.random() < 0.25]
        if rng.random() < 0.6:
            kinds = [kind for kind in kinds if kind not in SCRIPTED]
            self._leaves = self._plain_leaves
        else:
            self._leaves = self._plain_leaves + self._script_leaves * 2
        inner = [kind for kind in kinds if SHAPES[kind].most > 0]
        if rng.random() < 0.5:
            inner = rng.sample(inner, min(len(inner), 5))
        self._decorators = [kind for kind in inner if SHAPES[kind].most == 1]
        self._control = [kind for kind in inner if SHAPES[kind].most > 1] or ["Sequence"]

    def tree(self, number: int) -> Tree:
        """Tree `number` of this seed."""
        rng = random.Random(f"{self.seed}/{number}")
        size = rng.choice((rng.randint(1, 8), rng.randint(2, 20), rng.randint(10, 60), rng.randint(40, NODES_MAX)))
        depth = rng.choice((4, 8, DEPTH_MAX))
        self._rng = rng
        self._decorated = rng.choice((0.1, 0.3, 0.3, 0.7))
        self._slanted = rng.random() < 0.4
        self._nonsense = rng.choice((0.0, 0.03, 0.1, 0.3)) if self.wanted.nonsense else 0.0
        self._choose_kinds()
        root = self._node(size, depth)
        halt_after = rng.randrange(1, TICKS) if rng.random() < 0.3 else None
        return Tree(root, self._times(), halt_after)

    def _times(self) -> tuple[int, ...]:
        rng = self._rng
        odd = self.wanted.odd_times and rng.random() < 0.3
        now = (1 << 64) - rng.randrange(2_000_000) if odd else rng.randrange(1 << 40)
        steps = rng.choices((*_STEPS_US, -7_000) if odd else _STEPS_US, k=TICKS)
        times = []
        for step in steps:
            now = (now + step) & ((1 << 64) - 1)
            times.append(now)
        return tuple(times)

    def _node(self, size: int, depth: int) -> Spec:
        """A tree of at most `size` nodes and `depth` levels; smaller when it does not come out even."""
        rng = self._rng
        if size <= 1 or depth <= 1:
            return self._leaf()
        control = [kind for kind in self._control if SHAPES[kind].least < size]
        if self._decorators and (not control or size == 2 or rng.random() < self._decorated):
            kind = rng.choice(self._decorators)
            children = [self._node(size - 1, depth - 1)]
        elif control:
            kind = rng.choice(control)
            children = [self._node(part, depth - 1) for part in self._parts(kind, size - 1)]
        else:
            return self._leaf()
        if kind in ("IfThenElse", "WhileDoElse") and not self.wanted.conditions_skip:
            for spec in children[0].walk():
                spec.answers = spec.answers.translate(_NEVER_SKIPPED)
        if kind == "Attributes" and children[0].kind == "Attributes":
            return children[0]
        return Spec(kind, children, self._parameters(kind, children), b"", self._scripts(kind))

    def _parts(self, kind: str, size: int) -> list[int]:
        """Sizes of the children of a control node that has `size` nodes below it."""
        rng = self._rng
        least, most = SHAPES[kind].least, min(SHAPES[kind].most, rng.choice((2, 3, 4, 12)))
        count = rng.randint(least, max(least, min(most, size)))
        if self._slanted:  # one child takes nearly all: a deep tree
            parts = [1] * count
            parts[rng.randrange(count)] = size - count + 1
            return parts
        rest = size - count
        cuts = sorted(rng.randrange(rest + 1) for _ in range(count - 1))
        return [1 + high - low for low, high in zip([0, *cuts], [*cuts, rest], strict=True)]

    def _leaf(self) -> Spec:
        rng = self._rng
        kind = rng.choice(self._leaves)
        if kind not in USER_LEAVES:
            return Spec(kind, [], self._parameters(kind, []), b"", self._scripts(kind))
        start = rng.randrange(_POOL - TICKS)
        answers = _answers(rng.randrange(len(_MOODS)))[start : start + TICKS]
        nonsense = rng.random() < self._nonsense
        if kind != "StatefulAction" and not nonsense:
            answers = answers.translate(rng.choice(_SYNCHRONOUS))
        elif nonsense:
            answers = answers.translate(rng.choice(_NONSENSE))
        if not self.wanted.running_skips:
            answers = answers.replace(_RUNNING_SKIPS, bytes((RUNNING, FAILURE)))
        return Spec(kind, [], (), answers)

    def _scripts(self, kind: str) -> tuple[Script | None, ...]:
        return tuple(self._script(kind, name) for name in SHAPES[kind].scripts)

    def _script(self, kind: str, name: str) -> Script | None:
        rng = self._rng
        entry, value = rng.randrange(len(ENTRIES)), rng.randint(-1, 3)
        if kind == "Attributes" and rng.random() < 0.7:
            return None
        if name in ("if", *PRECONDITIONS) or kind == "ScriptCondition":
            return Script(rng.choice(COMPARISONS), entry, value)
        if kind == "Switch":
            return Script("value", SWITCHED)
        if name == "entry":
            return Script("updates", entry)
        if kind == "Loop":
            return Script("take", rng.randrange(SWITCHED), rng.randint(1, 4))
        if kind == "SetBlackboard":
            return Script(":=", rng.randrange(SWITCHED), value)
        return Script(rng.choice(ASSIGNMENTS), entry, value)

    def _parameters(self, kind: str, children: list[Spec]) -> tuple[int, ...]:
        return tuple(self._parameter(kind, name, children) for name in SHAPES[kind].parameters)

    def _parameter(self, kind: str, name: str, children: list[Spec]) -> int:
        rng = self._rng
        count = len(children)
        if name in ("success_count", "failure_count", "max_failures"):
            if rng.random() < 0.6:
                return rng.randint(1, count)
            return -rng.randint(1, count)  # from N + 1 down: N to 1
        if name in ("num_cycles", "num_attempts"):
            # For ever only over what can yield (rule 8).
            yields = any(spec.kind == "StatefulAction" for child in children for spec in child.walk())
            return rng.choice((-1, -1, 0, 1, 2, 3, 5) if yields else (0, 1, 2, 3, 5))
        if name == "catch_on_halt":
            return rng.randint(0, 1) if children[-1].kind in USER_LEAVES else 0
        if name == "then_skip":
            return rng.randint(0, 1)
        if name in ("msec", "delay_msec"):
            return rng.choice(_MSEC)
        if name in ("else", "if_empty"):
            return rng.choice((SUCCESS, FAILURE, SKIPPED) + (RUNNING,) * (name == "else"))
        raise ValueError(f"no values known for the parameter {name} of {kind}")


def generate(seed: int, wanted: Wanted, numbers: Iterable[int]) -> list[Tree]:
    """The trees with these numbers."""
    generator = Generator(seed, wanted)
    return [generator.tree(number) for number in numbers]
