# SPDX-License-Identifier: MIT
"""What the ports of the user's nodes are given: a literal, an entry, a signal, or nothing."""

from __future__ import annotations

from canopy.compiler.blackboard import Entry, Scope, Use, pointer
from canopy.compiler.documents import Documents
from canopy.compiler.errors import CompileError
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.scripted import Context
from canopy.compiler.tree import Bound
from canopy.compiler.xml_reader import Element
from canopy.tree.node_id import id_of


def dotted_names(documents: Documents, tree_id: str) -> set[str]:
    """The names with a dot that some node of a tree writes: entries, where others are signals, `Message.Signal`."""
    found = set()
    seen = {tree_id}
    waiting = [documents.trees[tree_id]]
    while waiting:
        element = waiting.pop()
        waiting.extend(element.children)
        inner = element.attributes.get("ID", "") if element.tag == "SubTree" else ""
        if inner in documents.trees and inner not in seen:
            seen.add(inner)
            waiting.append(documents.trees[inner])
        leaf = documents.declarations.leaves.get(id_of(element))
        for port in leaf.ports if leaf is not None else ():
            if port.writes:
                found.add(pointer(element.attributes.get(port.name) or port.default or "", port.name) or "")
    return {name.removeprefix("@") for name in found if "." in name}


def is_traced(element: Element) -> bool:
    """Are the entries of this node's ports in the trace?

    Raises:
        CompileError: `_trace` is neither yes nor no.
    """
    text = element.attributes.get("_trace", "no")
    if text not in ("yes", "no"):
        raise CompileError(element.attribute_place("_trace"), f"_trace='{text}' is neither yes nor no")
    return text == "yes"


def _may_be_unset(context: Context, port: Port) -> bool:
    """Outputs need not be connected; nor what no type asks to be, or C++ calls optional."""
    return port.direction == "out" or port.is_optional or port.type.kind == "any" or context.options.unset_ports


def bind_port(context: Context, element: Element, leaf: Leaf, port: Port, scope: Scope) -> Bound:
    """What this node gives a port.

    Raises:
        CompileError: nothing, though a value is needed; or something that the node could not write.
    """
    # Groot2 writes an empty attribute for a port that nothing is connected to.
    given = port.name in element.attributes and (element.attributes[port.name] != "" or port.type.kind == "text")
    text = element.attributes[port.name] if given else port.default
    place = element.attribute_place(port.name) if given else element.place
    if text is None:
        if _may_be_unset(context, port):
            return Bound(port, place)
        raise CompileError(
            element.place,
            f"'{leaf.id}' needs a value for its port '{port.name}'",
            f"or give the port a default where it is declared: {port.place}; or take 0, false or NULL for all such "
            "ports: --allow-unset-ports",
        )
    what = f"port '{port.name}' of '{leaf.id}'"
    name = pointer(text, port.name)
    if name is None:
        return _literal(context, port, text, Bound(port, place, text=text), scope, what)
    target = scope.resolve(name, place)
    if isinstance(target, Entry):
        target.connect(Use(port.type, place, what, port.writes))
    elif port.writes:
        raise CompileError(place, f"{what} is written, and '{name}' is a signal")
    return Bound(port, place, target=target)


def _literal(context: Context, port: Port, text: str, bound: Bound, scope: Scope, what: str) -> Bound:
    """An inout port with a literal has an entry of its own, which begins with it."""
    if port.direction == "in":
        return bound
    if port.direction == "out":
        raise CompileError(bound.place, f"{what} is written, and '{text}' is a literal", "give an entry: {name}")
    entry = context.board.make(f"{port.name} at line {bound.place.line}", scope.path, bound.place)
    entry.initial = text
    entry.connect(Use(port.type, bound.place, what, True))
    return Bound(port, bound.place, target=entry)
