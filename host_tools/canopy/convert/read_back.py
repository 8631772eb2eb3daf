# SPDX-License-Identifier: MIT
"""A tree as `canopy compile` reads it, as one that the reference model runs: what was written is what is checked."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from fractions import Fraction
from pathlib import Path

from canopy.check.status_sets import NUMBERS, leaf_statuses
from canopy.compiler.bus_model import Bus
from canopy.compiler.emit import load_application
from canopy.compiler.errors import CompileError
from canopy.compiler.port_types import Options
from canopy.compiler.tree import Node, Script, Tree
from canopy.compiler.tree_reader import read_tree
from canopy.convert.machine import Program, RunnableTree, SignalInput, Use
from canopy.convert.scripts import entry_names, program
from canopy.semantics import NODES
from canopy.semantics.spec import FAILURE, RUNNING, SUCCESS, Spec
from canopy.semantics.spec import Script as ModelScript

# What depends on the time, on an entry's updates, or on C of the user's: it cannot be tried from the outside.
_WITHOUT = ("Sleep", "Delay", "Timeout", "Loop", "Switch", "SkipUnlessUpdated", "WaitValueUpdate", "WasEntryUpdated")
MAX_DEPTH = 200
"""Levels; the reference model is recursive."""
_SCRIPT_LEAVES = ("Script", "ScriptCondition", "SetBlackboard", "UnsetBlackboard")
STATUS_OF = {name: number for number, name in NUMBERS.items()}


def read_result(path: Path, bus: Path | None = None, node: str = "") -> Tree:
    """Reads a tree file as the compiler does; with a DBC, everything that `canopy compile` checks is checked.

    Raises:
        CompileError: the compiler would refuse it.
    """
    if bus is None:
        return read_tree(path, Options())
    return load_application("converted", path, bus, node, 1, 500_000, None, options=Options()).table.tree


def leaf_key(node: Node) -> Hashable:
    """What two uses of one leaf have in common when they must give the same answer: its ID, and its ports."""
    ports = tuple((bound.port.name, bound.text or repr(bound.target)) for bound in node.bound)
    return (node.leaf.id if node.leaf is not None else node.xml_name, ports)


def statuses_of(kind: str) -> tuple[int, ...]:
    """What a leaf of a kind can return, but for SKIPPED."""
    return (RUNNING, SUCCESS, FAILURE) if kind == "StatefulAction" else (SUCCESS, FAILURE)


def name_of(node: Node) -> str:
    """A leaf's ID, with its ports if it has some."""
    name = node.leaf.id if node.leaf is not None else node.xml_name
    ports = ", ".join(f"{bound.port.name}={bound.text}" for bound in node.bound if bound.text is not None)
    return f"{name}({ports})" if ports else name


class _Reader:
    def __init__(self, tree: Tree, signals: Mapping[str, SignalInput], per_use: bool, declared: bool) -> None:
        self._tree = tree
        self._declared = declared
        self._per_use = per_use
        self._names = entry_names(list(tree.scripts))
        self._index = {name: number for number, name in enumerate(self._names)}
        self.programs: list[Program] = []
        self.uses: dict[int, Use] = {}
        self._count = 0
        self.runnable = RunnableTree(self.spec(tree.root, 1), self.uses, self.programs, self._names, dict(signals))

    def spec(self, node: Node, depth: int) -> Spec:
        """The node, at level `depth`, and what is below it."""
        if depth > MAX_DEPTH:
            raise CompileError(node.place, f"a tree of more than {MAX_DEPTH} levels cannot be checked for equivalence")
        number = self._count
        self._count += 1
        kind = node.xml_name if node.xml_name in _SCRIPT_LEAVES else node.type.name
        if kind in _WITHOUT or kind not in NODES or kind in ("SetBlackboard", "UnsetBlackboard"):
            raise CompileError(
                node.place,
                f"<{node.xml_name or kind}> cannot be checked for equivalence",
                "it depends on the time, on when entries are written, or on your code",
            )
        if node.leaf is not None:
            statuses = tuple(sorted(STATUS_OF[status] for status in leaf_statuses(node)))
            if not self._declared:
                statuses = statuses_of(node.type.name)
            pure = node.leaf.kind == "Condition" and node.leaf.state is None and not any(b.target for b in node.bound)
            key = (leaf_key(node), number) if self._per_use and not pure else leaf_key(node)
            self.uses[number] = Use(name_of(node), key, statuses, pure)
        scripts: tuple[ModelScript | None, ...] = ()
        parameters: tuple[int, ...] = ()
        if node.script is not None:
            scripts = (self._script(node.script),)
        elif kind == "Precondition":
            scripts, parameters = (self._script(node.parameters[0]),), (self._number(node, node.parameters[1]),)
        elif kind == "Attributes":
            scripts = tuple(self._script(script) for script in node.parameters)
        else:
            parameters = tuple(self._number(node, value) for value in node.parameters)
        return Spec(kind, [self.spec(child, depth + 1) for child in node.children], parameters, b"", scripts)

    @staticmethod
    def _number(node: Node, value: int | Script) -> int:
        if isinstance(value, Script):
            raise CompileError(node.place, f"{value.attribute}='{value.text}' cannot be checked for equivalence")
        return value

    def _script(self, script: int | Script) -> ModelScript | None:
        if not isinstance(script, Script):
            return None
        if script.scope is not self._tree.board.main:
            raise CompileError(script.place(), "a script of a <SubTree> cannot be checked for equivalence")
        self.programs.append(program(script, self._index))
        return ModelScript("program", len(self.programs) - 1)


def runnable(
    tree: Tree, signals: Mapping[str, SignalInput] | None = None, *, per_use: bool = True, declared: bool = True
) -> RunnableTree:
    """The tree for the reference model. `signals`: what scripts read of the bus, and which raw values are tried.

    `per_use`: each use of an action answers for itself; else all uses of one leaf give the same answer in a tick.
    `declared`: leaves keep to their `returns`; else each returns what its kind can, but for SKIPPED.

    Raises:
        CompileError: a node or script cannot be run there.
    """
    return _Reader(tree, signals or {}, per_use, declared).runnable


def signal_inputs(bus: Bus, wanted: Mapping[str, tuple[int, ...]]) -> dict[str, SignalInput]:
    """The inputs of `wanted`, which gives the raw values to try for each Message.Signal."""
    found = {}
    for message in bus.receive:
        for signal in message.signals:
            name = f"{message.name}.{signal.name}"
            if name in wanted:
                found[name] = SignalInput(Fraction(signal.scale), Fraction(signal.offset), wanted[name])
    return found
