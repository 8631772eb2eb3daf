# SPDX-License-Identifier: MIT
"""What becomes of failures: unseen, retried for ever, or the tree's own."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import FALLBACKS, Facts, label
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import F, R, S

# How a completed cycle of the child comes back: what makes the decorator go on.
ENDLESS = {"Repeat": S, "RetryUntilSuccessful": F}


@rule(
    "unbounded-retry",
    Severity.WARNING,
    "A Retry or Repeat without end over a child that is never RUNNING",
    why="Nothing in it waits: it hammers its child in every tick (BehaviorTree.CPP never returns from the "
    "tick), and what comes after it has no chance until the child changes its mind.",
    way_out="Give num_attempts or num_cycles, put a Timeout around it, or a Delay inside.",
)
def unbounded_retry(facts: Facts) -> Iterator[Hit]:
    """A Timeout directly above (through decorators) bounds it."""
    for node in facts.nodes:
        again = ENDLESS.get(node.type.name)
        if again is None or node.parameters[0] != -1:  # -1 is the only endless one; an entry's value is not known
            continue
        statuses = facts.statuses(node.children[0])
        above = facts.parent(node)
        while above is not None and above.type.category == "DECORATOR" and above.type.name != "Timeout":
            above = facts.parent(above)
        bounded = above is not None and above.type.name == "Timeout"
        if R not in statuses and again in statuses and not bounded:
            yield hit(node, f"{label(node)} has no end, and its child {label(node.children[0])} is never RUNNING")


@rule(
    "hidden-failure",
    Severity.WARNING,
    "A failure that nobody hears of",
    why="Whoever stands above is told SUCCESS, and goes on as if the work were done.",
    way_out="Let the failure through, clean up in a TryCatch, or say that it does not matter (canopy:allow).",
)
def hidden_failure(facts: Facts) -> Iterator[Hit]:
    """ForceSuccess over a child that can fail; AlwaysSuccess as the last child of a Fallback that gets there."""
    for node in facts.nodes:
        if node.type.name == "ForceSuccess" and F in facts.statuses(node.children[0]):
            yield hit(node, f"{label(node)} hides that {label(node.children[0])} can fail")
        elif node.type.name in FALLBACKS and len(node.children) > 1:
            last = node.children[-1]
            if last.type.name == "AlwaysSuccess" and facts.ticked(node)[-1]:
                yield hit(last, f"{label(last)} hides that all other children of {label(node)} have failed")


@rule(
    "root-can-fail",
    Severity.NOTE,
    "A root that can fail, with no safe last resort",
    why="After a FAILURE nothing in the tree controls the robot until the next tick: the outputs take their safe "
    "values.",
    way_out="Make the root a (Reactive)Fallback whose last child cannot fail, e.g. an action that stops the robot, "
    'declared with returns="RUNNING".',
)
def root_can_fail(facts: Facts) -> Iterator[Hit]:
    """FAILURE is among what the root can return."""
    root = facts.tree.root
    if F in facts.statuses(root):
        yield hit(root, f"the tree '{facts.tree.id}' can return FAILURE, and has no last resort that cannot fail")
