# SPDX-License-Identifier: MIT
"""The tree as the engine's tables: nodes in depth-first order, parameters, state words, leaves by kind, scripts."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field

from canopy.compiler.bound_ports import Bindings, BoundPort
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.limits import count
from canopy.compiler.tree import Node, Script, Tree


@dataclass(frozen=True)
class Row:
    """One entry of the node table; the fields are those of canopy_node_t."""

    node: Node
    parent: int
    end: int
    state: int
    leaf: int
    parameter: int
    asks: int
    depth: int


@dataclass(frozen=True)
class LeafUse:
    """A node of the user's that the tree uses: its declaration, its place in its table, and its instances."""

    leaf: Leaf
    index: int
    nodes: list[Node]
    ports: list[tuple[BoundPort, ...]] = field(default_factory=list)
    exchangeable: bool = False
    """An image may give it other ports."""

    @property
    def copies(self) -> bool:
        """Are ports copied before each call?"""
        return (self.exchangeable and bool(self.leaf.ports)) or self.reads_entries

    @property
    def reads_entries(self) -> bool:
        """Does the tree connect a port to what changes: an entry, a signal?"""
        return any(port.copy is not None for ports in self.ports for port in ports)


@dataclass(frozen=True)
class Table:
    """Everything the engine's constant tables hold. `script_leaf`: the leaf that runs scripts, after the user's."""

    tree: Tree
    rows: tuple[Row, ...]
    parameters: tuple[int, ...]
    leaves: tuple[LeafUse, ...]
    controls: tuple[LeafUse, ...]
    scripts: tuple[Script, ...]
    script_leaf: bool
    words: int
    bindings: Bindings

    @property
    def users(self) -> tuple[LeafUse, ...]:
        """All that the user writes: leaves, then control nodes and decorators."""
        return self.leaves + self.controls

    @property
    def leaf_count(self) -> int:
        """Entries of the leaf table."""
        return len(self.leaves) + int(self.script_leaf)

    def parameter_notes(self) -> list[tuple[Node, str]]:
        """For each parameter the first node that has it, and its name there."""
        notes: dict[int, tuple[Node, str]] = {}
        for row in self.rows:
            if row.node.leaf is None and row.node.script is None:
                for which, parameter in enumerate(row.node.type.parameters[: len(row.node.parameters)]):
                    notes.setdefault(row.parameter + which, (row.node, parameter.name))
        return [notes[index] for index in range(len(self.parameters))]

    @property
    def hash(self) -> str:
        """16 hex digits that change whenever the tables do."""
        text = repr(
            [
                (row.node.type.enum, row.node.name, row.parent, row.end, row.state, row.leaf, row.parameter, row.asks)
                for row in self.rows
            ]
            + [(use.leaf.id, use.leaf.kind, use.leaf.ports and use.ports) for use in self.users]
            + [self.parameters]
            + [script.body for script in self.scripts]
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


class _Layout:
    def __init__(self, tree: Tree, bindings: Bindings) -> None:
        self._tree = tree
        self._bindings = bindings
        self._nodes = _ends(tree.root)
        self._parameters: list[int] = []
        self._places: dict[tuple[int, ...], int] = {}  # equal parameters are stored once
        self._leaves: dict[str, LeafUse] = {}
        self._controls: dict[str, LeafUse] = {}
        self._scripts: list[Script] = []
        self._bodies: dict[tuple[str, ...], int] = {}  # and so are equal scripts
        self._words = 0

    def table(self) -> Table:
        # The leaf that runs scripts comes after the user's, so these are counted first.
        user_leaves = {n.leaf.id for n, _, _, _ in self._nodes if n.leaf is not None and not n.leaf.is_inner}
        rows = [self._row(*entry, script_leaf=len(user_leaves)) for entry in self._nodes]
        return Table(
            self._tree,
            tuple(rows),
            tuple(self._parameters),
            tuple(self._leaves.values()),
            tuple(self._controls.values()),
            tuple(self._scripts),
            any(node.script is not None for node, _, _, _ in self._nodes),
            self._words,
            self._bindings,
        )

    def _row(self, node: Node, parent: int, end: int, depth: int, *, script_leaf: int) -> Row:
        leaf = parameter = state = asks = 0
        if node.leaf is not None:
            uses = self._controls if node.leaf.is_inner else self._leaves
            use = uses.setdefault(node.leaf.id, LeafUse(node.leaf, len(uses), []))
            leaf, parameter = use.index, len(use.nodes)
            use.nodes.append(node)
            use.ports.append(self._bindings.ports.get(id(node), ()))
        elif node.script is not None:
            leaf, parameter = script_leaf, self._script(node.script)
        elif node.parameters:
            values = tuple(p if isinstance(p, int) else self._script(p) for p in node.parameters)
            for which, given in enumerate(node.parameters):
                if not isinstance(given, int) and given.role == "parameter":
                    asks |= 1 << which
            parameter = self._places.setdefault(values, len(self._parameters))
            if parameter == len(self._parameters):
                self._parameters.extend(values)
        if node.type.words:
            state, self._words = self._words, self._words + node.type.words
        return Row(node, parent, end, state, leaf, parameter, asks, depth)

    def _script(self, script: Script) -> int:
        index = self._bodies.setdefault(script.body, len(self._scripts))
        if index == len(self._scripts):
            self._scripts.append(script)
        return index


def _check_sizes(table: Table) -> None:
    """Places in the tables are 16 bits wide, in the engine and in entries that hold texts."""
    help_text = "divide the tree among several applications"
    place = table.tree.root.place
    for things, what in (
        (table.words, "words of state of all nodes together"),
        (table.parameters, "parameters of all nodes together"),
        (table.scripts, "scripts that differ"),
        (table.bindings.texts, "texts that differ"),
        (table.bindings.entries, "entries"),
    ):
        count(things, what, place, help_text)


def make_table(tree: Tree, bindings: Bindings | None = None) -> Table:
    """Lays the tree out.

    Raises:
        CompileError: it needs more room than the engine can address.
    """
    table = _Layout(tree, bindings or Bindings()).table()
    _check_sizes(table)
    return table
