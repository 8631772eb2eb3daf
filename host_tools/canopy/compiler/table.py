# SPDX-License-Identifier: MIT
"""The tree as the engine's tables: nodes in depth-first order, parameters, state words, leaves by kind."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from canopy.compiler.leaf_model import Leaf
from canopy.compiler.tree_reader import Node, Tree


@dataclass(frozen=True)
class Row:
    """One entry of the node table; the fields are those of canopy_node_t."""

    node: Node
    parent: int
    end: int
    state: int
    leaf: int
    parameter: int
    depth: int


@dataclass(frozen=True)
class LeafUse:
    """A leaf that the tree uses: its declaration, its place in the leaf table, and the nodes that are its instances."""

    leaf: Leaf
    index: int
    nodes: list[Node]


@dataclass(frozen=True)
class Table:
    """Everything the engine's constant tables hold."""

    tree: Tree
    rows: tuple[Row, ...]
    parameters: tuple[int, ...]
    leaves: tuple[LeafUse, ...]
    words: int

    @property
    def hash(self) -> str:
        """16 hex digits that change whenever the tables do."""
        text = repr(
            [
                (row.node.type.enum, row.node.name, row.parent, row.end, row.state, row.leaf, row.parameter)
                for row in self.rows
            ]
            + [(use.leaf.id, use.leaf.kind, use.leaf.ports and [n.port_values for n in use.nodes]) for use in self.leaves]
            + [self.parameters]
        )
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def _ends(root: Node) -> list[tuple[Node, int, int, int]]:
    """(node, parent, end, depth) of each node in depth-first order, without recursion."""
    order: list[tuple[Node, int, int]] = []
    waiting = [(root, 0, 1)]
    while waiting:
        node, parent, depth = waiting.pop()
        index = len(order)
        order.append((node, parent, depth))
        waiting.extend((child, index, depth + 1) for child in reversed(node.children))
    ends = [index + 1 for index in range(len(order))]
    for index in range(len(order) - 1, 0, -1):
        parent = order[index][1]
        ends[parent] = max(ends[parent], ends[index])
    return [(node, parent, ends[index], depth) for index, (node, parent, depth) in enumerate(order)]


def make_table(tree: Tree) -> Table:
    """Lays the tree out."""
    rows: list[Row] = []
    parameters: list[int] = []
    places: dict[tuple[int, ...], int] = {}  # equal parameters are stored once
    uses: dict[str, LeafUse] = {}
    words = 0
    for node, parent, end, depth in _ends(tree.root):
        leaf = parameter = state = 0
        if node.leaf is not None:
            use = uses.setdefault(node.leaf.id, LeafUse(node.leaf, len(uses), []))
            leaf, parameter = use.index, len(use.nodes)
            use.nodes.append(node)
        elif node.parameters:
            parameter = places.setdefault(node.parameters, len(parameters))
            if parameter == len(parameters):
                parameters.extend(node.parameters)
        if node.type.words:
            state, words = words, words + node.type.words
        rows.append(Row(node, parent, end, state, leaf, parameter, depth))
    return Table(tree, tuple(rows), tuple(parameters), tuple(uses.values()), words)
