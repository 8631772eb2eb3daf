# SPDX-License-Identifier: MIT
"""Trees in which BehaviorTree.CPP did what no rule explained: random ones are like these too seldom to be a test."""

from __future__ import annotations

from pathlib import Path

import pytest

from canopy.semantics.spec import ATTRIBUTES, FAILURE, RUNNING, SKIPPED, SUCCESS, Script, Spec
from differential.compare import compare_with_btcpp
from differential.differences import run_differing_model
from differential.platforms import needs_btcpp
from differential.tree import Tree

A, B = 0, 1
"""Entries."""
SUCCEEDS = Spec("AlwaysSuccess", [])


def _with(spec: Spec, **scripts: Script) -> Spec:
    """The node with these attributes."""
    return Spec("Attributes", [spec], scripts=tuple(scripts.get(name) for name in ATTRIBUTES))


def _halted_then_answered_for(node: Spec) -> Tree:
    """The node starts, is halted in tick 2; in tick 3 a precondition answers for it, which in tick 4 is not asked."""
    node = _with(node, _failureIf=Script("==", A, 1))
    stops = _with(
        Spec("Condition", [], answers=bytes([SUCCESS, FAILURE, SUCCESS, SUCCESS])), _onFailure=Script(":=", A, 1)
    )
    return Tree(Spec("ReactiveSequence", [stops, Spec("IfThenElse", [node, SUCCEEDS])]), (0, 1, 2, 3))


def _skipped_below_idle() -> Tree:
    """A Precondition that is IDLE over a node that was SKIPPED, which is RUNNING there; the whole tree is halted."""
    skipped = Spec("SequenceWithMemory", [Spec("Condition", [], answers=bytes([SKIPPED]))])
    halted = _with(skipped, _onHalted=Script("+=", B, 2))
    return Tree(Spec("Precondition", [halted], (FAILURE,), scripts=(Script("<", B, 3),)), (0,), halt_after=1)


_LOOP = Spec(
    "Loop", [Spec("StatefulAction", [], answers=bytes([RUNNING] * 4))], (SUCCESS,), scripts=(Script("take", B, 3),)
)
_SKIPS = Spec("Condition", [], answers=bytes([SKIPPED] * 4))
_SKIPS_LATER = Spec("StatefulAction", [], answers=bytes([RUNNING, RUNNING, RUNNING, SKIPPED]))


@needs_btcpp
@pytest.mark.parametrize(
    ("rule", "tree"),
    [
        ("on halted", _skipped_below_idle()),
        ("loop goes on", _halted_then_answered_for(_LOOP)),
        ("stale skips", _halted_then_answered_for(Spec("SequenceWithMemory", [_SKIPS, _SKIPS_LATER]))),
    ],
    ids=[
        "halting the whole tree halts what is RUNNING below IDLE nodes, too",
        "a Loop that was halted goes on with the old child",
        "a SequenceWithMemory that was halted counts the children it had skipped",
    ],
)
def test_what_was_found_is_explained(runner: Path, rule: str, tree: Tree) -> None:
    report = compare_with_btcpp(runner, [tree])
    assert [how for _, how in report.failures] == []
    assert rule in run_differing_model(tree).fired[-1]
