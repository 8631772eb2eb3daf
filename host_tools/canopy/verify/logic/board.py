# SPDX-License-Identifier: MIT
"""The entries, signals, texts and scripts of a tree: what a circuit can follow, and what it has to leave open.

An entry is open when something writes it in the midst of a tick, where the circuit does not know it: a handler of a
halt, a node that is not modelled, a queue. What reads an open entry may read anything.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import cast

from canopy.compiler.binding import bind
from canopy.compiler.blackboard import Entry, Scope, SignalName, Target, pointer
from canopy.compiler.bus_model import Bus, Message, Ranges, Signal, merge
from canopy.compiler.dbc_file import Dbc
from canopy.compiler.errors import Place
from canopy.compiler.numbers import plain
from canopy.compiler.port_types import Options
from canopy.compiler.script.compile import guess
from canopy.compiler.script.syntax import Assignment, Expression, Name, parse, parts
from canopy.compiler.script.values import INT64, Const
from canopy.compiler.tree import Node, Script, Tree
from canopy.semantics.spec import ATTRIBUTES, STATUS_NAMES, TEST_SCRIPTS

NAME = "logic"
FORMULA = Place("formula")
NO_BUS = Bus(Path(), NAME, "", receive=(), send=(), source=cast(Dbc, None))
TEXT_LOW, TEXT_HIGH = 0, 0xFFFF
NEW = (":=", "=")
MODELLED = ("bool", "int", "fixed", "duration", "text")


@dataclass(frozen=True)
class Received:
    """A signal of the input image. `values`: the raw values that are taken from the bus."""

    message: Message
    signal: Signal

    @property
    def values(self) -> Ranges:
        """Raw values that it may have while its message is fresh."""
        return self.signal.accepted

    @property
    def ever(self) -> Ranges:
        """Raw values that it may have at any time: the image begins with 0."""
        return merge([*self.signal.accepted, (0, 0)])


@dataclass(frozen=True)
class Reads:
    """What a leaf must know to be called, fresh messages and multiplexed signals that have come; else it is `stale`."""

    messages: set[str]
    signals: set[str]
    stale: int


@dataclass(frozen=True)
class Fact:
    """What a formula says of a tick besides its nodes: a condition in the language of scripts, or a fresh message."""

    condition: Expression | None
    message: str = ""


def scripts_of(node: Node) -> Iterator[tuple[str, Script]]:
    """A node's scripts, by what is asked of it in the circuit."""
    if node.script is not None:
        yield "is true", node.script
    names: Iterable[str] = ("is true",)
    if node.type.name == "Attributes":
        names = ATTRIBUTES
    elif node.type.name == "TestNode":
        names = ("return_status", "async_delay", *TEST_SCRIPTS)
    for name, parameter in zip(names, node.parameters, strict=False):
        if isinstance(parameter, Script) and parameter.role != "parameter":
            yield name, parameter


def stands_for(scope: Scope, name: str, place: Place) -> Target | None:
    """What a name stands for; None for what is no entry and no signal: the name of a signal's value.

    Scope.resolve() would make a new entry of it.
    """
    if name in scope.board.enums:
        return None
    known = "." in name or (scope.root if name.startswith("@") else scope).knows(name.removeprefix("@"))
    return scope.resolve(name, place) if known else None


def assignments(statements: Iterable[Expression]) -> list[Assignment]:
    """All assignments in some statements, also those inside expressions."""
    return [part for one in statements for part in parts(one) if isinstance(part, Assignment)]


def speaks_of_signals(tree: Tree, nodes: Iterable[Node]) -> bool:
    """Does a script or a port name a signal of the bus?"""
    ports = (bound.target for node in nodes for bound in node.bound)
    return any(isinstance(target, SignalName) for target in ports) or any(
        isinstance(stands_for(script.scope, name, script.place()), SignalName)
        for script in tree.scripts
        for name in _names(script)
    )


def _names(script: Script) -> list[str]:
    """The names that a script uses."""
    if script.role in ("condition", "action"):
        found = (part for statement in parse(script.text) for part in parts(statement))
        return [part.name for part in found if isinstance(part, Name)]
    texts = {script.attribute: script.text}
    if script.role == "switch":
        texts |= {name: text for name, text in script.element.attributes.items() if name.startswith("case_")}
    named = (pointer(text, "value" if script.role == "set" else name) for name, text in texts.items())
    return [name for name in named if name is not None and script.role != "unset"]


class Board:
    """`kept`: the nodes that have a circuit, by number; the others may do anything to what they write.

    Raises:
        CompileError: The tree and the bus do not go together.
    """

    def __init__(
        self, tree: Tree, kept: Mapping[int, Node], others: list[Node], bus: Bus | None, options: Options
    ) -> None:
        self.bus = bus or NO_BUS
        self.options = options
        self.main = tree.board.main
        self.is_known = bus is not None or not speaks_of_signals(tree, [*kept.values(), *others])
        """False: signals are named, and there is no bus. Then nothing is known of entries."""
        self.texts: dict[str, int] = {"": 0}
        self.scripts: dict[tuple[int, str], Script] = {}
        self.statements: dict[int, tuple[Expression, ...]] = {}
        self.entries: list[Entry] = []
        self._places: dict[int, int] = {}
        self.open: set[int] = set()
        self.may_write: dict[int, list[tuple[int, Ranges]]] = {}
        """What a leaf may write when it is called: the entry's place, and values in steps."""
        self.reads: dict[int, Reads] = {}
        if not self.is_known:
            self._find_reads(kept)
            return
        bind(tree, self.bus, options, NAME)
        for entry in tree.board.entries:
            if entry.uses and not entry.is_constant and _is_modelled(entry):
                self._places[id(entry)] = len(self.entries)
                self.entries.append(entry)
        self._find_reads(kept)
        self._find_open(kept.values(), others)
        for number, node in kept.items():
            for what, script in scripts_of(node):
                self.scripts[number, what] = script
            places = [place for place in self.written(node) if place not in self.open]
            self.may_write[number] = [(place, self._choices(node, place)) for place in places]

    def _find_reads(self, kept: Mapping[int, Node]) -> None:
        for number, node in kept.items():
            ports = (bound.target.text for bound in node.bound if isinstance(bound.target, SignalName))
            reads = node.leaf.reads if node.leaf is not None else ()
            names = {*reads, *(name.partition(".")[0] for name in ports if not name.endswith(".fresh"))}
            signals = {name for name in names if self._is_multiplexed(name)}
            messages = {name.partition(".")[0] for name in names - signals}
            if node.leaf is not None and names:
                self.reads[number] = Reads(messages, signals, STATUS_NAMES.index(node.leaf.stale))

    def _is_multiplexed(self, name: str) -> bool:
        """Is it a signal that is not in every frame? Without a bus, each that is named may be."""
        if "." not in name or self.bus is NO_BUS:
            return "." in name
        received = self.received(name)
        return received is not None and bool(received.signal.selectors)

    def place(self, target: object) -> int | None:
        """The entry's place among `entries`; None for one that is not modelled."""
        return self._places.get(id(target))

    def read(self, script: Script) -> tuple[Expression, ...]:
        """The script's statements."""
        if id(script) not in self.statements:
            self.statements[id(script)] = parse(script.text)
        return self.statements[id(script)]

    def targets(self, script: Script) -> list[int]:
        """The entries that a script may write."""
        found: list[object] = [script.target]
        if script.role in ("condition", "action"):
            assigned = (one.target.name for one in assignments(self.read(script)))
            found = [stands_for(script.scope, name, script.place()) for name in assigned]
        elif script.role not in ("set", "unset", "take"):
            return []
        places = {self.place(target) for target in found}
        return sorted(place for place in places if place is not None)

    def _find_open(self, kept: Iterable[Node], others: Iterable[Node]) -> None:
        for node in others:
            self._open_ports(node)
            for _, script in scripts_of(node):
                self.open.update(self.targets(script))
        for node in kept:
            if node.type.name == "StatefulAction" or self._texts_of(node) == ():
                self._open_ports(node)
            for what, script in scripts_of(node):
                if what == "_onHalted" or script.role == "take":
                    self.open.update(self.targets(script))

    def _texts_of(self, node: Node) -> tuple[str, ...] | None:
        """The texts that a leaf may write; None if it writes none."""
        writes = any(self._is_text(place) for place in self.written(node))
        return node.leaf.texts if writes and node.leaf is not None else None

    def _is_text(self, place: int) -> bool:
        return self.entries[place].type.kind == "text"

    def _open_ports(self, node: Node) -> None:
        self.open.update(self.written(node))

    def written(self, node: Node) -> list[int]:
        """The entries that a leaf's output ports are connected to."""
        places = (self.place(bound.target) for bound in node.bound if bound.port.writes)
        return [place for place in places if place is not None]

    def text(self, text: str) -> int:
        """The number of a text; the empty one has 0, with which entries begin."""
        return self.texts.setdefault(text, len(self.texts))

    def _choices(self, node: Node, place: int) -> Ranges:
        """What a leaf may write to an entry, in steps."""
        if self._is_text(place):
            assert node.leaf is not None
            return merge((self.text(text), self.text(text)) for text in node.leaf.texts)
        kind = self.entries[place].type
        return ((kind.low, kind.high),)

    def limits(self, place: int) -> tuple[int, int]:
        """The range of an entry, in steps."""
        kind = self.entries[place].type
        return (TEXT_LOW, TEXT_HIGH) if kind.kind == "text" else (kind.low, kind.high)

    def initial(self, entry: Entry) -> int:
        """The number of steps, or of the text, that an entry begins with."""
        if entry.initial is None:
            return 0
        if entry.type.kind == "text":
            return self.text(entry.initial)
        if entry.type.kind == "bool":
            return int(entry.initial.strip().lower() in ("true", "1"))
        value = guess(entry.initial)
        assert isinstance(value, Const), "bind() has read the literal"
        return int(value.value / entry.type.scale)

    def received(self, name: str) -> Received | None:
        """The signal of a name with a dot; None if it is `fresh`, or a float."""
        message_name, _, signal_name = name.partition(".")
        message = self.message(message_name)
        signal = next((one for one in message.signals if one.name == signal_name), None)
        return None if signal is None or signal.is_float else Received(message, signal)

    def physical(self, name: str, raw: int) -> Fraction:
        """A received signal's value in its unit."""
        received = self.received(name)
        assert received is not None
        scale, offset = steps_of(received.signal)
        return raw * scale + offset

    def shown(self, place: int, steps: int) -> str:
        """An entry with what it holds, for people."""
        entry = self.entries[place]
        name = f"{entry.path}/{entry.name}" if entry.path else entry.name
        if entry.type.kind == "text":
            return f"{name} = '{next((text for text, one in self.texts.items() if one == steps), '')}'"
        if entry.type.kind == "bool":
            return f"{name} = {'true' if steps else 'false'}"
        return f"{name} = {plain(steps * entry.type.scale)}"

    def message(self, name: str) -> Message:
        """A received message."""
        return next(one for one in self.bus.receive if one.name == name)

    def signals_in(self, script: Script) -> list[str]:
        """The signals that a script names."""
        targets = (stands_for(script.scope, name, script.place()) for name in _names(script))
        return [target.text for target in targets if isinstance(target, SignalName)]

    def open_in(self, script: Script) -> list[Entry]:
        """The open entries that a script reads."""
        names = _names(script)
        if script.role == "action":
            given = [one.target for one in assignments(self.read(script)) if one.operator in NEW]
            read = [part for one in self.read(script) for part in parts(one) if isinstance(part, Name)]
            names = [part.name for part in read if not any(part is target for target in given)]
        targets = [stands_for(script.scope, name, script.place()) for name in names]
        return [self.entries[place] for place in map(self.place, targets) if place is not None and place in self.open]

    def needs(self, scope: Scope, place: Place, statements: Iterable[Expression]) -> tuple[set[str], set[str]]:
        """What a script must know so that it is run: fresh messages, and multiplexed signals that have come."""
        every = list(statements)
        read = [part for one in every for part in parts(one) if isinstance(part, Name)]
        written = [one.target for one in assignments(every)]
        targets = [stands_for(scope, p.name, place) for p in read if not any(p is t for t in written)]
        return self.needs_of(target.text for target in targets if isinstance(target, SignalName))

    def needs_of(self, names: Iterable[str]) -> tuple[set[str], set[str]]:
        """The same for the names of signals."""
        used = [name.partition(".")[::2] for name in names]
        tested = {message for message, signal in used if signal == "fresh"}
        fresh = {message for message, _ in used} - tested
        come = {
            f"{message}.{signal}"
            for message, signal in used
            if signal != "fresh" and (one := self.received(f"{message}.{signal}")) and one.signal.selectors
        }
        return fresh, come


def _is_modelled(entry: Entry) -> bool:
    return entry.type.kind in MODELLED and entry.type.high <= INT64[1] and not entry.type.names


def steps_of(signal: Signal) -> tuple[Fraction, Fraction]:
    """Scale and offset of a signal, exactly."""
    return Fraction(signal.scale), Fraction(signal.offset)
