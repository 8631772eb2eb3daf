# SPDX-License-Identifier: MIT
"""Scripts, entries and signals in circuits: against plain arithmetic in the reference model, and against compiled C."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path

import pytest

from canopy.compiler.bus_reader import read_bus
from canopy.compiler.errors import CompileError
from canopy.compiler.tree_reader import read_tree
from canopy.verify.expression import ExpressionError
from canopy.verify.logic.ask import ask
from canopy.verify.logic.encode import Encoding
from canopy.verify.logic.formula import Formula
from canopy.verify.logic.replay import Inputs, Replay, Shot, from_circuit
from canopy.verify.logic.runner import Runner
from canopy.verify.logic.subject import LogicTree
from logic.bus import NODE, write_dbc
from logic.compiled import Compiled
from logic.scripted_trees import Writer

pytestmark = pytest.mark.logic
SEED, TREES, TICKS = 20261201, 150, 12
COMPILED, RUNS = 12, 20
PERIOD_US = 10_000


def logic_tree(folder: Path, seed: str, *, is_open: bool) -> LogicTree | None:
    """A random tree; None for one whose scripts the compiler refuses."""
    path = folder / "t.xml"
    writer = Writer(seed, is_open=is_open)
    path.write_text(writer.document(random.Random(seed).randint(3, 20)))
    try:
        return LogicTree(read_tree(path), read_bus(write_dbc(folder), NODE, 10, "t"))
    except CompileError:
        return None


@pytest.mark.parametrize("is_open", [False, True], ids=["followed", "open"])
def test_circuits_are_plain_arithmetic(tmp_path: Path, is_open: bool) -> None:
    compared = seen_entries = assumed = 0
    for number in range(4 * TREES):
        tree = logic_tree(tmp_path, f"{SEED}/{number}", is_open=is_open)
        if tree is None:
            continue
        encoding = Encoding(tree.spec(), tree.returns, PERIOD_US, tree.board)
        assumed += bool(encoding.scripts.assumed)
        chance = random.Random(number)
        given = [{one: chance.random() < 0.5 for one in encoding.circuit.inputs} for _ in range(TICKS)]
        inputs, expected = from_circuit(encoding, given)
        replay = Replay(tree.spec(), PERIOD_US, Runner(tree.board, encoding.scripts.unknown))
        for tick, (one, shot) in enumerate(zip(inputs, expected, strict=True)):
            assert replay.tick(one) == shot, f"tree {number}, tick {tick}"
            seen_entries += any(shot.entries)
        compared += 1
        if compared >= TREES:
            break
    assert compared >= TREES
    assert assumed > TREES // 2 if is_open else assumed < TREES // 20  # products of large numbers
    assert seen_entries > TREES * TICKS // 2


def run_compiled(compiled: Compiled, inputs: Sequence[Inputs], expected: Sequence[Shot], where: str) -> None:
    """Statuses and entries of the compiled tree are those of a trace, tick by tick."""
    compiled.begin()
    for tick, (one, shot) in enumerate(zip(inputs, expected, strict=True)):
        statuses, entries = compiled.tick(one, tick * PERIOD_US)
        assert entries == shot.entries, f"{where}, tick {tick}"
        assert statuses == tuple(moment.code for moment in shot.moments), f"{where}, tick {tick}"


def question(chance: random.Random, tree: LogicTree, number: int) -> Formula:
    """A formula that relates a node and a condition in the language of scripts."""
    node = chance.randrange(len(tree.nodes))
    condition = Writer(f"{number}", is_open=False).condition(1)
    try:
        fact = Formula("fact", (), tree.condition(condition, 0))
    except ExpressionError:  # the compiler refuses it
        fact = Formula("true")
    status = Formula(chance.choice(("SUCCESS", "FAILURE", "RUNNING", "SKIPPED")), (), node)
    return Formula("not", (Formula("and", (status, Formula("previous", (fact,)))),))


def test_circuits_are_compiled_trees(tmp_path: Path) -> None:
    """The application that `canopy compile` makes does what circuits do, and what refutes a formula happens in it."""
    compared = number = refuted = 0
    dbc = write_dbc(tmp_path)
    while compared < COMPILED:
        number += 1
        tree = logic_tree(tmp_path, f"{SEED}/c{number}", is_open=False)
        if tree is None:
            continue
        encoding = Encoding(tree.spec(), tree.returns, PERIOD_US, tree.board)
        if encoding.scripts.assumed:
            continue
        compared += 1
        compiled = Compiled(tmp_path, tmp_path / "t.xml", dbc, tree.nodes, tree.board)
        for run in range(RUNS):
            chance = random.Random(f"{number}/{run}")
            given = [{one: chance.random() < 0.5 for one in encoding.circuit.inputs} for _ in range(TICKS)]
            run_compiled(compiled, *from_circuit(encoding, given), f"tree {number}, run {run}")
        for asked in range(3):
            formula = question(random.Random(f"{number}/{asked}"), tree, number)
            verdict = ask(tree, formula, PERIOD_US // 1000, 10.0)
            if verdict.verdict == "refuted":
                run_compiled(compiled, verdict.inputs, verdict.trace, f"tree {number}, question {asked}")
                refuted += 1
    assert refuted > COMPILED // 2
