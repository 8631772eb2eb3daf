# SPDX-License-Identifier: MIT
"""Random trees of all nodes that have a circuit."""

from __future__ import annotations

import random

from canopy.semantics.spec import FAILURE, RUNNING, SKIPPED, SUCCESS, Spec
from canopy.verify.logic.encode import CELLS
from differential.generate import Generator, Wanted
from differential.tree import SHAPES, USER_LEAVES

KINDS = tuple(kind for kind in CELLS if kind in SHAPES)


def random_specs(seed: int, numbers: range, kinds: tuple[str, ...] = KINDS) -> list[Spec]:
    """The trees with these numbers."""
    generator = Generator(seed, Wanted(kinds, nonsense=False))
    specs = [generator.tree(number).root for number in numbers]
    for root in specs:
        for spec in root.walk():
            if spec.kind == "TryCatch":
                spec.parameters = (0,)
            if spec.kind in ("Sleep", "Delay", "Timeout"):
                spec.parameters = (spec.parameters[0] % 60,)
    return specs


def random_returns(chance: random.Random, root: Spec) -> dict[int, tuple[int, ...]]:
    """What each leaf may return, by number of the node."""
    found = {}
    for number, spec in enumerate(root.walk()):
        if spec.kind in USER_LEAVES:
            valid = [SUCCESS, FAILURE, SKIPPED] + [RUNNING] * (spec.kind == "StatefulAction")
            found[number] = tuple(sorted(chance.sample(valid, chance.randint(1, len(valid)))))
    return found
