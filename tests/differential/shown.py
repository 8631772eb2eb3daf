# SPDX-License-Identifier: MIT
"""Whether BehaviorTree.CPP shows the same statuses as the engine, but for the differences that have no effect."""

from __future__ import annotations

from canopy.semantics import COMPLETED
from canopy.semantics.spec import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, WAS, Spec
from differential.tree import Outcome, Tree

SHOWN: dict[str, str] = {
    "root": "it resets a completed root",
    "skipped": "it does not store SKIPPED",
    "reactive": "a reactive node resets what it has ticked before the RUNNING child",
    "memory": "a SequenceWithMemory that fails does not reset the children before",
    "no else": "a two-child IfThenElse does not reset its condition after a FAILURE",
}
"""The differences that are only shown."""


class Shown:
    """What the engine and BehaviorTree.CPP show of one tree."""

    def __init__(self, tree: Tree) -> None:
        self._specs: list[Spec] = []
        self._parents: list[Spec | None] = []
        self._number(tree.root, None)
        self._attributes = [place for place, spec in enumerate(self._specs) if spec.kind == "Attributes"]

    def _number(self, spec: Spec, parent: Spec | None) -> None:
        self._specs.append(spec)
        self._parents.append(parent)
        for child in spec.children:
            self._number(child, parent if spec.kind == "Attributes" else spec)

    def otherwise(self, ours: Outcome, theirs: Outcome) -> set[str] | None:
        """Which of SHOWN there are between the statuses after a tick; None when there is any other difference."""
        our_codes = list(ours.codes)
        for place in self._attributes:  # no node of its own there: what it shows, its child shows there
            our_codes[place + 1], our_codes[place] = our_codes[place], IDLE
        ways: set[str] = set()
        for spec, parent, our, their in zip(self._specs, self._parents, our_codes, theirs.codes, strict=True):
            if (IDLE if our >= WAS else our) != their:
                way = _way(spec, parent, our, their)
                if way is None:
                    return None
                ways.add(way)
        return ways


def _bare_spec(spec: Spec) -> Spec:
    return spec.children[0] if spec.kind == "Attributes" else spec


def _way(spec: Spec, parent: Spec | None, ours: int, theirs: int) -> str | None:
    """In which of SHOWN a node's statuses differ; None when it is none of them."""
    if parent is None and ours in COMPLETED and theirs == IDLE:
        return "root"
    if ours == SKIPPED or ours == WAS + SKIPPED:
        return "skipped" if theirs in ((IDLE, RUNNING) if spec.children else (IDLE, SKIPPED)) else None
    if parent is None:
        return None
    if parent.kind in ("ReactiveSequence", "ReactiveFallback"):
        return "reactive" if ours in (SUCCESS, FAILURE) and theirs == IDLE else None
    if parent.kind == "SequenceWithMemory":
        return "memory" if ours == WAS + theirs else None
    if parent.kind == "IfThenElse" and len(parent.children) == 2 and spec is _bare_spec(parent.children[0]):
        return "no else" if ours == WAS + FAILURE and theirs == FAILURE else None
    return None
