# SPDX-License-Identifier: MIT
"""The circuits of random trees against the reference model: what every node is and returns, and which are halted."""

from __future__ import annotations

import random

import pytest

from canopy.verify.logic.encode import CELLS, Encoding
from canopy.verify.logic.replay import Replay, from_circuit
from differential.tree import SHAPES
from logic.random_trees import random_returns, random_specs

pytestmark = pytest.mark.logic
SEED, TREES, TICKS = 20261130, 1000, 12


@pytest.mark.parametrize("period_us", [None, 10_000], ids=["free times", "10 ms"])
def test_every_node_in_every_tick(period_us: int | None) -> None:
    seen = set()
    for number, root in enumerate(random_specs(SEED, range(TREES))):
        chance = random.Random(f"{SEED}/{number}")
        encoding = Encoding(root, random_returns(chance, root), period_us)
        given = [{one: chance.random() < 0.5 for one in encoding.circuit.inputs} for _ in range(TICKS)]
        inputs, expected = from_circuit(encoding, given)
        replay = Replay(root, period_us)
        for tick, (one, shot) in enumerate(zip(inputs, expected, strict=True)):
            got = replay.tick(one)
            for index, (cell, real) in enumerate(zip(shot.moments, got.moments, strict=True)):
                assert cell == real, f"tree {number}, tick {tick}, node {index} <{encoding.cells[index].spec.kind}>"
        seen |= {spec.kind for spec in root.walk()}
    assert seen == set(CELLS) & set(SHAPES)
