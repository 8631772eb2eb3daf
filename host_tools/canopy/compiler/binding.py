# SPDX-License-Identifier: MIT
"""Ties the tree to the bus: every entry gets its type, every script its C, every port what it is connected to."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field, replace
from functools import cached_property

from canopy.compiler.blackboard import Entry, SignalName, Use
from canopy.compiler.bus_reader import Bus
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.leaf_c import writes_texts
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.port_types import ANY, BOOL, DOUBLE, INT32, INT64, TEXT, Options, PortType, literal
from canopy.compiler.script.compile import Compiler, Texts, UntypedError, guess
from canopy.compiler.script.storing import stripped
from canopy.compiler.script.syntax import Assignment, Expression, Name, Number, ScriptError, parse, parts
from canopy.compiler.script.values import Const, Double, Num, TextConst, Value
from canopy.compiler.script_bodies import Bodies, entry_value
from canopy.compiler.tree import Bound, Node, Script, Tree
from canopy.escape.c import mark_c


@dataclass(frozen=True)
class BoundPort:
    """A port of one node in C: its initialiser in the constant table, and what is copied before each call."""

    constant: str
    copy: str | None = None
    updates: str | None = None


def _bound_port(constant: str, copy: str | None = None, updates: str | None = None) -> BoundPort:
    """A BoundPort of C that was made here."""
    return BoundPort(*mark_c((constant, copy, updates)))


@dataclass
class Bindings:
    """What the tables and templates need besides the nodes: entries, texts, and each node's ports."""

    entries: tuple[Entry, ...] = ()
    texts: tuple[str, ...] = ()
    leaves: dict[str, Leaf] = field(default_factory=dict)
    ports: dict[int, tuple[BoundPort, ...]] = field(default_factory=dict)
    counted_ports: set[tuple[str, str]] = field(default_factory=set)

    @cached_property
    def text_places(self) -> dict[str, int]:
        """The place of each text."""
        return {text: place for place, text in enumerate(self.texts)}


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

    def bind(self) -> Bindings:
        """Everything, in the order in which each step needs the one before."""
        for script in self._tree.scripts:
            if script.role in ("condition", "action"):
                self._read(script)
        self._check_existing()
        for entry in self._tree.board.entries:
            entry.settle_type()
        for script in self._tree.scripts:
            if script.role == "set":
                self._setting.setdefault(id(script.target), []).append(script)
        self._infer()
        leaves = self._settle_ports()
        self._check_entries()
        bodies = Bodies(self._bus, self._texts, self._floats, {id(node): i for i, node in enumerate(self._nodes)})
        for script in self._tree.scripts:
            try:
                script.body = mark_c(bodies.body(script, self._parsed.get(id(script), ())))
            except ScriptError as error:
                raise script_error(script, error) from error
        for node in self._nodes:
            if node.leaf is not None and writes_texts(node.leaf):
                for text in node.leaf.texts:
                    self._texts.index(text)
        bindings = Bindings(leaves=leaves)
        for node in self._nodes:
            if node.leaf is not None and node.bound:
                bindings.ports[id(node)] = tuple(self._port(node, bound, bindings) for bound in node.bound)
        bindings.entries = tuple(e for e in self._tree.board.entries if not e.is_constant and e.uses)
        texts = self._texts.all
        bindings.texts = texts if len(texts) > 1 or self._uses_text() else ()
        return bindings

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
        for statement in self._parsed[id(script)]:
            if isinstance(statement, Assignment) and "." not in statement.target.name:
                place = script.place(statement.index)
                target = script.scope.resolve(statement.target.name, place)
                assert isinstance(target, Entry)
                target.connect(Use(ANY, place, f'{script.attribute}="{script.text}"', True))
                self._assigned.setdefault(id(target), []).append((script, statement))

    def _check_existing(self) -> None:
        for entry in self._tree.board.entries:
            mine = self._assigned.get(id(entry), [])
            creating = [a for _, a in mine if a.operator == ":="]
            others = sum(use.writes for use in entry.uses) - len(mine)
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
            kind, unknown = self._inferred(entry)
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

    def _check_entries(self) -> None:
        for entry in self._tree.board.entries:
            if not entry.uses or entry.is_constant:
                continue
            given = entry.initial is not None or entry.is_written
            if not given:
                use = entry.uses[0]
                scope = f" of '{entry.path}'" if entry.path else ""
                known = [e.name for e in self._tree.board.entries if e.path == entry.path and e is not entry]
                hint = f"entries here: {', '.join(known)}; " if known else ""
                raise CompileError(
                    use.place,
                    f"{use.what}: nothing writes entry '{entry.name}'{scope}",
                    f'{hint}the program\'s own inputs are ports of the main tree: <SubTree ID="{self._tree.id}">'
                    f'<input_port name="{entry.name}" type=… default=…/></SubTree> in <TreeNodesModel>',
                )
            if entry.type.kind == "any":
                use = entry.uses[0]
                raise CompileError(
                    use.place, f"nothing gives entry '{entry.name}' a type", "declare the type of a port"
                )

    # Ports

    def _settle_ports(self) -> dict[str, Leaf]:
        """The leaves in use, with types for ports that have none, and with the messages that their ports read."""
        leaves = dict(self._tree.leaves)
        for node in self._nodes:
            if node.leaf is None:
                continue
            leaf = leaves[node.leaf.id]
            for bound in node.bound:
                if isinstance(bound.target, SignalName):
                    message = bound.target.text.partition(".")[0]
                    if not bound.target.text.endswith(".fresh") and message not in leaf.reads:
                        leaf = replace(leaf, reads=(*leaf.reads, message))
            if node.bound:
                both = zip(leaf.ports, node.bound, strict=True)
                leaf = replace(leaf, ports=tuple(self._settled(port, bound) for port, bound in both))
            leaves[leaf.id] = leaf
        for node in self._nodes:
            if node.leaf is not None:
                node.leaf = leaves[node.leaf.id]
                for bound, port in zip(node.bound, node.leaf.ports, strict=True):
                    bound.port = port
        return leaves

    @staticmethod
    def _settled(port: Port, bound: Bound) -> Port:
        if port.type.kind != "any":
            return port
        if isinstance(bound.target, Entry):
            kind = bound.target.type
            if bound.target.is_constant:
                kind = _literal_kind(bound.target.initial or "")
            return replace(port, type=kind) if kind.kind != "any" else port
        return replace(port, type=_literal_kind(bound.text or "")) if bound.text is not None else port

    def _port(self, node: Node, bound: Bound, bindings: Bindings) -> BoundPort:
        assert node.leaf is not None
        port = bound.port
        where = f"port '{port.name}' of '{node.leaf.id}'"
        if port.type.kind == "any":
            raise CompileError(bound.place, f"{where}: nothing gives it a type", f"declare it, at {port.place}")
        if isinstance(bound.target, Entry):
            return self._connected(node.leaf, bound, bound.target, where, bindings)
        if isinstance(bound.target, SignalName):
            return self._signal(bound, bound.target, where)
        if bound.text is None:  # nothing is connected
            return _bound_port("NULL" if port.writes or port.type.kind == "user" else _zero(port.type))
        return _bound_port(_constant(bound.text, port.type, where, bound.place))

    def _signal(self, bound: Bound, target: SignalName, where: str) -> BoundPort:
        kind = bound.port.type
        compiler = Compiler(self._tree.board.main, bound.place, self._bus, self._texts, self._floats)
        try:
            value = compiler.signal(target.text, 0)
            if isinstance(value, Double) and kind.kind != "float":
                raise ScriptError(0, f"a floating-point signal would be cut to {kind}", "convert it in a script")
            c = compiler.storing.convert(value, kind, 0)
        except ScriptError as error:
            raise CompileError(bound.place, f"{where}: {error.message}", error.help_text) from error
        return _bound_port(_zero(kind), stripped(c))

    def _connected(self, leaf: Leaf, bound: Bound, entry: Entry, where: str, bindings: Bindings) -> BoundPort:
        port = bound.port
        if entry.is_constant:
            return _bound_port(_constant(entry.initial or "", port.type, where, entry.place))
        if entry.type != port.type:
            first = next((use for use in entry.uses if use.type == entry.type), entry.uses[0])
            raise CompileError(
                bound.place,
                f"{where} is {port.type}, but entry '{entry.name}' is {entry.type}",
                f"the other end is {first.what}, at {first.place}",
            )
        if port.writes:
            if entry.counted:
                bindings.counted_ports.add((leaf.id, port.name))
            updates = f"&memory.entries.{entry.c_name}_updates" if entry.counted else None
            return _bound_port(f"&memory.entries.{entry.c_name}", updates=updates)
        if port.type.kind == "user":
            return _bound_port(f"&memory.entries.{entry.c_name}")
        if port.type.kind == "text":
            place, texts = f"app->entries.{entry.c_name}", f"{self._name}_texts"
            # A leaf may have written any number.
            return _bound_port("NULL", f"{texts}[{place} < {texts.upper()} ? {place} : 0u]")
        return _bound_port(_zero(port.type), f"app->entries.{entry.c_name}")


def _literal_kind(text: str) -> PortType:
    value = guess(text)
    if isinstance(value, TextConst) or not isinstance(value, Const):
        return TEXT
    if value.is_bool:
        return BOOL
    if value.value.denominator != 1:
        return TEXT
    return INT32 if -(2**31) <= value.value < 2**31 else INT64


def _zero(kind: PortType) -> str:
    return {"bool": "false", "float": "0", "text": "NULL"}.get(kind.kind, "0")


def _constant(text: str, kind: PortType, where: str, place: Place) -> str:
    c = literal(text, kind, where, place)
    return f"&(const {kind.c}){{{c}}}" if kind.kind == "user" else c


def bind(tree: Tree, bus: Bus, options: Options, name: str) -> Bindings:
    """Types, compiles and connects, for the application `name`. Afterwards every script of the tree has its body.

    Raises:
        CompileError: a script, an entry or a port that cannot be compiled.
    """
    return _Binder(tree, bus, options, name).bind()
