# SPDX-License-Identifier: MIT
"""Whether BehaviorTree.CPP shows the same statuses as the engine, but for the differences that have no effect."""

from __future__ import annotations

from differential.model import COMPLETED
from differential.tree import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, WAS, Outcome, Spec, Tree


def shown_alike(tree: Tree, ours: Outcome, theirs: Outcome) -> bool:
    """Whether the engine and BehaviorTree.CPP show the same statuses after a tick, but for how it shows them.

    The differences that only are shown: it resets a completed root; it does not store SKIPPED; a reactive node resets
    what it has ticked before the RUNNING child; a SequenceWithMemory that fails does not reset the children before; a
    two-child IfThenElse does not reset its condition after a FAILURE.
    """
    parents: list[Spec | None] = []
    specs: list[Spec] = []

    def number(spec: Spec, parent: Spec | None) -> None:
        specs.append(spec)
        parents.append(parent)
        for child in spec.children:
            number(child, parent if spec.kind == "Attributes" else spec)

    number(tree.root, None)
    our_codes = list(ours.codes)
    for place, spec in enumerate(specs):
        if spec.kind == "Attributes":  # no node of its own there: what it shows, its child shows there
            our_codes[place + 1], our_codes[place] = our_codes[place], IDLE
    return all(
        _alike(spec, parent, our, their)
        for spec, parent, our, their in zip(specs, parents, our_codes, theirs.codes, strict=True)
    )


def _bare_spec(spec: Spec) -> Spec:
    return spec.children[0] if spec.kind == "Attributes" else spec


def _alike(spec: Spec, parent: Spec | None, ours: int, theirs: int) -> bool:
    if (IDLE if ours >= WAS else ours) == theirs:
        return True
    if parent is None and ours in COMPLETED and theirs == IDLE:
        return True
    if ours == SKIPPED or ours == WAS + SKIPPED:
        return theirs in ((IDLE, RUNNING) if spec.children else (IDLE, SKIPPED))
    if parent is None:
        return False
    if parent.kind in ("ReactiveSequence", "ReactiveFallback"):
        return ours in (SUCCESS, FAILURE) and theirs == IDLE
    if parent.kind == "SequenceWithMemory":
        return ours == WAS + theirs
    if parent.kind == "IfThenElse" and len(parent.children) == 2 and spec is _bare_spec(parent.children[0]):
        return ours == WAS + FAILURE and theirs == FAILURE
    return False
