# SPDX-License-Identifier: MIT
"""What the paper warns of: trees that cannot react, sequences better made implicit, safety that nobody asks."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import PARALLELS, REACTIVE, Facts, label, overlap
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import F, R
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.tree import Node, Script

WHILE = 3  # the place of _while among the parameters of Attributes (nodes.def)
_PASSING = ("Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure")


def _way_up(facts: Facts, node: Node) -> Iterator[tuple[Node, int]]:
    """The nodes above, the nearest first, each with the place of the child that leads down."""
    child, above = node, facts.parent(node)
    while above is not None:
        yield above, next(place for place, other in enumerate(above.children) if other is child)
        child, above = above, facts.parent(above)


def _is_watched(facts: Facts, action: Node) -> bool:
    """Is anything else ticked while the action is RUNNING?"""
    for above, place in _way_up(facts, action):
        kind = above.type.name
        if kind in (*REACTIVE, "WhileDoElse") and place > 0:
            return True
        if kind in PARALLELS and len(above.children) > 1:
            return True
        if kind == "Attributes" and isinstance(above.parameters[WHILE], Script):
            return True
        if kind in ("Switch", "Control", "Decorator"):  # a Switch asks its entry; of yours nothing is known
            return True
    return False


@rule(
    "non-reactive",
    Severity.NOTE,
    "A tree with conditions, none of which is asked while an action is RUNNING",
    why="The paper's Remark 2: such a tree cannot react. A RUNNING action keeps control until it is done, whatever "
    "happens meanwhile.",
    way_out="Put what has to be seen in time before the action, in a ReactiveSequence or ReactiveFallback.",
)
def non_reactive(facts: Facts) -> Iterator[Hit]:
    """Trees that sense something, and none of whose RUNNING actions is interrupted by anything."""
    leaves = [node for node in facts.nodes if not node.children]
    running = [node for node in leaves if R in facts.statuses(node) and id(node) in facts.reachable]
    senses = any(node.type.name == "Condition" for node in leaves)
    if senses and running and not any(_is_watched(facts, node) for node in running):
        root = facts.tree.root
        yield hit(root, f"nothing else is ticked while {label(running[0])} is RUNNING, nor during any other action")


@rule(
    "implicit-sequence",
    Severity.NOTE,
    "Actions in a ReactiveSequence that could be an implicit sequence",
    why="The paper's Remark 4: the second action runs only while the first one says SUCCESS, so it must not undo what "
    "the first has done. A Fallback in reverse order asks for less.",
    way_out="ReactiveFallback(second, first): the second FAILS until it can act, and the first makes that possible, as "
    "in ReactiveFallback(PassThroughDoor, OpenDoor). The second must then not fail for other reasons.",
)
def implicit_sequence(facts: Facts) -> Iterator[Hit]:
    """Neighbours that are actions which can be RUNNING and can fail. A safeguard is meant to be first (Fig. 25)."""
    for parent in facts.nodes:
        if parent.type.name != "ReactiveSequence":
            continue
        for one, other in zip(parent.children, parent.children[1:], strict=False):
            both = [node for node in (one, other) if node.type.name == "StatefulAction"]
            is_guard = one.leaf is not None and one.leaf.safeguards
            if len(both) == 2 and not is_guard and all({R, F} <= facts.statuses(node) for node in both):
                yield hit(
                    parent,
                    f"{label(other)} runs only while {label(one)} succeeds again in every tick",
                    f"ReactiveFallback({other.name}, {one.name}), if {other.name} fails until {one.name} is done",
                )
                break


def _always_asked(facts: Facts, guard: Node, top: Node) -> bool:
    """Is the guard ticked whenever the child of `top` that leads to it is?"""
    for above, place in _way_up(facts, guard):
        if above is top:
            return True
        kind = above.type.name
        first = kind in (*REACTIVE, "WhileDoElse") and place == 0
        if not (first or kind in _PASSING or kind == "ReactiveParallel"):
            return False
    return False


def _guards(facts: Facts, guard: Node, action: Node) -> bool:
    """Is the guard asked before the action in every tick in which the action acts?"""
    ways = {id(above): place for above, place in _way_up(facts, guard)}
    for above, place in _way_up(facts, action):
        if id(above) in ways:
            reactive = above.type.name in (*REACTIVE, "WhileDoElse")
            return reactive and ways[id(above)] < place and _always_asked(facts, guard, above)
    return False


def _safeguards(leaf: Leaf, signal: str) -> bool:
    return any(overlap(signal, kept) for kept in leaf.safeguards)


@rule(
    "unguarded-safety",
    Severity.WARNING,
    "An action that moves a safeguarded signal, without its safeguard being asked before",
    why="The paper's Lemma 5: a safeguard protects what stands to its right in a reactive node, whatever that does. It "
    "protects nothing that runs while it is not asked.",
    way_out="ReactiveSequence(safeguard, the rest), with no node with memory between that and the safeguard. Needs "
    "`safeguards` on the leaf that keeps the signal safe, and `moves` on the action.",
)
def unguarded_safety(facts: Facts) -> Iterator[Hit]:
    """Every action that moves a signal which some leaf of the tree safeguards. A safeguard may move it itself."""
    everything = list(facts.leaves(facts.tree.root))
    guards = [(node, leaf) for node, leaf in everything if leaf.safeguards]
    for action, leaf in everything if guards else ():
        for signal in leaf.moves:
            known = [node for node, guard in guards if _safeguards(guard, signal)]
            if not known or _safeguards(leaf, signal) or any(_guards(facts, node, action) for node in known):
                continue
            yield hit(
                action,
                f"{label(action)} moves '{signal}', and {label(known[0])} (line {known[0].place.line}), which keeps it "
                "safe, is not asked before it in every tick",
            )
            break
