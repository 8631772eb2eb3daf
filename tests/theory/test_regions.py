# SPDX-License-Identifier: MIT
"""Regions of trees against the engine: in each state the root's status, and which leaves act, of random reactive trees.

Verify and the checker of certificates each work the regions out by themselves; both have to agree with the engine.
"""

from __future__ import annotations

import ctypes
import random
from fractions import Fraction
from pathlib import Path

import pytest

from canopy.certificate.formula import RejectedError
from canopy.certificate.obligations import Claim
from canopy.certificate.system import Files
from canopy.compiler.tree_reader import read_tree
from canopy.verify.reader import read_model
from canopy.verify.regions import Regions, pieces
from integration import engine

STATES, LEAVES, TREES = 5, 6, 150
CODES = {"success": engine.SUCCESS, "running": engine.RUNNING, "failure": engine.FAILURE}
DECORATORS = ("Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure")


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return engine.build(tmp_path_factory.mktemp("engine"))


def random_tree(chance: random.Random, depth: int) -> str:
    kind = chance.choice(("sequence", "fallback", "parallel", "while", "decorator", "leaf", "leaf"))
    if depth == 0 or kind == "leaf":
        return chance.choice(("<AlwaysSuccess/>", "<AlwaysFailure/>", *(f"<L{n}/>" for n in range(LEAVES))))
    if kind == "decorator":
        name = chance.choice(DECORATORS)
        return f"<{name}>{random_tree(chance, depth - 1)}</{name}>"
    count = chance.randint(2, 3)
    children = "".join(random_tree(chance, depth - 1) for _ in range(count))
    if kind == "while":
        return f"<WhileDoElse>{children}</WhileDoElse>"
    if kind == "parallel":
        needed = chance.choice((1, count, -1, -2))
        return f'<ReactiveParallel success_count="{needed}">{children}</ReactiveParallel>'
    name = "ReactiveSequence" if kind == "sequence" else "ReactiveFallback"
    return f"<{name}>{children}</{name}>"


def written(folder: Path, chance: random.Random) -> tuple[Path, Path, list[list[str]]]:
    """A tree, a model of it over whole numbers, and what each leaf returns in each state."""
    returns = [[chance.choice(list(CODES)) for _ in range(STATES)] for _ in range(LEAVES)]
    body = random_tree(chance, 4)
    used = [n for n in range(LEAVES) if f"<L{n}/>" in body]
    declared = "".join(f'<Action ID="L{n}"/>' for n in used)
    tree, model = folder / "t.xml", folder / "t.plant.toml"
    tree.write_text(
        f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree>'
        f"<TreeNodesModel>{declared}</TreeNodesModel></root>"
    )
    lines = ["format = 1", "[variables.x]", 'unit = ""', f"range = [0, {STATES - 1}]"]
    for n in used:
        lines.append(f"[leaves.L{n}]")
        for status in ("success", "failure"):
            points = [f"x == {x}" for x in range(STATES) if returns[n][x] == status]
            lines.append(f'{status} = "{" or ".join(points) or "false"}"')
        lines += ['running = "else"', f"[[leaves.L{n}.modes]]", "next = {}"]
    model.write_text("\n".join([*lines, "[[claims]]", 'kind = "reaches"', ""]))
    return tree, model, returns


def test_regions_are_what_the_engine_does(library: ctypes.CDLL, tmp_path: Path) -> None:
    chance = random.Random(4)
    certified = acted = 0
    for _ in range(TREES):
        file, model, returns = written(tmp_path, chance)
        tree = read_tree(file)
        plant, _reader = read_model(model)
        made = pieces(Regions(plant), tree.root)
        try:
            plain = Claim(Files(file, model), 0).pieces
            certified += 1
        except RejectedError:
            assert "WhileDoElse" in file.read_text()
            plain = []
        for state in range(STATES):
            run = engine.Engine(library, tree, lambda index: CODES[answers[index]])  # noqa: B023
            answers = {
                index: returns[int(node.leaf.id[1:])][state]
                for index, node in enumerate(run.nodes)
                if node.leaf is not None
            }
            root = engine.NAMES[run.tick()]
            called = dict.fromkeys(index for index, what in run.calls if what != "halt")
            acting = {run.nodes[index].path for index in called if answers[index] == "running"}
            acted += bool(acting)
            ours = {(one.status, frozenset(one.acting)) for one in made if one.states.holds((Fraction(state),))}
            assert ours == {(root, frozenset(acting))}, (file.read_text(), state)
            if not plain:
                continue
            theirs = {
                (one.status, frozenset(one.acting))
                for one in plain
                if all(
                    row.coefficients[0] * state < row.bound
                    or (row.coefficients[0] * state == row.bound and not row.strict)
                    for row in one.rows
                )
            }
            assert theirs == ours, (file.read_text(), state)
    assert certified > TREES // 3
    assert acted > TREES
