# SPDX-License-Identifier: MIT
"""The nodes of a tree depth first, without recursion."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.compiler.tree_reader import Node


def in_order(root: Node) -> Iterator[tuple[Node, Node | None, int]]:
    """(node, parent, depth) of every node; the root's parent is None, its depth 0."""
    waiting: list[tuple[Node, Node | None, int]] = [(root, None, 0)]
    while waiting:
        node, parent, depth = waiting.pop()
        yield node, parent, depth
        waiting.extend((child, node, depth + 1) for child in reversed(node.children))
