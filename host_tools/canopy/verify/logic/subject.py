# SPDX-License-Identifier: MIT
"""A tree as `canopy compile` reads it, as one that has a circuit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from canopy.check.status_sets import NUMBERS, leaf_statuses
from canopy.compiler.blackboard import SignalName
from canopy.compiler.errors import CompileError, nearest
from canopy.compiler.script.syntax import Assignment, Name, ScriptError, parse, parts
from canopy.compiler.script_bodies import entry_value
from canopy.compiler.tree import Node, Script, Tree
from canopy.semantics.spec import Script as ModelScript
from canopy.semantics.spec import Spec
from canopy.verify.expression import ExpressionError
from canopy.verify.logic.encode import CELLS

MAX_DEPTH = 200
"""Levels; the circuits are made recursively."""
MAX_COUNTED = 500
"""Children of a node that counts them; its circuit has some gates for each pair of them."""
ROOT = "root"
OF_THE_NODE_ITSELF = ("TICKED", "HALTED")
"""What a node's attributes do not take part in."""
_STATUS_OF = {name: number for number, name in NUMBERS.items()}
_SCRIPT_LEAVES = ("Script", "ScriptCondition", "SetBlackboard", "UnsetBlackboard")
_SCRIPTED = ("SkipUnlessUpdated", "WaitValueUpdate", "WasEntryUpdated", "Switch")
_ASKED = ModelScript("free", 0)


@dataclass(frozen=True)
class Unsupported:
    """A node that has no circuit, and why."""

    node: Node
    why: str

    def __str__(self) -> str:
        return f"{self.node.place}: {self.node.path}: {self.why}"


def _nodes(root: Node) -> Iterator[tuple[Node, int]]:
    """All nodes with their level, in the order of the file."""
    waiting = [(root, 1)]
    while waiting:
        node, level = waiting.pop()
        yield node, level
        waiting += [(child, level + 1) for child in reversed(node.children)]


def _problem(node: Node, level: int) -> str:
    """Why a node has no circuit; empty if it has one."""
    kind = kind_of(node)
    if level > MAX_DEPTH:
        return f"it lies deeper than {MAX_DEPTH} levels"
    if kind not in CELLS:
        return f"<{node.xml_name or kind}> is not modelled"
    if kind in ("Parallel", "ParallelAll", "ReactiveParallel") and len(node.children) > MAX_COUNTED:
        return f"<{kind}> with more than {MAX_COUNTED} children is not modelled"
    if kind == "TryCatch" and node.parameters[0] != 0:
        return 'catch_on_halt="true" is not modelled'
    if any(isinstance(value, Script) for value in _numbers(node, kind)):
        return "a parameter that an entry or a signal gives is not modelled"
    return ""


def kind_of(node: Node) -> str:
    """The node's kind, as canopy.semantics calls it.

    A Script that reads a signal fails while that is stale, else it succeeds: that is what a ScriptCondition may answer.
    """
    if node.xml_name not in _SCRIPT_LEAVES:
        return node.type.name
    fails = node.xml_name == "ScriptCondition" or (node.script is not None and _reads_signals(node.script))
    return "ScriptCondition" if fails else "Script"


def _reads_signals(script: Script) -> bool:
    """Does what the script is depend on a message that may be stale?"""
    if script.role == "unset":
        return False
    if script.role == "set":
        return isinstance(entry_value(script), SignalName)
    try:
        statements = parse(script.text)
    except ScriptError as error:
        raise CompileError(script.place(error.index), error.message, error.help_text) from error
    read = [part for statement in statements for part in parts(statement) if isinstance(part, Name)]
    written = [statement.target for statement in statements if isinstance(statement, Assignment)]
    names = [part.name for part in read if not any(part is target for target in written)]
    return any(isinstance(script.scope.resolve(name, script.place()), SignalName) for name in names)


def _numbers(node: Node, kind: str) -> tuple[int | Script, ...]:
    """The parameters that are numbers in every tree; the others are scripts."""
    if kind in ("Precondition", "Loop"):
        return node.parameters[1:]
    return () if kind == "Attributes" or kind in _SCRIPTED else node.parameters


def _scripts(node: Node, kind: str) -> tuple[ModelScript | None, ...]:
    if kind == "Attributes":
        return tuple(_ASKED if isinstance(script, Script) else None for script in node.parameters)
    asked = kind in _SCRIPTED or kind in _SCRIPT_LEAVES or kind in ("Precondition", "Loop")
    return (_ASKED,) if asked else ()


class LogicTree:
    """The tree, its names, and what its leaves may return."""

    def __init__(self, tree: Tree) -> None:
        levels = list(_nodes(tree.root))
        self.nodes = [node for node, _ in levels]
        found = ((node, _problem(node, level)) for node, level in levels)
        self.unsupported = [Unsupported(node, why) for node, why in found if why]
        self.free = [node for node in self.nodes if _asks(node)]
        self.timed = [node for node in self.nodes if kind_of(node) in ("Sleep", "Delay", "Timeout")]
        self.returns: dict[int, tuple[int, ...]] = {}
        self._by_name: dict[str, list[int]] = {}
        for number, node in enumerate(self.nodes):
            for name in {node.name, node.path, node.path.lstrip("/")}:
                self._by_name.setdefault(name, []).append(number)
            if node.leaf is not None and node.type.name in ("Condition", "SyncAction", "StatefulAction"):
                self.returns[number] = tuple(sorted(_STATUS_OF[status] for status in leaf_statuses(node)))
        self._by_name.setdefault(ROOT, [0])

    def spec(self) -> Spec:
        """The tree of canopy.semantics. Only for a tree without unsupported nodes.

        Raises:
            CompileError: A node is not supported.
        """
        if self.unsupported:
            raise CompileError(self.unsupported[0].node.place, self.unsupported[0].why)
        return self._spec(self.nodes[0])

    def _spec(self, node: Node) -> Spec:
        kind = kind_of(node)
        numbers = () if kind in _SCRIPT_LEAVES else _numbers(node, kind)
        parameters = tuple(value for value in numbers if isinstance(value, int))
        return Spec(kind, [self._spec(child) for child in node.children], parameters, b"", _scripts(node, kind))

    def number(self, what: str, name: str, at: int) -> int:
        """The node with a name or a path, for an atom.

        What is written as attributes of a node is a node above it, Attributes. It has the statuses that the named node
        has for its parent; ticked and halted is the named node itself.

        Raises:
            ExpressionError: There is none, or more than one.
        """
        found = self._named(name, at)
        above = self.nodes[found - 1] if found > 0 else None
        has_attributes = above is not None and kind_of(above) == "Attributes" and above.place == self.nodes[found].place
        return found - 1 if has_attributes and what not in OF_THE_NODE_ITSELF else found

    def _named(self, name: str, at: int) -> int:
        found = self._by_name.get(name, [])
        named = [number for number in found if kind_of(self.nodes[number]) != "Attributes"] or found
        exact = [number for number in named if self.nodes[number].path.lstrip("/") == name.lstrip("/")] or named
        if not exact:
            raise ExpressionError(at, f"the tree has no node '{name}'", nearest(name, self._by_name))
        if len(exact) > 1:
            paths = ", ".join(f'"{self.nodes[number].path}"' for number in exact[:8])
            raise ExpressionError(at, f"the tree has {len(exact)} nodes '{name}'", f"give the path of one: {paths}")
        return exact[0]

    def assumed(self, ticked: set[int], period_ms: int | None) -> str:
        """Which of the ticked nodes answered freely in the circuit, but not in the tree; empty if none."""
        timed = self.timed if period_ms is None else []
        nodes = [self.nodes[number] for number in sorted(ticked)]
        paths = [node.path for node in nodes if node in self.free or node in timed]
        return ", ".join(paths[:4]) + (f" and {len(paths) - 4} more" if len(paths) > 4 else "")


def _asks(node: Node) -> bool:
    """Does its status depend on a script or an entry?"""
    kind = kind_of(node)
    if kind == "Attributes":
        return any(isinstance(script, Script) for script in node.parameters[:4])
    return kind in ("ScriptCondition", "Precondition", "Loop", *_SCRIPTED)
