# SPDX-License-Identifier: MIT
"""What becomes of failures: unseen, retried for ever, or the tree's own."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import FALLBACKS, Facts, label, through_decorators
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import F, R, S
from canopy.compiler.blackboard import Entry
from canopy.compiler.tree import Node

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


def _missing(facts: Facts, hidden: list[Node]) -> str:
    """What is missed when these nodes fail: an entry that they write and others read, or a safeguard; else nothing."""
    inside = {id(node) for top in hidden for node in facts.below(top)}
    for node in (node for top in hidden for node in facts.below(top)):
        if node.leaf is not None and node.leaf.safeguards:
            return f"{label(node)}, which keeps '{node.leaf.safeguards[0]}' safe, has failed"
        for bound in node.bound:
            if bound.port.writes and isinstance(bound.target, Entry):
                for other in facts.nodes:
                    facts.spend()
                    reads = any(b.target is bound.target and b.port.direction != "out" for b in other.bound)
                    if id(other) not in inside and reads:
                        return f"{label(other)} reads '{bound.target.name}', which {label(node)} may not have written"
    return ""


@rule(
    "hidden-failure",
    Severity.WARNING,
    "A failure that is hidden, and that something depends on",
    why="Whoever stands above is told SUCCESS, and goes on: with an entry that nobody has written, or without the "
    "safeguard.",
    way_out="Let the failure through, clean up in a TryCatch, or say that it does not matter (canopy:allow).",
)
def hidden_failure(facts: Facts) -> Iterator[Hit]:
    """ForceSuccess over a child that can fail; AlwaysSuccess as the last child of a Fallback that gets there."""
    for node in facts.nodes:
        if node.type.name == "ForceSuccess" and F in facts.statuses(node.children[0]):
            missing = _missing(facts, node.children)
            if missing:
                yield hit(node, f"{label(node)} hides that {label(node.children[0])} can fail: {missing}")
        elif node.type.name in FALLBACKS and len(node.children) > 1:
            last = node.children[-1]
            missing = _missing(facts, node.children[:-1]) if last.type.name == "AlwaysSuccess" else ""
            if missing and facts.ticked(node)[-1]:
                yield hit(last, f"{label(last)} hides that all other children of {label(node)} have failed: {missing}")


@rule(
    "root-can-fail",
    Severity.NOTE,
    "A last resort that can fail",
    why="A Fallback at the root is there so that something controls the robot in any case. After a FAILURE nothing in "
    "the tree does until the next tick: the outputs take their safe values.",
    way_out="Let its last child be one that cannot fail, e.g. an action that stops the robot, declared with "
    'returns="RUNNING".',
)
def root_can_fail(facts: Facts) -> Iterator[Hit]:
    """A Fallback at the root, or below decorators there, that can return FAILURE."""
    root = facts.tree.root
    top = through_decorators(root)
    if F in facts.statuses(root) and top.type.name in FALLBACKS and len(top.children) > 1:
        last = top.children[-1]
        if last.leaf is None or not last.leaf.is_guessed:
            yield hit(root, f"the tree '{facts.tree.id}' can return FAILURE: its last resort, {label(last)}, can fail")
