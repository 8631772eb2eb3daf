# SPDX-License-Identifier: MIT
"""What converters write: a tree file in canonical form, with a <TreeNodesModel> of its leaves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.names import is_c_identifier, snake
from canopy.compiler.tree_reader import USER_KINDS, built_in_types
from canopy.fmt.document import Content, Document, Element, Markup
from canopy.fmt.writer import write_document


@dataclass(frozen=True)
class LeafModel:
    """A leaf to declare. `kind` is Condition, SyncAction or StatefulAction; `returns` as in <Metadata>."""

    id: str
    kind: str
    returns: str = ""
    description: str = ""


def node(tag: str, *children: Element, **attributes: str) -> Element:
    """An element with its children; an attribute that is a word of Python is written with a _ behind it."""
    return Element(tag, [(name.rstrip("_"), value) for name, value in attributes.items()], list(children))


def composite(tag: str, children: Sequence[Element]) -> Element:
    """A control node; one child needs none."""
    return children[0] if len(children) == 1 else Element(tag, [], list(children))


def check_leaf_name(name: str, place: Place) -> None:
    """Raises CompileError when a leaf cannot have this ID."""
    if not is_c_identifier(name) or not is_c_identifier(snake(name)):
        raise CompileError(place, f"'{name}' cannot be the ID of a leaf", "a C identifier, for example WalkHome")
    if name in built_in_types() or name in (*USER_KINDS, "SubTree", "Action", "Control", "Decorator"):
        raise CompileError(place, f"'{name}' is the name of a built-in node", "choose another ID")


def _declaration(leaf: LeafModel) -> Element:
    metadata = [("kind", leaf.kind)] if leaf.kind == "SyncAction" else []
    if leaf.returns:
        metadata.append(("returns", leaf.returns))
    inner: list[Content] = []
    if metadata:
        inner.append(Element("MetadataFields", [], [Element("Metadata", metadata)]))
    attributes = [("ID", leaf.id)]
    if leaf.description:
        attributes.append(("description", leaf.description))
    return Element("Condition" if leaf.kind == "Condition" else "Action", attributes, inner)


def merge_leaves(leaves: Iterable[LeafModel], place: Place) -> list[LeafModel]:
    """Each leaf once, in the order of their first use.

    Raises:
        CompileError: one is used as two kinds, or cannot be the ID of a leaf.
    """
    found: dict[str, LeafModel] = {}
    for leaf in leaves:
        check_leaf_name(leaf.id, place)
        other = found.setdefault(leaf.id, leaf)
        if other.kind != leaf.kind:
            raise CompileError(place, f"'{leaf.id}' is used as {other.kind} and as {leaf.kind}", "give them two names")
        same = [known for known in found if snake(known) == snake(leaf.id) and known != leaf.id]
        if same:
            raise CompileError(place, f"'{leaf.id}' and '{same[0]}' have the same name in C", nearest(leaf.id, same))
    return list(found.values())


def tree_file(tree_id: str, root: Element, leaves: Sequence[LeafModel], comment: str) -> str:
    """The text of a file with one tree."""
    model = Element("TreeNodesModel", [], [_declaration(leaf) for leaf in leaves])
    top = Element(
        "root",
        [("BTCPP_format", "4"), ("main_tree_to_execute", tree_id)],
        [Element("BehaviorTree", [("ID", tree_id)], [root]), model],
    )
    safe = comment.replace("--", "- -")
    return write_document(Document('<?xml version="1.0" encoding="UTF-8"?>', [Markup(f"<!-- {safe.strip()} -->"), top]))
