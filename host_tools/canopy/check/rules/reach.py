# SPDX-License-Identifier: MIT
"""Children that no tick can get to."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import Facts, label
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import Statuses
from canopy.compiler.tree_reader import Node


def _text(statuses: Statuses) -> str:
    return " or ".join(sorted(statuses)) or "nothing"


def _because(facts: Facts, parent: Node, index: int) -> str:
    if index == 0:
        return "its parent never ticks its child"
    blocker = parent.children[index - 1]
    if parent.type.name in ("IfThenElse", "WhileDoElse"):
        blocker = parent.children[0]
    return f"{label(blocker)} before it (line {blocker.place.line}) only returns {_text(facts.statuses(blocker))}"


@rule(
    "unreachable-child",
    Severity.WARNING,
    "A child that can never be ticked",
    why="It looks like behaviour, and the robot will never show it.",
    way_out="Remove it, put it before the child that always decides, or correct the `returns` of the leaf that does.",
)
def unreachable_child(facts: Facts) -> Iterator[Hit]:
    """The first child out of reach of each node that can itself be ticked; those after it have the same cause."""
    for parent in facts.nodes:
        if id(parent) not in facts.reachable:
            continue
        for index, (child, ticked) in enumerate(zip(parent.children, facts.ticked(parent), strict=True)):
            if not ticked:
                more = len(parent.children) - index - 1 if parent.type.name not in ("IfThenElse", "WhileDoElse") else 0
                also = f"; nor can the {more} after it" if more else ""
                yield hit(child, f"{label(child)} can never be ticked: {_because(facts, parent, index)}{also}")
                break
