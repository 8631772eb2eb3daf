# SPDX-License-Identifier: MIT
"""A tree with everything that rules ask about it, worked out once, without recursion: trees may be as deep as large."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from canopy.check.bus_facts import BusFacts
from canopy.check.status_sets import Outcome, R, Statuses, outcome
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.tree_reader import Node, Tree
from canopy.compiler.xml_reader import Element, read_xml

SEQUENCES = ("Sequence", "SequenceWithMemory", "AsyncSequence", "ReactiveSequence")
FALLBACKS = ("Fallback", "AsyncFallback", "ReactiveFallback")
PARALLELS = ("Parallel", "ParallelAll", "ReactiveParallel")
REACTIVE = ("ReactiveSequence", "ReactiveFallback")


STEPS = 3_000_000
"""What a rule may look at in one tree: rules compare pairs, and a tree may have 65,534 nodes."""


class TooLargeError(Exception):
    """A rule has used up its STEPS."""


class Facts:
    """The checked tree, its nodes in depth-first order, and what each can return; and the bus, where one was given."""

    def __init__(self, tree: Tree, bus: BusFacts | None = None) -> None:
        self.tree = tree
        self.bus = bus
        self.nodes: list[Node] = []
        self._index: dict[int, int] = {}
        self._parent: dict[int, Node] = {}
        self._end: list[int] = []
        self._outcomes: dict[int, Outcome] = {}
        self._elements: dict[str, dict[tuple[int, int], Element]] = {}
        self._left = STEPS
        self._lay_out()

    def begin_rule(self) -> None:
        """Gives the next rule its STEPS."""
        self._left = STEPS

    def spend(self, steps: int = 1) -> None:
        """Rules call this where they look at pairs.

        Raises:
            TooLargeError: this was one too many.
        """
        self._left -= steps
        if self._left < 0:
            raise TooLargeError

    def _lay_out(self) -> None:
        waiting = [self.tree.root]
        while waiting:
            node = waiting.pop()
            self._index[id(node)] = len(self.nodes)
            self.nodes.append(node)
            for child in reversed(node.children):
                self._parent[id(child)] = node
                waiting.append(child)
        self._end = [index + 1 for index in range(len(self.nodes))]
        for index in range(len(self.nodes) - 1, -1, -1):
            node = self.nodes[index]
            self._outcomes[id(node)] = outcome(node, [self.statuses(child) for child in node.children])
            if node.children:
                self._end[index] = self._end[self._index[id(node.children[-1])]]

    def statuses(self, node: Node) -> Statuses:
        """All statuses that the node can return."""
        return self._outcomes[id(node)].statuses

    def runs(self, node: Node) -> bool:
        """Can it be RUNNING, as far as is known? What nobody declared may be an action of one tick."""
        if R not in self.statuses(node):
            return False
        own = [other for other in self.below(node) if not other.children or other.type.category == "DECORATOR"]
        sure = [other for other in own if other.leaf is None or not other.leaf.is_guessed]
        return any(R in self.statuses(other) for other in sure if not other.children) or any(
            R in self.statuses(other) and R not in self.statuses(other.children[0]) for other in sure if other.children
        )

    def ticked(self, node: Node) -> tuple[bool, ...]:
        """For each child of the node: can it be ticked?"""
        return self._outcomes[id(node)].ticked

    def parent(self, node: Node) -> Node | None:
        """The node's parent; None for the root."""
        return self._parent.get(id(node))

    def below(self, node: Node) -> list[Node]:
        """The node and all nodes below it, depth first."""
        index = self._index[id(node)]
        self.spend(self._end[index] - index)
        return self.nodes[index : self._end[index]]

    def leaves(self, node: Node) -> Iterator[tuple[Node, Leaf]]:
        """The user's leaves at and below the node."""
        for other in self.below(node):
            if other.leaf is not None:
                yield other, other.leaf

    @cached_property
    def reachable(self) -> set[int]:
        """id() of every node that can be ticked: neither it nor a node above it is out of reach."""
        result = {id(self.tree.root)}
        for node in self.nodes:
            if id(node) in result:
                result |= {id(c) for c, ticked in zip(node.children, self.ticked(node), strict=True) if ticked}
        return result

    def _file(self, file: str) -> dict[tuple[int, int], Element]:
        if file not in self._elements:
            self._elements[file] = elements_by_place(Path(file))
        return self._elements[file]

    def elements(self, file: str) -> list[Element]:
        """Every element of one of the tree's files, in no particular order."""
        return list(self._file(file).values())

    def element(self, place: Place) -> Element | None:
        """The XML element that begins at `place`: what the tree's Node does not keep, it still says."""
        return self._file(place.file).get((place.line, place.column))


def elements_by_place(path: Path) -> dict[tuple[int, int], Element]:
    """Every element of an XML file by line and column; none if the file cannot be read."""
    try:
        waiting = [read_xml(path)]
    except CompileError:
        return {}
    found: dict[tuple[int, int], Element] = {}
    while waiting:
        element = waiting.pop()
        found[element.place.line, element.place.column] = element
        waiting.extend(element.children)
    return found


def through_decorators(node: Node) -> Node:
    """The first node at or below this one that is no decorator."""
    while node.type.category == "DECORATOR" and node.children:
        node = node.children[0]
    return node


def label(node: Node) -> str:
    """How messages name a node: its type, and its name when that says more."""
    kind = node.xml_name or node.type.name
    return f"<{kind}>" if node.name == kind else f"<{kind}> '{node.name}'"


def overlap(one: str, other: str) -> bool:
    """Do two names mean a common signal? `Command` is all of the message, `Command.Mode` one signal of it."""
    message, _, signal = one.partition(".")
    other_message, _, other_signal = other.partition(".")
    return message == other_message and (not signal or not other_signal or signal == other_signal)
