# SPDX-License-Identifier: MIT
"""XML elements into a tree of nodes, checked: every node is known, has the right children and the right attributes.

A <SubTree> costs no node: the root of its tree stands in its place, with a scope of names of its own.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from canopy.compiler.blackboard import Blackboard, Entry, Scope, Use, pointer
from canopy.compiler.documents import PLAIN_ATTRIBUTES, Documents, read_documents, roots
from canopy.compiler.errors import CompileError, Errors, nearest
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.node_types import NodeType, node_types
from canopy.compiler.port_types import Options
from canopy.compiler.scripted import POSTCONDITIONS, PRECONDITIONS, SCRIPTED, Context, attributes_node
from canopy.compiler.tree import Bound, Node, Tree
from canopy.compiler.xml_reader import Element
from canopy.tree.built_in import CANOPY_ONLY, built_in_models, foreign_attribute, is_users
from canopy.tree.enums import names_of
from canopy.tree.instance import Instance
from canopy.tree.model_file import declare_guessed
from canopy.tree.node_id import id_of
from canopy.tree.parameters import read_parameter
from canopy.tree.ports import bind_port, dotted_names, is_traced
from canopy.tree.search import complete
from canopy.tree.undeclared import Unknown, stand_in

__all__ = ["MAX_NODES", "Node", "Tree", "built_in_types", "read_tree", "read_unused_trees"]

MAX_NODES = 65_534
MAX_SUBTREE_DEPTH = 1_000
MAX_PATH = 4_000

CONDITION_ATTRIBUTES = (*PRECONDITIONS, *POSTCONDITIONS)

# Kinds of the user's own nodes: their names in XML are those of the nodes.
USER_KINDS = ("Condition", "SyncAction", "StatefulAction")

# Rows of nodes.def that are made by the compiler, and are no names in XML.
INTERNAL = ("Attributes", "Loop", "Switch", "Control", "Decorator")

# Of BehaviorTree.CPP 4, and known to be missing here: refused by name, not as a typing error.
NOT_SUPPORTED = frozenset(("ManualSelector",))

EXPLICIT = {"Action": "LEAF", "Condition": "LEAF", "Control": "CONTROL", "Decorator": "DECORATOR"}


def built_in_types() -> dict[str, NodeType]:
    """The node types that XML can name and that have no script."""
    hidden = {*USER_KINDS, *INTERNAL, *NOT_SUPPORTED, *SCRIPTED}
    return {name: kind for name, kind in node_types().items() if name not in hidden}


def built_in_names() -> frozenset[str]:
    """What a declaration cannot be called, but for the names that only Canopy has."""
    return frozenset((*built_in_types(), *SCRIPTED, *NOT_SUPPORTED, "SubTree", *EXPLICIT))


class _Builder:
    def __init__(self, documents: Documents, options: Options) -> None:
        self._documents = documents
        self._library = documents.library
        self._trees = documents.trees
        self._models = documents.declarations
        self._foreign = documents.foreign
        self._built_in = built_in_types()
        self.context = Context(options, Blackboard())
        self._known = {*self._built_in, *SCRIPTED, *NOT_SUPPORTED, ""} - {*CANOPY_ONLY}
        self._unknown = Unknown()
        self._sources = documents.files
        self.errors = Errors()
        self.count = 0
        self.used: set[str] = set()

    def build(self, tree_id: str) -> Node:
        """The whole tree. A loop, not recursion: trees may be as deep as they are large."""
        with contextlib.suppress(CompileError):  # what is wrong is said where it is used
            complete(self._documents, built_in_names(), tree_id)
        self.context.board.dotted = dotted_names(self._documents, tree_id)
        self.context.board.enums = names_of(self._models.enums)
        main = Instance(self.context.board.main, tree_id, (tree_id,))
        self.used.add(tree_id)
        self._main_ports(main.scope, tree_id)
        root, inner, element, instance = self._expand(self._trees[tree_id].children[0], main)
        waiting = [(inner, element, instance)]
        while waiting:
            node, element, instance = waiting.pop()
            for child_element in element.children:
                outer, inner, inner_element, inner_instance = self._expand(child_element, instance)
                node.children.append(outer)
                if inner_element.children:
                    waiting.append((inner, inner_element, inner_instance))
            try:
                self._check_handler(node)
            except CompileError as error:
                self.errors.add(error)
        self._unknown.report(self.errors, self._sources)
        if not self.context.options.draw:
            self.errors.raise_any()
        return root

    @staticmethod
    def _check_handler(node: Node) -> None:
        """A halt is no tick: what it ticks is a leaf with a function."""
        if node.type.name == "TryCatch" and node.parameters != (0,) and node.children[-1].type.name not in USER_KINDS:
            raise CompileError(
                node.children[-1].place,
                "with catch_on_halt the last child of <TryCatch> must be a leaf of yours or a Script, "
                "without pre- and postconditions",
                "a halt cannot go down a tree: do the clean-up in one leaf",
            )

    def _main_ports(self, scope: Scope, tree_id: str) -> None:
        """The ports of the main tree are what the program itself writes and reads."""
        self._library.add_ports(tree_id, self._trees[tree_id], self._documents)
        for port in self._models.subtrees.get(tree_id, ()):
            inner = pointer(port.default or "", port.name)
            entry = scope.resolve(inner or port.name, port.place)
            scope.names.setdefault(port.name, entry)
            if isinstance(entry, Entry):
                entry.initial = port.default if inner is None else None
                entry.connect(Use(port.type, port.place, f"port '{port.name}' of the main tree", True))

    def _counted(self, node: Node) -> Node:
        self.count += 1
        if self.count > MAX_NODES:
            self.errors.add(CompileError(node.place, f"the tree has more than {MAX_NODES} nodes"))
            self.errors.raise_any()
        return node

    def _expand(self, element: Element, instance: Instance) -> tuple[Node, Node, Element, Instance]:
        """The node of an element, below the nodes of its attributes; for a SubTree, the root of its tree.

        Gives the outermost node, and the innermost one with its element and instance.
        """
        outermost: Node | None = None
        above: Node | None = None
        while True:
            attributes: Node | None = None
            node: Node | None = None
            inner: Instance | None = None
            try:
                attributes = attributes_node(self.context, element, instance.scope)
                if element.tag == "SubTree":
                    inner = self._enter(element, instance)
                else:
                    node = self._make(element, instance)
            except CompileError as error:  # go on without it, to find what else is wrong
                self.errors.add(error)
                node = stand_in(element)
            for new in (attributes, node):
                if new is None:
                    continue
                self._counted(new)
                new.path = f"{instance.path}/{instance.unique(new.name)}"
                if above is not None:
                    above.children.append(new)
                outermost = outermost or new
                above = new
            if inner is None:
                assert outermost is not None and node is not None
                return outermost, node, element, instance
            instance = inner
            element = self._trees[instance.chain[-1]].children[0]

    def _enter(self, element: Element, outer: Instance) -> Instance:
        """A new instance of the tree that a <SubTree> names."""
        tree_id = element.attributes.get("ID", "")
        if tree_id not in self._trees and not self._library.add_tree(tree_id, element, self._documents):
            raise CompileError(
                element.attribute_place("ID"),
                f"<SubTree> names no tree: '{tree_id}'",
                f"{nearest(tree_id, self._trees)}; the folder of a file that has it: --search DIR",
            )
        self._library.add_ports(tree_id, element, self._documents)
        if tree_id in outer.chain:
            loop = " -> ".join((*outer.chain[outer.chain.index(tree_id) :], tree_id))
            raise CompileError(element.place, f"trees contain each other in a cycle: {loop}", "a tree has an end")
        if len(outer.chain) > MAX_SUBTREE_DEPTH:
            raise CompileError(element.place, f"subtrees are nested more than {MAX_SUBTREE_DEPTH} deep")
        if element.children:
            raise CompileError(element.children[0].place, f"<SubTree ID='{tree_id}'> cannot have children")
        self.used.add(tree_id)
        name = outer.unique(element.attributes.get("name", tree_id))
        path = f"{outer.scope.path}/{name}".lstrip("/")
        if len(path) > MAX_PATH:  # every node and entry below has it in its name
            raise CompileError(element.place, f"the names of nested subtrees have more than {MAX_PATH} characters")
        autoremap = element.attributes.get("_autoremap", "false")
        if autoremap.lower() not in ("true", "false", "1", "0"):
            raise CompileError(
                element.attribute_place("_autoremap"), f"_autoremap='{autoremap}' is neither true nor false"
            )
        scope = Scope(self.context.board, path, outer.scope, autoremap=autoremap.lower() in ("true", "1"))
        self._connect(element, scope, tree_id)
        return Instance(scope, f"{outer.path}/{name}", (*outer.chain, tree_id))

    def _connect(self, element: Element, scope: Scope, tree_id: str) -> None:
        plain = {*PLAIN_ATTRIBUTES, *CONDITION_ATTRIBUTES, "ID", "_autoremap"}
        ports = {port.name: port for port in self._models.subtrees.get(tree_id, ())}
        for name, text in element.attributes.items():
            if name in plain:
                continue
            if name.startswith("_"):
                self._foreign.leave(name, element.attribute_place(name), "<SubTree>", plain)
                continue
            if not name.isidentifier():
                raise CompileError(element.attribute_place(name), f"'{name}' cannot be the name of a port")
            scope.connect(name, text, element.attribute_place(name))
        for port in ports.values():
            if port.name not in scope.names and not scope.autoremap:
                if port.default is None and not port.writes:
                    raise CompileError(
                        element.place,
                        f"<SubTree ID='{tree_id}'> needs a value for its port '{port.name}'",
                        f"declared at {port.place}",
                    )
                if port.default is not None:
                    scope.connect(port.name, port.default, port.place)
            target = scope.resolve(port.name, port.place)
            if isinstance(target, Entry):
                target.connect(Use(port.type, port.place, f"port '{port.name}' of tree '{tree_id}'", False))

    def _make(self, element: Element, instance: Instance) -> Node:
        node_id = id_of(element)
        if node_id not in self._known:
            self._library.add_model(node_id, element, self._documents)
        if node_id in self._models.leaves:  # first: the user's node may have the name of one that only Canopy has
            node = self._leaf_node(element, self._models.leaves[node_id], instance.scope)
        elif is_users(element, node_id):
            wrong = foreign_attribute(element, node_id) or ""
            known = [port.name for port in built_in_models()[node_id][1]]
            raise CompileError(
                element.attribute_place(wrong),
                f"<{node_id}> has no attribute '{wrong}'",
                f"{nearest(wrong, known)}; if it is a node of your own, canopy model {self._sources[0]} declares it",
            )
        elif node_id in SCRIPTED:
            node = SCRIPTED[node_id](self.context, element, instance.scope, node_id)
            self._check_plain(element)
        elif node_id in self._built_in:
            node = self._built_in_node(element, self._built_in[node_id], instance.scope)
        elif node_id in NOT_SUPPORTED:
            raise CompileError(
                element.place, f"<{node_id}> is not supported", "declare a node of your own in its place"
            )
        elif element.tag in EXPLICIT and not node_id:
            raise CompileError(element.place, f"<{element.tag}> needs the attribute ID")
        else:
            if node_id in self._trees:
                message = f"unknown node '{node_id}'"
                raise CompileError(element.place, message, f'it is a tree: <SubTree ID="{node_id}"/>')
            self._unknown.add(node_id, element.place, (*self._models.leaves, *self._known, *CANOPY_ONLY))
            return stand_in(element)
        wanted = EXPLICIT.get(element.tag)
        is_condition = node.type.name == "Condition"
        if wanted is not None and (
            wanted != node.type.category
            or (node.leaf is not None and (element.tag == "Condition") != is_condition and wanted == "LEAF")
        ):
            where = f", at {node.leaf.place}" if node.leaf is not None else ""
            kind = node.leaf.kind if node.leaf is not None else node.type.category.lower()
            raise CompileError(element.place, f"'{node_id}' is declared as {kind}{where}")
        count = len(element.children)
        if node.leaf is not None and not node.leaf.is_inner and count:
            raise CompileError(element.children[0].place, f"'{node_id}' is a leaf and cannot have children")
        if not node.type.least_children <= count <= min(node.type.most_children, MAX_NODES):
            if count > MAX_NODES:
                raise CompileError(element.place, f"the tree has more than {MAX_NODES} nodes")
            raise CompileError(
                element.place, f"<{node_id}> needs {node.type.arity_text()} child node(s), and has {count}"
            )
        return node

    def _check_plain(self, element: Element) -> None:
        """Looks at the attributes that begin with `_`: those of other tools are left alone."""
        allowed = {*PLAIN_ATTRIBUTES, *CONDITION_ATTRIBUTES}
        for name in element.attributes:
            if name.startswith("_") and name not in allowed:
                self._foreign.leave(name, element.attribute_place(name), f"<{element.tag}>", allowed)

    def _check_attributes(self, element: Element, own: set[str]) -> None:
        allowed = {*PLAIN_ATTRIBUTES, *CONDITION_ATTRIBUTES, *own} | ({"ID"} if element.tag in EXPLICIT else set())
        for name in element.attributes:
            if name not in allowed and not name.startswith("_"):
                raise CompileError(element.place, f"<{element.tag}> has no attribute '{name}'", nearest(name, allowed))
        self._check_plain(element)

    def _leaf_node(self, element: Element, leaf: Leaf, scope: Scope) -> Node:
        if leaf.problem is not None:
            raise leaf.problem
        self._check_attributes(element, {port.name for port in leaf.ports})
        bound = tuple(self._bind_or_not(element, leaf, port, scope) for port in leaf.ports)
        if is_traced(element):
            for port in bound:
                if isinstance(port.target, Entry):
                    port.target.is_traced = True
        name = element.attributes.get("name", leaf.id)
        return Node(node_types()[leaf.kind], name, element.place, leaf=leaf, bound=bound, xml_name=leaf.id)

    def _bind_or_not(self, element: Element, leaf: Leaf, port: Port, scope: Scope) -> Bound:
        try:
            return bind_port(self.context, element, leaf, port, scope)
        except CompileError as error:
            self.errors.add(error)
            return Bound(port, element.place)

    def _built_in_node(self, element: Element, kind: NodeType, scope: Scope) -> Node:
        own = {parameter.name for parameter in kind.parameters}
        self._check_attributes(element, own)
        parameters = tuple(read_parameter(self.context, element, each, scope) for each in kind.parameters)
        name = element.attributes.get("name", kind.name)
        return Node(kind, name, element.place, parameters, xml_name=kind.name)


def read_tree(path: Path, options: Options | None = None) -> Tree:
    """The main tree of an XML file in BehaviorTree.CPP's format 4, with its subtrees expanded.

    Raises:
        CompileError: anything in the file, or in those it includes, that cannot be compiled.
    """
    options = options or Options()
    documents = read_documents(path, options, built_in_names())
    if options.undeclared:
        declare_guessed(documents, options, built_in_names())
    tree = _expand(path, documents, _Builder(documents, options), documents.main)
    own = {name: element for name, element in documents.trees.items() if element.place.file == str(path)}
    first = roots(list(own), documents.trees) if options.draw and options.main_tree is None else []
    if documents.top is not None and documents.top.attributes.get("main_tree_to_execute") in documents.trees:
        first = []
    return replace(
        tree,
        others=tuple(name for name in first if name != tree.id),
        unused={name: element for name, element in own.items() if name not in tree.used},
    )


def read_unused_trees(path: Path, options: Options, tree: Tree) -> Iterator[tuple[str, Tree | CompileError]]:
    """The file's trees that are no part of its main tree: each that is no part of another one, or why it cannot be."""
    documents = read_documents(path, options, built_in_names())
    if options.undeclared:
        declare_guessed(documents, options, built_in_names())
    inner = {ref for element in tree.unused.values() for ref in _subtrees(element)}
    seen: set[str] = set()
    nodes = 0
    # Those that no other one has come first; the rest is seen with them, but for trees that contain each other.
    for tree_id in sorted(tree.unused, key=lambda name: name in inner):
        if tree_id in seen:
            continue
        if nodes > MAX_NODES:
            message = f"the trees that are not used have more than {MAX_NODES} nodes; from here on none is looked at"
            yield tree_id, CompileError(tree.unused[tree_id].place, message)
            return
        builder = _Builder(documents, options)
        try:
            found = _expand(path, documents, builder, tree_id)
        except CompileError as error:
            yield tree_id, error
        else:
            seen |= found.used
            yield tree_id, found
        nodes += builder.count


def _subtrees(element: Element) -> Iterator[str]:
    waiting = [element]
    while waiting:
        part = waiting.pop()
        waiting.extend(part.children)
        if part.tag == "SubTree":
            yield part.attributes.get("ID", "")


def _expand(path: Path, documents: Documents, builder: _Builder, tree_id: str) -> Tree:
    root = builder.build(tree_id)
    return Tree(
        id=tree_id,
        path=path,
        root=root,
        leaves=documents.usable_leaves,
        files=tuple(documents.files),
        board=builder.context.board,
        scripts=tuple(builder.context.scripts),
        used=frozenset(builder.used),
        enums=documents.declarations.enums,
        problems=len(builder.errors) + documents.problems,
        foreign=documents.foreign,
    )
