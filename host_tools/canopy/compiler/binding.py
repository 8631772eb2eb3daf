# SPDX-License-Identifier: MIT
"""Ties the tree to the bus: every entry gets its type, every script its C, every port what it is connected to."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable
from typing import TypeVar

from canopy.compiler.blackboard import Entry, SignalName, Use
from canopy.compiler.bound_ports import Bindings, BoundPort, Ports
from canopy.compiler.bus_reader import Bus
from canopy.compiler.errors import MOST_NAMES, CompileError, Errors, Place
from canopy.compiler.leaf_c import writes_texts
from canopy.compiler.port_types import ANY, BOOL, DOUBLE, INT32, INT64, TEXT, Options, PortType
from canopy.compiler.script.compile import Compiler, Texts, UntypedError, guess
from canopy.compiler.script.syntax import Assignment, Expression, Name, Number, ScriptError, parse, parts
from canopy.compiler.script.values import Const, Double, Num, Value
from canopy.compiler.script_bodies import Bodies, entry_value
from canopy.compiler.tree import Node, Script, Tree
from canopy.escape.c import mark_c
from canopy.tree.lists import items_of

_Item = TypeVar("_Item")


def preorder(root: Node) -> list[Node]:
    """All nodes, depth first, without recursion."""
    nodes: list[Node] = []
    waiting = [root]
    while waiting:
        node = waiting.pop()
        nodes.append(node)
        waiting.extend(reversed(node.children))
    return nodes


def script_error(script: Script, error: ScriptError) -> CompileError:
    """The error with its place in the file, and the node that has the script."""
    name = script.element.attributes.get("name")
    node = f"<{script.element.tag}{f' name={name!r}' if name else ''}>"
    return CompileError(script.place(error.index), f"{script.attribute} of {node}: {error.message}", error.help_text)


class _Binder:
    def __init__(self, tree: Tree, bus: Bus, options: Options, name: str) -> None:
        self._tree = tree
        self._name = name
        self._bus = bus
        self._floats = options.floats
        self._texts = Texts()
        self._nodes = preorder(tree.root)
        self._parsed: dict[int, tuple[Expression, ...]] = {}
        self._assigned: dict[int, list[tuple[Script, Assignment]]] = {}
        self._setting: dict[int, list[Script]] = {}
        self._errors = Errors()
        self._failed: set[int] = set()

    def bind(self) -> Bindings:
        """Everything, in the order in which each step needs the one before; all errors of a step together."""
        scripts = self._tree.scripts
        self._each((script for script in scripts if script.role in ("condition", "action")), self._read)
        self._each(self._tree.board.entries, self._check_existing)
        self._each(self._tree.board.entries, Entry.settle_type)
        self._errors.raise_any()
        for script in scripts:
            if script.role == "set":
                self._setting.setdefault(id(script.target), []).append(script)
        self._infer()
        ports = Ports(self._tree, self._nodes, self._bus, self._texts, self._floats, self._name)
        bindings = Bindings(leaves=ports.settle())
        self._each(self._tree.board.entries, self._check_entry)
        self._errors.raise_any()
        bodies = Bodies(self._bus, self._texts, self._floats, {id(node): i for i, node in enumerate(self._nodes)})
        self._each(scripts, lambda script: self._write(script, bodies))
        self._texts_of_leaves()
        bodies.all_texts_are_known = True
        self._each(
            (script for script in scripts if script.role == "switch"), lambda script: self._write(script, bodies)
        )
        for node in self._nodes:
            if node.leaf is not None and node.bound:
                bindings.ports[id(node)] = self._ports(ports, node, bindings)
        self._errors.raise_any()
        bindings.entries = tuple(e for e in self._tree.board.entries if not e.is_constant and e.uses)
        texts = self._texts.all
        bindings.texts = texts if len(texts) > 1 or self._uses_text() else ()
        return bindings

    def _each(self, items: Iterable[_Item], step: Callable[[_Item], None]) -> None:
        """Does it with every item, and collects what is wrong."""
        for item in items:
            try:
                step(item)
            except CompileError as error:
                self._errors.add(error)

    def _ports(self, ports: Ports, node: Node, bindings: Bindings) -> tuple[BoundPort, ...]:
        found: list[BoundPort] = []
        self._each(node.bound, lambda bound: found.append(ports.bound(node, bound, bindings)))
        return tuple(found)

    def _write(self, script: Script, bodies: Bodies) -> None:
        try:
            script.body = mark_c(bodies.body(script, self._parsed.get(id(script), ())))
        except ScriptError as error:
            raise script_error(script, error) from error

    def _texts_of_leaves(self) -> None:
        """Texts that no script has: those that leaves write, and those that entries begin with."""
        for node in self._nodes:
            if node.leaf is not None and writes_texts(node.leaf):
                for text in node.leaf.texts:
                    self._texts.index(text)
        for entry in self._tree.board.entries:
            if entry.initial is not None and entry.type.holds_texts and not entry.is_constant:
                for text in [entry.initial] if entry.type == TEXT else items_of(entry.initial):
                    self._texts.index(text)

    def _uses_text(self) -> bool:
        return any(entry.type == TEXT and not entry.is_constant for entry in self._tree.board.entries)

    def _compiler(self, script: Script) -> Compiler:
        return Compiler(script.scope, script.place(), self._bus, self._texts, self._floats)

    # Entries

    def _read(self, script: Script) -> None:
        try:
            self._parsed[id(script)] = parse(script.text)
        except ScriptError as error:
            raise script_error(script, error) from error
        for statement in (part for whole in self._parsed[id(script)] for part in parts(whole)):
            if isinstance(statement, Assignment) and "." not in statement.target.name:
                place = script.place(statement.index)
                target = script.scope.resolve(statement.target.name, place)
                assert isinstance(target, Entry)
                target.connect(Use(ANY, place, f'{script.attribute}="{script.text}"', True))
                self._assigned.setdefault(id(target), []).append((script, statement))

    def _check_existing(self, entry: Entry) -> None:
        mine = self._assigned.get(id(entry), [])
        creating = [a for _, a in mine if a.operator == ":="]
        others = len(entry.uses) - len(mine)  # a port that is connected to it is enough, as in BehaviorTree.CPP
        if mine and not creating and not others and entry.initial is None:
            script, statement = mine[0]
            message = f"'{statement.operator}' needs an entry that is there, and nothing creates '{entry.name}'"
            raise script_error(
                script, ScriptError(statement.index, message, f"write {entry.name} := … where it begins")
            )

    def _infer(self) -> None:
        """Types of entries that no port declares: from what is written to them, until nothing more is learnt.

        Entries are asked in their order, turn after turn; one that waits for others only when one of these is known.
        """
        entries = self._tree.board.entries
        due = [(0, index) for index in range(len(entries))]
        waiting: dict[int, list[int]] = {}
        known = len(entries)
        while due:
            turn, index = heapq.heappop(due)
            entry = entries[index]
            if entry.type.kind != "any":
                continue
            try:
                kind, unknown = self._inferred(entry)
            except CompileError as error:
                self._errors.add(error)
                self._failed.add(id(entry))
                continue
            for new in range(known, len(entries)):
                heapq.heappush(due, (turn, new))
            known = len(entries)
            if kind is None:
                for other in unknown:
                    waiting.setdefault(id(other), []).append(index)
                continue
            entry.type = kind
            for other_index in waiting.pop(id(entry), []):
                heapq.heappush(due, (turn + (other_index < index), other_index))

    def _inferred(self, entry: Entry) -> tuple[PortType | None, list[Entry]]:
        """The type, or None and the entries whose types would tell it."""
        kinds: list[tuple[PortType, Place]] = []
        unknown: list[Entry] = []
        if entry.initial is not None and not entry.is_constant:
            kinds.append((self._kind_of(guess(entry.initial), [], entry.place, entry), entry.place))
        for script, statement in self._assigned.get(id(entry), []):
            compiler = self._compiler(script)
            try:
                value = compiler.evaluate(statement.value)
            except UntypedError as error:
                unknown.append(error.entry)
                continue
            except ScriptError as error:
                raise script_error(script, error) from error
            names = parts(statement.value)
            place = script.place(statement.index)
            kinds.append((self._kind_of(value, self._widths(compiler, names), place, entry), place))
        for script in self._setting.get(id(entry), []):
            found = self._set_kind(script, entry)
            if isinstance(found, Entry):
                unknown.append(found)
            else:
                kinds.append((found, script.place()))
        return self._joined(entry, kinds), unknown

    def _set_kind(self, script: Script, entry: Entry) -> PortType | Entry:
        """The type that a script sets; an entry: the type of this one, once that is known."""
        source = entry_value(script)
        if isinstance(source, Entry) and not source.is_constant:
            return source.type if source.type.kind != "any" else source
        value: Value
        if isinstance(source, SignalName):
            value = self._compiler(script).signal(source.text, 0)
            return self._kind_of(value, [isinstance(value, Num) and value.wide], script.place(), entry)
        value = guess(source.initial or "" if isinstance(source, Entry) else source)
        return self._kind_of(value, [], script.place(), entry)

    @staticmethod
    def _widths(compiler: Compiler, expressions: list[Expression]) -> list[bool]:
        """Which constants and names of an expression need 64 bits."""
        wide = []
        for part in expressions:
            if isinstance(part, Number):
                wide.append(abs(part.value) >= 2**31)
            elif isinstance(part, Name) and ("." in part.name or compiler.scope.knows(part.name)):
                try:
                    value = compiler.named(part.name, part.index)
                except (UntypedError, ScriptError):
                    continue
                wide.append(isinstance(value, Num) and value.wide)
        return wide

    def _kind_of(self, value: Value, widths: list[bool], place: Place, entry: Entry) -> PortType:
        if isinstance(value, Double):
            return DOUBLE
        if isinstance(value, (Const, Num)):
            if value.is_bool:
                return BOOL
            step = value.value if isinstance(value, Const) else value.scale
            if step.denominator == 1:
                large = isinstance(value, Const) and not -(2**31) <= value.value < 2**31
                return INT64 if large or any(widths) else INT32
            if self._floats:
                return DOUBLE
            raise CompileError(
                place,
                f"entry '{entry.name}' would hold fractions, and no port says its type",
                f'declare it in fixed point, as a port of its tree: <inout_port name="{entry.name}" '
                'type="int32_t*0.01"/>; or count in a smaller unit; or compile with --allow-floating-point',
            )
        return TEXT

    def _joined(self, entry: Entry, kinds: list[tuple[PortType, Place]]) -> PortType | None:
        if not kinds:
            return None
        rank = {BOOL: 0, INT32: 1, INT64: 2, DOUBLE: 3}
        best, place = kinds[0]
        for kind, other in kinds[1:]:
            if kind == best:
                continue
            if kind not in rank or best not in rank:
                raise CompileError(
                    other, f"entry '{entry.name}' is written as {kind} here, and as {best} elsewhere", f"there: {place}"
                )
            if rank[kind] > rank[best]:
                best = kind
        return best

    def _check_entry(self, entry: Entry) -> None:
        if not entry.uses or entry.is_constant or id(entry) in self._failed:
            return
        use = entry.uses[0]
        message = entry.name.partition(".")[0]
        if "." in entry.name and any(message == other.name for other in (*self._bus.receive, *self._bus.send)):
            raise CompileError(
                use.place,
                f"'{entry.name}' is written by a node, and '{message}' is a message of the bus",
                "give the entry another name",
            )
        if entry.initial is None and not entry.is_written:
            scope = f" of '{entry.path}'" if entry.path else ""
            known = [e.name for e in self._tree.board.entries if e.path == entry.path and e is not entry]
            hint = f"entries here: {', '.join(known[:MOST_NAMES])}; " if known else ""
            raise CompileError(
                use.place,
                f"{use.what}: nothing writes entry '{entry.name}'{scope}",
                f'{hint}the program\'s own inputs are ports of the main tree: <SubTree ID="{self._tree.id}">'
                f'<input_port name="{entry.name}" type=… default=…/></SubTree> in <TreeNodesModel>; '
                f"canopy model {self._tree.path} writes it",
            )
        if entry.type.kind == "any":
            raise CompileError(use.place, f"nothing gives entry '{entry.name}' a type", "declare the type of a port")


def bind(tree: Tree, bus: Bus, options: Options, name: str) -> Bindings:
    """Types, compiles and connects, for the application `name`. Afterwards every script of the tree has its body.

    Raises:
        CompileError: a script, an entry or a port that cannot be compiled.
    """
    return _Binder(tree, bus, options, name).bind()
