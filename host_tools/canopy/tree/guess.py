# SPDX-License-Identifier: MIT
"""The <TreeNodesModel> that is missing: kinds, ports, directions and types of undeclared nodes, guessed from their use.

What is guessed, in this order:

- A node with one child is a Decorator, with more a Control; a leaf is a Condition if its name asks (IsDoorOpen).
- An entry that nothing declared writes must come from somewhere. An undeclared Action that is connected to it before
  anything else may read it, in the order of ticks, is taken to write it; so is a port whose name says output. Else the
  program writes it: it becomes a port of the main tree.
- Ports of one entry have one type. It comes from a declared port, a Loop, or a literal; where nothing tells, it is int.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

from canopy.compiler.documents import Documents
from canopy.compiler.numbers import exact, plain
from canopy.compiler.port_types import BOOL, DOUBLE, INT32, INT64, TEXT, PortType
from canopy.compiler.xml_reader import Element
from canopy.tree.undeclared import model_tag
from canopy.tree.usage import Key, Usage, Use, use_of_nodes

_OUT = re.compile(r"(out|output|result)([A-Z_\d].*)?|.*_(out|output|result)", re.ASCII)
_IN = re.compile(r"(in|input)([A-Z_\d].*)?|.*_(in|input)", re.ASCII)


@dataclass
class GuessedPort:
    """A port. `why` says what the guess comes from."""

    name: str
    direction: str = "input_port"
    type: PortType | None = None
    why: str = ""
    always_given: bool = True
    literals: list[Use] = field(default_factory=list)
    entries: list[Use] = field(default_factory=list)


@dataclass
class GuessedNode:
    """A node that nobody declared."""

    id: str
    tag: str
    elements: list[Element]
    ports: dict[str, GuessedPort] = field(default_factory=dict)


@dataclass
class Guess:
    """All that is missing: nodes by ID, and for each main tree the entries that the program has to write."""

    nodes: dict[str, GuessedNode] = field(default_factory=dict)
    inputs: dict[str, dict[str, PortType]] = field(default_factory=dict)
    locals: dict[str, dict[str, PortType]] = field(default_factory=dict)
    """Entries of inner trees that no declared port gives a type."""


def literal_type(texts: Iterable[str]) -> PortType:
    """The narrowest type that all these literals are values of."""
    best = BOOL
    for text in texts:
        if text in ("true", "false"):
            kind = BOOL
        else:
            try:
                value = exact(text)
            except ValueError:
                return TEXT
            whole = value.denominator == 1
            kind = DOUBLE if not whole or "." in text else INT32 if -(2**31) <= value < 2**31 else INT64
        rank = [BOOL, INT32, INT64, DOUBLE]
        best = max(best, kind, key=rank.index)
    return best


def _fits(text: str, kind: PortType) -> bool:
    if kind.kind == "text":
        return True
    if kind.kind == "user":
        return False
    found = literal_type([text])
    if kind.kind == "bool":
        return found == BOOL or text in ("0", "1")
    return found != TEXT and found != BOOL and (kind.kind in ("float", "fixed") or found != DOUBLE)


class _Guesser:
    def __init__(self, usage: Usage) -> None:
        self._usage = usage
        self.guess = Guess()
        self._written = {usage.root(key) for key in usage.written}
        self._types: dict[Key, PortType] = {}
        self._entries: dict[Key, list[Use]] = defaultdict(list)
        self._first: dict[Key, int] = {}
        self._scripted = {usage.root(key) for key in usage.scripted}
        for key, kind in usage.types.items():
            self._types.setdefault(usage.root(key), kind)
        for key, order in usage.first.items():
            root = usage.root(key)
            self._first[root] = min(order, self._first.get(root, order))

    def _port(self, use: Use) -> GuessedPort:
        return self.guess.nodes[use.node].ports[use.port]

    def run(self) -> Guess:
        """Everything, in order."""
        self._collect()
        for root in sorted(self._entries, key=lambda key: self._entries[key][0].order):
            self._direct(root)
        self._spread_types()
        for node in self.guess.nodes.values():
            if node.tag == "Condition" and any(port.direction != "input_port" for port in node.ports.values()):
                node.tag = "Action"  # a condition writes nothing
        self._inputs()
        return self.guess

    def _collect(self) -> None:
        for name, elements in sorted(self._usage.nodes.items()):
            tags = [model_tag(element) for element in elements]
            inner = [tag for tag in tags if tag in ("Control", "Decorator")]
            tag = ("Control" if "Control" in inner else "Decorator") if inner else tags[0]
            self.guess.nodes[name] = GuessedNode(name, tag, elements)
        for use in self._usage.uses:
            ports = self.guess.nodes[use.node].ports
            port = ports.setdefault(use.port, GuessedPort(use.port))
            if use.key is None:
                port.literals.append(use)
            else:
                port.entries.append(use)
                self._entries[self._usage.root(use.key)].append(use)
        for node in self.guess.nodes.values():
            for port in node.ports.values():
                port.always_given = all(element.attributes.get(port.name, "") != "" for element in node.elements)

    def _may_write(self, use: Use) -> bool:
        return not self._port(use).literals and _IN.fullmatch(use.port) is None

    def _direct(self, root: Key) -> None:
        """Who writes this entry, if nobody is known to?"""
        uses = self._entries[root]
        if root in self._written or any(self._port(use).direction == "output_port" for use in uses):
            self._written.add(root)
            return
        named = [use for use in uses if _OUT.fullmatch(use.port) and self._may_write(use)]
        first = uses[0]
        readers = len({(use.node, use.port) for use in uses}) > 1 or root in self._first
        acts = self.guess.nodes[first.node].tag == "Action" and self._may_write(first)
        if not named and readers and acts and first.order < self._first.get(root, first.order + 1):
            named = [first]
        is_inner = not self._main_names(root)
        if not named and is_inner:
            named = [use for use in uses if self._may_write(use)][:1]
        for use in named:
            port = self._port(use)
            port.direction = "output_port" if not is_inner or _OUT.fullmatch(use.port) else "inout_port"
            port.why = f"nothing else writes {use.text}"
            for other in port.entries:
                assert other.key is not None
                self._written.add(self._usage.root(other.key))

    def _main_names(self, root: Key) -> list[tuple[str, str]]:
        """The names that an entry has in main trees."""
        found = []
        for key in self._keys.get(root, [root]):
            number, tree_id, name = key
            if tree_id in self._usage.mains.get(number, ()):
                found.append((tree_id, name))
        return found

    @property
    def _keys(self) -> dict[Key, list[Key]]:
        if not hasattr(self, "_all_keys"):
            self._all_keys: dict[Key, list[Key]] = defaultdict(list)
            keys = {use.key for use in self._usage.uses if use.key is not None}
            for key in sorted({*keys, *self._usage.first, *self._usage.known()}):
                self._all_keys[self._usage.root(key)].append(key)
        return self._all_keys

    def _spread_types(self) -> None:
        """From entries to ports and on, until nothing more is learnt."""
        changed = True
        while changed:
            changed = False
            for node in self.guess.nodes.values():
                for port in node.ports.values():
                    roots = [self._usage.root(use.key) for use in port.entries if use.key is not None]
                    known = [self._types[root] for root in roots if root in self._types]
                    if port.type is None and (known or port.literals):
                        port.type = known[0] if known else literal_type(use.text for use in port.literals)
                        port.why = port.why or (
                            "type of the entry that it is connected to" if known else f"e.g. {port.literals[0].text}"
                        )
                        changed = True
                    if port.type is None:
                        continue
                    for root in roots:
                        if root not in self._types:
                            self._types[root] = port.type
                            changed = True
        for node in self.guess.nodes.values():
            for port in node.ports.values():
                kinds = {self._types.get(self._usage.root(use.key)) for use in port.entries if use.key is not None}
                if port.type is None:
                    port.type, port.why = INT32, port.why or "nothing tells its type"
                elif len(kinds - {None}) > 1 or not all(_fits(use.text, port.type) for use in port.literals):
                    port.type, port.why = None, "its uses have several types"

    def _inputs(self) -> None:
        """Entries that still nobody writes, and those that only ports without a type are connected to."""
        for key, texts in self._usage.literals.items():
            self._types.setdefault(self._usage.root(key), literal_type(texts))
        for root in sorted({*self._entries, *self._first}):
            given = root in self._written and (root in self._types or root in self._entries or root in self._scripted)
            names = self._keys.get(root, [root])
            # What one main tree writes to @name, another one may miss.
            shared = any(key[1] == "@" and len(self._usage.mains.get(key[0], ())) > 1 for key in names)
            if given and not shared:
                continue
            mains = self._main_names(root)
            if not mains and root not in self._types and root[1] != "@":
                _, tree_id, name = names[0]
                self.guess.locals.setdefault(tree_id, {}).setdefault(name, INT32)
            for tree_id, name in mains:
                self.guess.inputs.setdefault(tree_id, {}).setdefault(name, self._types.get(root, INT32))


def guess_models(many: list[Documents]) -> Guess:
    """What the trees of these files need, and no file declares."""
    return _Guesser(use_of_nodes(many)).run()


def type_name(kind: PortType) -> str:
    """How a model names the type."""
    if kind.kind == "fixed":
        return f"{kind.c}*{plain(kind.scale)}"
    if kind.item:
        item = "std::string" if kind.holds_texts else kind.item
        return f"{item}[{kind.capacity}]"
    return {"text": "std::string", "duration": "std::chrono::milliseconds"}.get(kind.kind, kind.c)
