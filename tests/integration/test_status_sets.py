# SPDX-License-Identifier: MIT
"""The sets of statuses that `canopy check` works with, against the engine itself on random trees."""

from __future__ import annotations

import ctypes
import random
from pathlib import Path

import pytest

from canopy.check import status_sets
from canopy.check.facts import Facts
from canopy.compiler.node_types import node_types
from canopy.compiler.tree import Script
from canopy.compiler.tree_reader import Node, built_in_types, read_tree
from integration import engine

LEAVES = {
    "Yes": ("Action", "SUCCESS"),
    "No": ("Action", "FAILURE"),
    "Busy": ("Action", "RUNNING"),
    "Skips": ("Condition", "SKIPPED"),
    "Acts": ("Action", "SUCCESS FAILURE RUNNING"),
    "Asks": ("Condition", "SUCCESS FAILURE"),
    "Any": ("Action", "SUCCESS FAILURE RUNNING SKIPPED"),
}
MODEL = "".join(
    f"<{tag} ID='{name}'><MetadataFields><Metadata returns='{returns}'/></MetadataFields></{tag}>"
    for name, (tag, returns) in LEAVES.items()
)
TREES = 400
TICKS = 25


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return engine.build(tmp_path_factory.mktemp("engine"))


def random_tree(dice: random.Random, depth: int) -> str:
    """XML of a tree of built-in nodes with up to four children each; some take their parameters from entries."""
    if depth == 0 or dice.random() < 0.2:
        return dice.choice(
            [f"<{name}/>" for name in (*LEAVES, "AlwaysSuccess", "AlwaysFailure")] + ["<Sleep msec='3'/>"]
        )
    kind = dice.choice([kind for kind in built_in_types().values() if kind.most_children])
    count = dice.randint(kind.least_children, min(kind.most_children, 4))
    children = [random_tree(dice, depth - 1) for _ in range(count)]
    attributes = ""
    for parameter in kind.parameters:
        value = {
            "success_count": dice.choice([*range(1, count + 1), -1, -count]),
            "failure_count": dice.randint(1, count),
            "max_failures": dice.choice([*range(1, count + 1), -1]),
            "then_skip": dice.choice(["true", "false"]),
            "catch_on_halt": dice.choice(["true", "false"]),
        }.get(parameter.name, dice.randint(0, 3))
        if dice.random() < 0.2:
            value = "{n}"
        if parameter.name == "catch_on_halt" and children[-1] not in [f"<{name}/>" for name in LEAVES]:
            value = "false"
        attributes += f" {parameter.name}='{value}'"
    return f"<{kind.name}{attributes}>{''.join(children)}</{kind.name}>"


def test_every_node_type_has_its_rule() -> None:
    leaves = {name for name, kind in node_types().items() if kind.category == "LEAF"}
    assert leaves == set(status_sets.LEAVES)
    assert set(node_types()) - leaves == set(status_sets.RULES)


def test_no_random_tree_does_what_the_sets_exclude(tmp_path: Path, library: ctypes.CDLL) -> None:
    dice = random.Random(7)
    seen = set()
    for number in range(TREES):
        nodes = random_tree(dice, dice.randint(1, 4))
        file = tmp_path / f"{number}.xml"
        file.write_text(f"<root BTCPP_format='4'><BehaviorTree ID='T'>{nodes}</BehaviorTree>"
                        f"<TreeNodesModel>{MODEL}</TreeNodesModel></root>")  # fmt: skip
        tree = read_tree(file)
        facts = Facts(tree)

        def answer(index: int, facts: Facts = facts) -> int:
            return engine.NAMES.index(dice.choice(sorted(facts.statuses(facts.nodes[index]))))

        def ask(script: Script) -> int:
            return dice.randint(max(script.least, -6), 6)

        running = engine.Engine(library, tree, answer, ask)
        assert all(one is other for one, other in zip(running.nodes, facts.nodes, strict=True))
        for tick in range(TICKS):
            root = engine.NAMES[running.tick(tick * 1000)]
            assert root in facts.statuses(tree.root), nodes
            for index, node in enumerate(facts.nodes):
                status = engine.NAMES[running.status(index)]
                if status == "IDLE":
                    continue
                assert id(node) in facts.reachable, (nodes, node.type.name)
                assert status in facts.statuses(node), (nodes, node.type.name)
                seen.add(node.type.name)
    assert seen >= set(built_in_types())


def test_the_sets_are_sharp_where_rules_need_them(tmp_path: Path) -> None:
    """Sound is easy: all four everywhere. These are exact."""
    cases = {
        "<Sequence><Yes/><Busy/></Sequence>": "RUNNING",
        "<Fallback><No/><Acts/></Fallback>": "FAILURE RUNNING SUCCESS",
        "<Fallback><No/><Yes/><Any/></Fallback>": "SUCCESS",
        "<ReactiveParallel success_count='1'><Busy/><Acts/></ReactiveParallel>": "RUNNING SUCCESS",
        "<Parallel><Busy/><Acts/></Parallel>": "FAILURE RUNNING",
        "<ParallelAll><Busy/><Acts/></ParallelAll>": "RUNNING",
        "<TryCatch><Acts/><Yes/></TryCatch>": "FAILURE RUNNING SUCCESS",
        "<TryCatch><Yes/><No/></TryCatch>": "SUCCESS",
        "<IfThenElse><Asks/><Yes/></IfThenElse>": "FAILURE SUCCESS",
        "<Inverter><Yes/></Inverter>": "FAILURE",
        "<RetryUntilSuccessful num_attempts='-1'><Asks/></RetryUntilSuccessful>": "RUNNING SUCCESS",
        "<KeepRunningUntilFailure><Yes/></KeepRunningUntilFailure>": "RUNNING",
        "<Timeout msec='5'><Yes/></Timeout>": "SUCCESS",
        "<Sequence><Skips/><Skips/></Sequence>": "SKIPPED",
        # What an entry gives in each tick may be anything.
        "<Repeat num_cycles='3'><Busy/></Repeat>": "RUNNING",
        "<Repeat num_cycles='{n}'><Busy/></Repeat>": "RUNNING SUCCESS",
        "<RetryUntilSuccessful num_attempts='{n}'><Asks/></RetryUntilSuccessful>": "FAILURE RUNNING SUCCESS",
        "<Parallel success_count='{n}'><Yes/><Yes/></Parallel>": "FAILURE SUCCESS",
        "<ParallelAll max_failures='{n}'><Yes/><Busy/></ParallelAll>": "RUNNING",
        "<ParallelAll max_failures='{n}'><Yes/><No/></ParallelAll>": "FAILURE SUCCESS",
        "<ReactiveParallel success_count='{n}'><Yes/><Busy/></ReactiveParallel>": "FAILURE RUNNING SUCCESS",
        "<Delay delay_msec='{n}'><Yes/></Delay>": "RUNNING SUCCESS",
        "<Delay delay_msec='0'><Yes/></Delay>": "SUCCESS",
        "<RunOnce then_skip='{n}'><Yes/></RunOnce>": "SKIPPED SUCCESS",
        "<Precondition if='n == 1' else='SKIPPED'><Yes/></Precondition>": "SKIPPED SUCCESS",
        "<Yes _skipIf='n == 1'/>": "SKIPPED SUCCESS",
        "<LoopInt queue='1;2' value='{n}' if_empty='FAILURE'><Yes/></LoopInt>": "FAILURE RUNNING",
        "<TryCatch catch_on_halt='true'><Busy/><Yes/></TryCatch>": "RUNNING",
        "<TestNode return_status='FAILURE'/>": "FAILURE",
        "<TestNode async_delay='5'/>": "RUNNING SUCCESS",
        "<Switch2 variable='{n}' case_1='1' case_2='2'><Yes/><No/><Busy/></Switch2>": "FAILURE RUNNING SUCCESS",
    }
    for nodes, expected in cases.items():
        file = tmp_path / "tree.xml"
        file.write_text(f"<root BTCPP_format='4'><BehaviorTree ID='T'>{nodes}</BehaviorTree>"
                        f"<TreeNodesModel>{MODEL}</TreeNodesModel></root>")  # fmt: skip
        root: Node = read_tree(file).root
        facts = Facts(read_tree(file))
        assert " ".join(sorted(facts.statuses(facts.tree.root))) == expected, (nodes, root.type.name)
