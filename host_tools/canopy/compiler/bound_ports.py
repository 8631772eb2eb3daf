# SPDX-License-Identifier: MIT
"""What each port of each node is in C: its initialiser in the constant tables, and what is copied before each call."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

from canopy.compiler.blackboard import Entry, SignalName
from canopy.compiler.bus_reader import Bus
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.port_types import PortType, literal
from canopy.compiler.script.compile import Compiler, Texts
from canopy.compiler.script.storing import stripped
from canopy.compiler.script.syntax import ScriptError
from canopy.compiler.script.values import Double
from canopy.compiler.tree import Bound, Node, Tree
from canopy.escape.c import mark_c
from canopy.tree.generic import VALUE, generic_type, value_of
from canopy.tree.lists import queue_literal


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


class Ports:
    """Ties the ports of a tree's nodes. `name`: the application's."""

    def __init__(self, tree: Tree, nodes: list[Node], bus: Bus, texts: Texts, floats: bool, name: str) -> None:
        self._tree = tree
        self._nodes = nodes
        self._bus = bus
        self._texts = texts
        self._floats = floats
        self._name = name

    def settle(self) -> dict[str, Leaf]:
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
            leaves[leaf.id] = leaf
        self._settle_generic(leaves)
        for node in self._nodes:
            if node.leaf is not None:
                node.leaf = leaves[node.leaf.id]
                for bound, port in zip(node.bound, node.leaf.ports, strict=True):
                    bound.port = port
        return leaves

    def _settle_generic(self, leaves: dict[str, Leaf]) -> None:
        """Gives ports without a type the one that all their uses have."""
        uses: dict[tuple[str, int], list[Bound]] = {}
        for node in self._nodes:
            if node.leaf is not None:
                for place, bound in enumerate(node.bound):
                    if bound.port.type.kind == "any":
                        uses.setdefault((node.leaf.id, place), []).append(bound)
        for (leaf_id, place), bounds in uses.items():
            ports = list(leaves[leaf_id].ports)
            ports[place] = replace(ports[place], type=generic_type(bounds, self._floats))
            leaves[leaf_id] = replace(leaves[leaf_id], ports=tuple(ports))

    def bound(self, node: Node, bound: Bound, bindings: Bindings) -> BoundPort:
        """One port of one node.

        Raises:
            CompileError: what it is given does not fit its type.
        """
        assert node.leaf is not None
        port = bound.port
        where = f"port '{port.name}' of '{node.leaf.id}'"
        if isinstance(bound.target, Entry):
            return self._connected(node.leaf, bound, bound.target, where, bindings)
        if isinstance(bound.target, SignalName):
            return self._signal(bound, bound.target, where)
        if bound.text is None:  # nothing is connected
            return _bound_port("NULL" if port.writes or port.type.kind == "user" else _zero(port.type))
        return _bound_port(self._constant(bound.text, port.type, where, bound.place))

    def _constant(self, text: str, kind: PortType, where: str, place: Place) -> str:
        if kind == VALUE:
            return f"{{{value_of(text, self._floats)}}}"
        if kind.item:
            return f"&(const {kind.c}){{{queue_literal(text, kind, where, place, self._texts)}}}"
        c = literal(text, kind, where, place)
        return f"&(const {kind.c}){{{c}}}" if kind.kind == "user" else c

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
            return _bound_port(self._constant(entry.initial or "", port.type, where, entry.place))
        if port.type == VALUE:
            return _bound_port(_zero(port.type), f"({port.type.c}){{{self._value(entry, where, bound.place)}}}")
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
            return _bound_port("NULL", self._text_of(entry))
        return _bound_port(_zero(port.type), f"app->entries.{entry.c_name}")

    def _text_of(self, entry: Entry) -> str:
        """The text that an entry holds; a leaf may have written any number."""
        place, texts = f"app->entries.{entry.c_name}", f"{self._name}_texts"
        return f"{texts}[{place} < {texts.upper()} ? {place} : 0u]"

    def _value(self, entry: Entry, where: str, place: Place) -> str:
        """The members of a value that an entry gives."""
        if entry.type.kind == "text":
            return f".kind = CANOPY_VALUE_TEXT, .text = {self._text_of(entry)}"
        member = f"app->entries.{entry.c_name}"
        if entry.type.kind == "float":
            return f".kind = CANOPY_VALUE_REAL, .real = {member}"
        if entry.type.kind not in ("int", "bool", "duration") or entry.type.high >= 2**63:
            raise CompileError(
                place, f"{where} has no type, and the entry is {entry.type}", "declare a type: its uses have several"
            )
        return f".kind = CANOPY_VALUE_NUMBER, .number = {member}"


def _zero(kind: PortType) -> str:
    return {"bool": "false", "float": "0", "text": "NULL", "value": "{.kind = CANOPY_VALUE_NONE}"}.get(kind.kind, "0")
