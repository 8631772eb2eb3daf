# SPDX-License-Identifier: MIT
"""Conditions, and the actions that they guard or that make them true."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import REACTIVE, SEQUENCES, Facts, label, overlap, through_decorators
from canopy.check.names import achieves, undoes
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.check.status_sets import F
from canopy.check.thresholds import of_guard, of_script
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.tree import Script
from canopy.compiler.tree_reader import Node

WHILE = 3  # the place of _while among the parameters of Attributes (nodes.def)


def _cleaned_up(facts: Facts, parent: Node, opener: Leaf, failing: Node) -> bool:
    """Does something undo `opener` when `failing` fails: inside it, or in a node above that goes on after a failure?"""
    if any(undoes(leaf, opener) for _, leaf in facts.leaves(failing)):
        return True
    node: Node = parent
    above = facts.parent(node)
    while above is not None:
        facts.spend(len(above.children))
        place = next(index for index, child in enumerate(above.children) if child is node)
        if above.type.name not in SEQUENCES and any(
            undoes(leaf, opener) for later in above.children[place + 1 :] for _, leaf in facts.leaves(later)
        ):
            return True
        node, above = above, facts.parent(above)
    return False


@rule(
    "skipped-cleanup",
    Severity.WARNING,
    "A clean-up action that is skipped when an earlier sibling fails",
    why="OpenFridge, GrabBeer, CloseFridge: when GrabBeer fails, the Sequence ends, and the door stays open.",
    way_out="Use TryCatch with the clean-up as its last child, or do it in the failing branch, too: "
    "Fallback(GrabBeer, ForceFailure(CloseFridge)).",
)
def skipped_cleanup(facts: Facts) -> Iterator[Hit]:
    """Pairs by `undoes`, or by their names (Open/Close, Start/Stop, …), with a child between them that can fail."""
    for parent in facts.nodes:
        if parent.type.name in SEQUENCES:
            yield from _skipped_in(facts, parent)


def _skipped_in(facts: Facts, parent: Node) -> Iterator[Hit]:
    done: dict[str, tuple[int, Leaf]] = {}  # the last use of each leaf: trees may have thousands of siblings
    for index, child in enumerate(parent.children):
        cleaner = through_decorators(child)
        for earlier, opener in done.values():
            facts.spend()
            if cleaner.leaf is None or not undoes(cleaner.leaf, opener):
                continue
            for failing in parent.children[earlier + 1 : index]:
                facts.spend()
                if F in facts.statuses(failing) and not _cleaned_up(facts, parent, opener, failing):
                    yield hit(
                        cleaner,
                        f"{label(cleaner)} undoes '{opener.id}' (line {parent.children[earlier].place.line}), but is "
                        f"skipped when {label(failing)} (line {failing.place.line}) fails",
                    )
                    break
        done |= {leaf.id: (index, leaf) for _, leaf in facts.leaves(child) if leaf.kind != "Condition"}


@rule(
    "negated-guard",
    Severity.WARNING,
    "A negated condition before the action that makes it true",
    why="Sequence(Inverter(DoorOpen), OpenDoor) fails when the door is open already, which is what it wants.",
    way_out="Fallback(DoorOpen, OpenDoor): succeed when it is true, else make it true.",
)
def negated_guard(facts: Facts) -> Iterator[Hit]:
    """Pairs by `achieves`, or by their names (DoorOpen, OpenDoor)."""
    for parent in facts.nodes:
        if parent.type.name not in SEQUENCES:
            continue
        for index, child in enumerate(parent.children):
            condition = through_decorators(child)
            if child.type.name != "Inverter" or condition.leaf is None or condition.leaf.kind != "Condition":
                continue
            for later in parent.children[index + 1 :]:
                found = next((n for n, leaf in facts.leaves(later) if achieves(leaf, condition.leaf)), None)
                if found is not None:
                    yield hit(
                        child,
                        f"{label(parent)} fails when {label(condition)} is true already, although {label(found)} "
                        f"(line {found.place.line}) is there to make it true",
                        f"Fallback({condition.leaf.id}, {found.leaf.id if found.leaf else found.name})",
                    )
                    break


@rule(
    "no-hysteresis",
    Severity.WARNING,
    "A threshold without hysteresis that guards an action which moves the same signal",
    why="The paper's Lemma 6: at the threshold the action starts, moves the signal across it, is halted, and so on, in "
    "every other tick (chattering).",
    way_out="Two thresholds, as in 'Battery > 20 % and not recharging'; then say so in the condition's Metadata: "
    "`hysteresis='not recharging'`. A script that asks an entry, too, is taken to have it. Needs `moves` on the "
    "action, and `reads` on a condition that is no script.",
)
def no_hysteresis(facts: Facts) -> Iterator[Hit]:
    """Guards that are asked again while the action they decide on runs: under a reactive node, or as a `_while`."""
    for parent in facts.nodes:
        if parent.type.name in (*REACTIVE, "WhileDoElse"):
            for index, child in enumerate(parent.children):
                guard = through_decorators(child)
                signals = of_guard(guard)
                for later in parent.children[index + 1 :] if signals else ():
                    yield from _chattering(facts, guard, label(guard), signals, later)
        elif parent.type.name == "Attributes" and isinstance(while_ := parent.parameters[WHILE], Script):
            signals = of_script(while_)
            if signals:
                yield from _chattering(facts, parent, f'_while="{while_.text}"', signals, parent.children[0])


def _chattering(facts: Facts, guard: Node, name: str, signals: tuple[str, ...], guarded: Node) -> Iterator[Hit]:
    for action, leaf in facts.leaves(guarded):
        moved = next((m for m in leaf.moves if any(overlap(signal, m) for signal in signals)), None)
        if moved is not None:
            yield hit(guard, f"{name} decides whether {label(action)} runs, which moves '{moved}': chattering")
            return
