# SPDX-License-Identifier: MIT
"""Children that run side by side."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import PARALLELS, Facts, label, overlap
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import F, R, S, outcome
from canopy.compiler.tree_reader import Node


def _writers(facts: Facts, child: Node) -> dict[str, Node]:
    return {output: node for node, leaf in facts.leaves(child) for output in leaf.writes}


@rule(
    "parallel-write",
    Severity.ERROR,
    "Children of a parallel node that write the same output",
    why="The paper's Assumption 2: each child controls its own part of the robot. Here the last one to write wins, "
    "in each tick.",
    way_out='Give each its own signals (`writes="Command.Speed"`), or put them under a node that ticks one at a time.',
)
def parallel_write(facts: Facts) -> Iterator[Hit]:
    """One hit for each child and output that an earlier child writes, too."""
    for parent in facts.nodes:
        if parent.type.name not in PARALLELS:
            continue
        before: dict[str, Node] = {}
        for child in parent.children:
            mine = _writers(facts, child)
            for output, writer in mine.items():
                facts.spend(len(before))
                other = next((name for name in before if overlap(name, output)), None)
                if other is not None:
                    first = before[other]
                    yield hit(
                        writer,
                        f"{label(writer)} writes '{output}', and {label(first)} (line {first.place.line}), which runs "
                        f"in parallel with it, writes '{other}'",
                    )
            before |= mine


@rule(
    "parallel-masked",
    Severity.WARNING,
    "A child of a parallel node that is always RUNNING, so that the parallel hides what the others do",
    why="It never completes, so it counts for neither threshold: the parallel node can no longer succeed, or no "
    "longer fail.",
    way_out="Change the threshold (e.g. success_count), or move the endless child out of the parallel node.",
)
def parallel_masked(facts: Facts) -> Iterator[Hit]:
    """Asks what the parallel could return if this child could complete."""
    for parent in facts.nodes:
        if parent.type.name not in PARALLELS:
            continue
        for index, child in enumerate(parent.children):
            if facts.statuses(child) != {R}:
                continue
            facts.spend(len(parent.children))
            sets = [facts.statuses(other) for other in parent.children]
            sets[index] = frozenset((S, F, R))
            lost = (outcome(parent, sets).statuses - facts.statuses(parent)) & {S, F}
            if lost:
                verb = " nor ".join({S: "succeed", F: "fail"}[status] for status in sorted(lost, reverse=True))
                yield hit(
                    child,
                    f"{label(child)} is always RUNNING: {label(parent)} can never {verb}, whatever the others return",
                )
