# SPDX-License-Identifier: MIT
"""How the trees of some files use nodes that nobody declared: their attributes, and the entries these are connected to.

Entries are told apart by tree, not by instance: enough for guessing, and the compiler checks the guess.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from canopy.compiler.blackboard import pointer
from canopy.compiler.documents import PLAIN_ATTRIBUTES, Documents, roots
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.port_types import PortType
from canopy.compiler.script.syntax import Assignment, Name, ScriptError, parse, parts
from canopy.compiler.scripted import LOOP_ITEMS, POSTCONDITIONS, PRECONDITIONS
from canopy.compiler.xml_reader import Element
from canopy.tree.built_in import built_in_models, is_users
from canopy.tree.enums import names_of
from canopy.tree.node_id import id_of

Key = tuple[int, str, str]
"""Which of the documents, the tree's ID ("@" for names that begin with it), the entry's name."""

SCRIPTS = ("code", "if", "success_script", "failure_script", "post_script", *PRECONDITIONS, *POSTCONDITIONS)
WRITTEN = {"SetBlackboard": "output_key", "UnsetBlackboard": "key"}
READ = ("queue", "variable", "entry")


@dataclass
class Use:
    """An attribute of an undeclared node, in one place. `key` is the entry; without one the value is a literal."""

    node: str
    port: str
    element: Element
    order: int
    text: str
    key: Key | None


@dataclass
class Usage:
    """What was found.

    `scripted`: what scripts and literals give a type; `first`: the order of the first mention of an entry by anything
    but an undeclared node; `literals`: what SetBlackboard writes; `mains`: the trees that can be main ones.
    """

    uses: list[Use] = field(default_factory=list)
    nodes: dict[str, list[Element]] = field(default_factory=dict)
    written: set[Key] = field(default_factory=set)
    scripted: set[Key] = field(default_factory=set)
    types: dict[Key, PortType] = field(default_factory=dict)
    literals: dict[Key, list[str]] = field(default_factory=dict)
    first: dict[Key, int] = field(default_factory=dict)
    mains: dict[int, list[str]] = field(default_factory=dict)
    _parent: dict[Key, Key] = field(default_factory=dict)
    _order: int = 0

    def root(self, key: Key) -> Key:
        """The entry that stands for all that are connected with this one."""
        while key in self._parent:
            key = self._parent[key]
        return key

    def known(self) -> set[Key]:
        """Every name that is joined with another one."""
        return {*self._parent, *self._parent.values()}

    def join(self, one: Key, other: Key) -> None:
        """Two names of the same entry."""
        one, other = self.root(one), self.root(other)
        if one != other:
            self._parent[other] = one

    def mention(self, key: Key, *, writes: bool = False, kind: PortType | None = None) -> None:
        """Something declared, or built in, is connected to the entry."""
        self.first.setdefault(key, self._order)
        if writes:
            self.written.add(key)
        if kind is not None and kind.kind != "any":
            self.types.setdefault(key, kind)

    def add(self, number: int, documents: Documents) -> None:
        """Looks at all trees of one file and of what it includes."""
        file = documents.top.place.file if documents.top is not None else ""
        own = [name for name, tree in documents.trees.items() if tree.place.file == file]
        first = documents.top.attributes.get("main_tree_to_execute", "") if documents.top is not None else ""
        of_all = roots(list(documents.trees), documents.trees)
        mains = list(dict.fromkeys([first] if first in documents.trees else []))
        mains += [name for name in (*roots(own, documents.trees), *of_all) if name not in mains]
        self.mains[number] = mains
        for tree_id in mains:
            self._main_ports(number, tree_id, documents)
        walk = _Walk(self, number, documents)
        for tree_id in [*mains, *documents.trees]:
            walk.tree(tree_id)
        walk.join_remapped()

    def _main_ports(self, number: int, tree_id: str, documents: Documents) -> None:
        for port in documents.declarations.subtrees.get(tree_id, ()):
            self.mention((number, tree_id, port.name), writes=True, kind=port.type)


class _Walk:
    def __init__(self, usage: Usage, number: int, documents: Documents) -> None:
        self._usage = usage
        self._number = number
        self._documents = documents
        self._seen: set[str] = set()
        self._remapped: list[tuple[str, str, frozenset[str]]] = []
        self._names: dict[str, set[str]] = {}
        self._enums = names_of(documents.declarations.enums)

    def key(self, tree_id: str, name: str) -> Key:
        """The entry of a name in a tree."""
        if name.startswith("@"):
            key = (self._number, "@", name[1:])
            for main in self._usage.mains[self._number]:
                self._usage.join((self._number, main, name[1:]), key)
            return key
        self._names.setdefault(tree_id, set()).add(name)
        return (self._number, tree_id, name)

    def tree(self, tree_id: str) -> None:
        """Every node of a tree in the order of ticks; the first time also those of its subtrees, in their place."""
        waiting = [(tree_id, element) for element in self._enter(tree_id)]
        while waiting:
            here, element = waiting.pop()
            self._usage._order += 1
            waiting.extend((here, child) for child in reversed(element.children))
            if element.tag == "SubTree":
                self._subtree(here, element)
                inner = element.attributes.get("ID", "")
                waiting.extend((inner, child) for child in self._enter(inner))
            else:
                self._node(here, element)
            for attribute in SCRIPTS:
                if attribute in element.attributes:
                    self._script(here, element.attributes[attribute])

    def _enter(self, tree_id: str) -> list[Element]:
        if tree_id in self._seen or tree_id not in self._documents.trees:
            return []
        self._seen.add(tree_id)
        return self._documents.trees[tree_id].children

    def _subtree(self, here: str, element: Element) -> None:
        inner = element.attributes.get("ID", "")
        if inner in self._usage.mains[self._number]:
            return  # it is also compiled alone, and then nobody gives it anything
        given = {name: text for name, text in element.attributes.items() if name not in _PLAIN and name[:1] != "_"}
        for name, text in given.items():
            target = pointer(text, name)
            key = self.key(inner, name)
            if target is None:
                self._usage.mention(key, writes=True)
                self._usage.scripted.add(key)
            else:
                self._usage.join(self.key(here, target), key)
        for port in self._documents.declarations.subtrees.get(inner, ()):
            self._usage.mention(self.key(inner, port.name), writes=port.default is not None, kind=port.type)
        if element.attributes.get("_autoremap", "").lower() in ("true", "1"):
            self._remapped.append((here, inner, frozenset(given)))

    def join_remapped(self) -> None:
        """Names that _autoremap shares; until nothing changes, since it may go down several trees."""
        for _ in range(len(self._remapped) + 1):
            for outer, inner, given in self._remapped:
                for name in sorted(self._names.get(inner, ())):
                    if name not in given and not name.startswith("_"):
                        self._usage.join(self.key(outer, name), (self._number, inner, name))

    def _script(self, here: str, text: str) -> None:
        try:
            statements = parse(text)
        except ScriptError:
            return
        for part in (part for statement in statements for part in parts(statement)):
            if isinstance(part, Name) and "." not in part.name and part.name not in self._enums:
                self._usage.mention(self.key(here, part.name))
            if isinstance(part, Assignment) and "." not in part.target.name:
                self._usage.mention(self.key(here, part.target.name), writes=part.operator == ":=")
                self._usage.scripted.add(self.key(here, part.target.name))

    def _node(self, here: str, element: Element) -> None:
        node_id = id_of(element)
        leaf = self._documents.declarations.leaves.get(node_id)
        if leaf is not None:
            self._declared(here, element, leaf)
        elif node_id in built_in_models() and not is_users(element, node_id):
            self._built_in(here, element, node_id)
        elif node_id and node_id not in self._documents.trees:
            self._usage.nodes.setdefault(node_id, []).append(element)
            for name, text in element.attributes.items():
                if name not in _PLAIN and not name.startswith("_") and ":" not in name and text != "":
                    target = pointer(text, name)
                    key = self.key(here, target) if target is not None and "." not in target else None
                    if key is not None or target is None:
                        self._usage.uses.append(Use(node_id, name, element, self._usage._order, text, key))

    def _declared(self, here: str, element: Element, leaf: Leaf) -> None:
        for port in leaf.ports:
            text = element.attributes.get(port.name) or port.default or ""
            target = pointer(text, port.name)
            if target is not None and "." not in target:
                self._usage.mention(self.key(here, target), writes=port.writes, kind=_known(port))

    def _built_in(self, here: str, element: Element, node_id: str) -> None:
        for name, text in element.attributes.items():
            inner = pointer(text, name)
            target = inner if inner is not None else text.strip()
            if name == WRITTEN.get(node_id) or (node_id in LOOP_ITEMS and name == "value"):
                if target.isidentifier() or target.startswith("@"):
                    self._usage.scripted.add(self.key(here, target))
                    value = element.attributes.get("value", "") if name == "output_key" else ""
                    if value and pointer(value, "") is None:
                        self._usage.literals.setdefault(self.key(here, target), []).append(value)
                    self._usage.mention(self.key(here, target), writes=True, kind=LOOP_ITEMS.get(node_id))
            elif (inner is not None or name == "entry") and name not in SCRIPTS and "." not in target:
                self._usage.mention(self.key(here, target))


_PLAIN = (*PLAIN_ATTRIBUTES, "ID")


def _known(port: Port) -> PortType | None:
    return port.type if port.type.kind != "any" else None


def use_of_nodes(many: list[Documents]) -> Usage:
    """How the trees of these files use undeclared nodes."""
    usage = Usage()
    for number, documents in enumerate(many):
        usage.add(number, documents)
    return usage
