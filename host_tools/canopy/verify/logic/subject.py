# SPDX-License-Identifier: MIT
"""A tree as `canopy compile` reads it, as one that has a circuit; and what the names in a formula stand for."""

from __future__ import annotations

from dataclasses import dataclass

from canopy.check.status_sets import LEAVES, NUMBERS
from canopy.compiler.blackboard import SignalName
from canopy.compiler.bus_model import Bus
from canopy.compiler.errors import CompileError, nearest
from canopy.compiler.port_types import Options
from canopy.compiler.script.compile import Compiler, Texts
from canopy.compiler.script.syntax import Name, ScriptError, parse, parts
from canopy.compiler.script_bodies import entry_value
from canopy.compiler.tree import Node, Script, Tree
from canopy.semantics.spec import ATTRIBUTES, TEST_SCRIPTS, Spec
from canopy.semantics.spec import Script as ModelScript
from canopy.verify.expression import ExpressionError
from canopy.verify.logic.board import FORMULA, Board, Fact, assignments, stands_for
from canopy.verify.logic.circuit import Circuit
from canopy.verify.logic.encode import CELLS
from canopy.verify.logic.scripts import Scripts
from canopy.verify.logic.words import NotModelledError

MAX_DEPTH = 200
"""Levels; the circuits are made recursively."""
MAX_COUNTED = 500
"""Children of a node that counts them; its circuit has some gates for each pair of them."""
ROOT = "root"
OF_THE_NODE_ITSELF = ("TICKED", "HALTED")
"""What a node's attributes do not take part in."""
_STATUS_OF = {name: number for number, name in NUMBERS.items()}
_SCRIPT_LEAVES = ("Script", "ScriptCondition", "SetBlackboard", "UnsetBlackboard")
_UPDATES = ("SkipUnlessUpdated", "WaitValueUpdate", "WasEntryUpdated")
_LEAVES = ("Condition", "SyncAction", "StatefulAction")
_TIMED = ("Sleep", "Delay", "Timeout", "TestNode")
_ASKED = ModelScript("free", 0)
OPAQUE = "StatefulAction"
"""The kind that a node without a circuit has: it may return anything, at any time, with all that is below it."""


@dataclass(frozen=True)
class Opaque:
    """A node that has no circuit, and why."""

    node: Node
    why: str

    def __str__(self) -> str:
        return f"{self.node.path} ({self.node.place}: {self.why})"


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
    written = [one.target for one in assignments(statements)]
    names = [part.name for part in read if not any(part is target for target in written)]
    targets = [stands_for(script.scope, name, script.place()) for name in names]
    return any(isinstance(target, SignalName) and not target.text.endswith(".fresh") for target in targets)


def _numbers(node: Node, kind: str) -> tuple[int | Script, ...]:
    """The parameters that are numbers in every tree; the others are scripts."""
    if kind in ("Precondition", "Loop"):
        return node.parameters[1:]
    if kind == "TestNode":
        return node.parameters[:2]
    return () if kind in ("Attributes", "Switch", *_UPDATES) else node.parameters


def _scripts(node: Node, kind: str) -> tuple[ModelScript | None, ...]:
    if kind in ("Attributes", "TestNode"):
        asked = node.parameters[-len(ATTRIBUTES if kind == "Attributes" else TEST_SCRIPTS) :]
        return tuple(_ASKED if isinstance(script, Script) else None for script in asked)
    return (_ASKED,) if kind in ("Script", "ScriptCondition", "Precondition", "Loop", "Switch", *_UPDATES) else ()


class LogicTree:
    """The tree, its names, and what its leaves may return. `facts`: what formulas have asked for besides nodes.

    Raises:
        CompileError: The tree cannot be compiled for the bus.
    """

    def __init__(self, tree: Tree, bus: Bus | None = None, options: Options | None = None) -> None:
        self.nodes: list[Node] = []
        self.opaque: dict[int, Opaque] = {}
        self.below: dict[str, Opaque] = {}
        self.facts: list[Fact] = []
        others = self._keep(tree.root)
        kept = {number: node for number, node in enumerate(self.nodes) if number not in self.opaque}
        self._options = options or Options()
        self.board = Board(tree, kept, others, bus, self._options)
        self.returns: dict[int, tuple[int, ...]] = {}
        self._by_name: dict[str, list[int]] = {}
        for number, node in enumerate(self.nodes):
            for name in {node.name, node.path, node.path.lstrip("/")}:
                self._by_name.setdefault(name, []).append(number)
            self.returns[number] = self._may_return(number, node)
        self._by_name.setdefault(ROOT, [0])
        self._subtrees = self._find_subtrees()

    def _find_subtrees(self) -> dict[str, list[int]]:
        """The roots of subtrees, by name and by path: with the attributes of the SubTree, where it has some."""
        found: dict[str, list[int]] = {}
        for number, node in enumerate(self.nodes):
            folder = node.path.lstrip("/").rpartition("/")[0]
            while folder and folder not in found:
                parent, _, name = folder.rpartition("/")
                above = self.nodes[number - 1] if number > 0 else node
                has_attributes = kind_of(above) == "Attributes" and above.path.lstrip("/").rpartition("/")[0] == parent
                root = number - 1 if has_attributes and node in above.children else number
                found[folder] = [root]
                if name != folder:
                    found.setdefault(name, []).append(root)
                folder = parent
        return found

    def _keep(self, root: Node) -> list[Node]:
        """Sorts the nodes: those with a circuit or in the place of one, in the order of the file; gives all others."""
        others = []
        waiting: list[tuple[Node, int, Opaque | None]] = [(root, 1, None)]
        while waiting:
            node, level, below = waiting.pop()
            if below is not None:
                self.below.setdefault(node.name, below)
                self.below.setdefault(node.path.lstrip("/"), below)
                others.append(node)
            else:
                why = _problem(node, level)
                if why:
                    below = self.opaque[len(self.nodes)] = Opaque(node, why)
                    others.append(node)
                self.nodes.append(node)
            waiting += [(child, level + 1, below) for child in reversed(node.children)]
        return others

    def _may_return(self, number: int, node: Node) -> tuple[int, ...]:
        """What a leaf may return when it is called; nothing for other nodes."""
        if number in self.opaque:
            return tuple(sorted(NUMBERS))
        if node.leaf is None or node.type.name not in _LEAVES:
            return ()
        return tuple(sorted(_STATUS_OF[status] for status in node.leaf.returns or LEAVES[node.type.name]))

    def spec(self) -> Spec:
        """The tree of canopy.semantics."""
        numbers = {id(node): number for number, node in enumerate(self.nodes)}
        return self._spec(self.nodes[0], numbers)

    def _spec(self, node: Node, numbers: dict[int, int]) -> Spec:
        if numbers[id(node)] in self.opaque:
            return Spec(OPAQUE, [])
        kind = kind_of(node)
        parameters = tuple(value for value in _numbers(node, kind) if isinstance(value, int))
        return Spec(
            kind, [self._spec(child, numbers) for child in node.children], parameters, b"", _scripts(node, kind)
        )

    # What names in a formula stand for

    def number(self, what: str, name: str, at: int) -> int:
        """The node with a name or a path, for an atom.

        What is written as attributes of a node is a node above it, Attributes. It has the statuses that the named node
        has for its parent; ticked and halted is the named node itself.

        Raises:
            ExpressionError: There is none, or more than one.
        """
        found = self._named(name, at)
        if not self._by_name.get(name):  # a subtree
            while what in OF_THE_NODE_ITSELF and kind_of(self.nodes[found]) == "Attributes":
                found += 1
            return found
        above = self.nodes[found - 1] if found > 0 else None
        has_attributes = above is not None and kind_of(above) == "Attributes" and above.place == self.nodes[found].place
        return found - 1 if has_attributes and what not in OF_THE_NODE_ITSELF else found

    def _named(self, name: str, at: int) -> int:
        found = self._by_name.get(name) or self._subtrees.get(name.lstrip("/"), [])
        named = [number for number in found if kind_of(self.nodes[number]) != "Attributes"] or found
        exact = [number for number in named if self.nodes[number].path.lstrip("/") == name.lstrip("/")] or named
        below = self.below.get(name.lstrip("/"))
        if not exact and below is not None:
            raise ExpressionError(at, f"nothing is known of '{name}': it lies below {below}")
        if not exact:
            known = {**self._by_name, **self._subtrees}
            raise ExpressionError(at, f"the tree has no node '{name}'", nearest(name, known))
        if len(exact) > 1:
            paths = ", ".join(f'"{self.nodes[number].path}"' for number in exact[:8])
            raise ExpressionError(at, f"the tree has {len(exact)} nodes '{name}'", f"give the path of one: {paths}")
        return exact[0]

    def _fact(self, fact: Fact) -> int:
        if fact not in self.facts:
            self.facts.append(fact)
        return self.facts.index(fact)

    def fresh(self, message: str, at: int) -> int:
        """The fact that a message is fresh.

        Raises:
            ExpressionError: Nothing reads that message.
        """
        read = {name for reads in self.board.reads.values() for name in reads.messages}
        known = sorted(read | {one.name for one in self.board.bus.receive})
        if message not in known:
            raise ExpressionError(at, f"no leaf reads a message '{message}'", nearest(message, known))
        return self._fact(Fact(None, message))

    def condition(self, text: str, at: int) -> int:
        """The fact that a condition in the language of scripts holds.

        Raises:
            ExpressionError: It is not one, or it cannot be followed.
        """
        if not self.board.is_known:
            message = "the tree names signals: without the bus nothing is known of signals and entries"
            raise ExpressionError(at, message, "give --dbc and --node")
        try:
            statements = parse(text)
            if len(statements) != 1 or assignments(statements):
                raise ScriptError(0, "one condition is expected in braces", "for example {count > 3 && Battery.fresh}")
            compiler = Compiler(self.board.main, FORMULA, self.board.bus, Texts(), self._options.floats)
            compiler.truth(statements[0])
            for name in (part for part in parts(statements[0]) if isinstance(part, Name)):
                self._check_followed(name)
            fact = Fact(statements[0])
            Scripts(Circuit(), self.board).fact(fact)
        except ScriptError as error:
            raise ExpressionError(at + error.index, error.message, error.help_text) from None
        except NotModelledError as error:
            raise ExpressionError(at, f"the condition cannot be followed: {error}") from None
        return self._fact(fact)

    def _check_followed(self, name: Name) -> None:
        place = self.board.place(stands_for(self.board.main, name.name, FORMULA))
        if place is not None and place in self.board.open:
            message = f"entry '{name.name}' cannot be followed: it is written in a halt, by a queue, or by a node "
            raise ScriptError(name.index, f"{message}that is not modelled")

    def assumed(self, answered: set[int], ticked: set[int], period_ms: int | None) -> str:
        """Why a trace may not happen in the tree: what answered freely. Empty if it happens.

        `answered`: the ticked nodes whose scripts did.
        """
        opaque = [str(self.opaque[number]) for number in sorted(ticked) if number in self.opaque]
        timed = {number for number in ticked if period_ms is None and kind_of(self.nodes[number]) in _TIMED}
        paths = opaque + [self.nodes[number].path for number in sorted((answered | timed) - set(self.opaque))]
        if not paths:
            return ""
        shown = ", ".join(paths[:4]) + (f" and {len(paths) - 4} more" if len(paths) > 4 else "")
        help_text = "; --period makes timers exact" if timed else ""
        if answered and not self.board.is_known:
            help_text += "; --dbc and --node make scripts exact"
        return f"the trace takes any answer for possible that the tree may not give: {shown}{help_text}"
