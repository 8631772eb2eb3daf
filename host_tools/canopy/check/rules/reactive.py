# SPDX-License-Identifier: MIT
"""Children of the memoryless nodes, which start at their first child in every tick."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import FALLBACKS, REACTIVE, SEQUENCES, Facts, label, through_decorators
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import R
from canopy.compiler.tree_reader import Node


def _guard_asked_once(facts: Facts, node: Node) -> tuple[Node, Node] | None:
    """A condition that this node does not ask again while a later child of it is RUNNING."""
    guard: Node | None = None
    for child in node.children:
        if guard is not None and R in facts.statuses(child):
            return guard, child
        inner = through_decorators(child)
        if guard is None and inner.type.name in ("Condition", "WasEntryUpdated"):
            guard = inner
    return None


@rule(
    "memory-under-reactive",
    Severity.WARNING,
    "A guard inside a node with memory, under a reactive parent",
    why="The parent asks again in every tick, but the node with memory goes on at its RUNNING child: the guard is "
    "asked once, and may be false long before the action ends.",
    way_out="Make the inner node reactive too, or move the guard up to the reactive parent.",
)
def memory_under_reactive(facts: Facts) -> Iterator[Hit]:
    """Conditions before a RUNNING-capable child of a Sequence, Fallback or IfThenElse below a reactive node."""
    with_memory = {*SEQUENCES, *FALLBACKS, "IfThenElse"} - {*REACTIVE}
    for parent in facts.nodes:
        if parent.type.name not in REACTIVE:
            continue
        for child in parent.children:
            inner = through_decorators(child)
            found = _guard_asked_once(facts, inner) if inner.type.name in with_memory else None
            if found is not None:
                guard, action = found
                yield hit(
                    inner,
                    f"{label(inner)} has a memory: while {label(action)} is RUNNING it does not ask {label(guard)} "
                    f"again, although its parent {label(parent)} is reactive",
                )


@rule(
    "several-running",
    Severity.NOTE,
    "Several children of a reactive node that can be RUNNING",
    why="While a later one is RUNNING, the earlier ones are started anew in every tick; when an earlier one becomes "
    "RUNNING again, it halts the later one. BehaviorTree.CPP refuses this at run time.",
    way_out="Fine for the paper's memoryless actions, which act on what they sense. Otherwise guard each with a "
    "Condition, or use a node with memory.",
)
def several_running(facts: Facts) -> Iterator[Hit]:
    """One hit a node. What nobody declared may be an action of one tick, and is not counted."""
    for parent in facts.nodes:
        if parent.type.name in REACTIVE:
            running = [child for child in parent.children if facts.runs(child)]
            if len(running) > 1:
                names = ", ".join(label(child) for child in running)
                yield hit(parent, f"{len(running)} children of {label(parent)} can be RUNNING: {names}")
