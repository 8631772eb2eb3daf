# SPDX-License-Identifier: MIT
"""The user's nodes in C: types of ports, prototypes, and the arguments that the generated code calls them with."""

from __future__ import annotations

from collections.abc import Mapping

from canopy.compiler.blackboard import Entry
from canopy.compiler.bus_reader import Bus
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.names import snake
from canopy.compiler.numbers import plain
from canopy.compiler.port_types import NOTHING, PortType
from canopy.escape.c import emits_c, mark_c

TREE_PARAMETERS = "canopy_tree_instance_t *tree, uint16_t node"


@emits_c
def stale_test(bus: Bus, leaf: Leaf) -> str:
    """C: is something that the leaf reads not known? A multiplexed signal that it names must have come, too."""
    flags = {(m.name, s.name): s.has_name for m in bus.receive for s in m.multiplexed}
    names = {m.name: m.c_name for m in bus.receive}
    reads = sorted(
        {
            (names[message], flags.get((message, signal), "fresh"))
            for message, _, signal in (name.partition(".") for name in leaf.reads)
        }
    )
    return " || ".join(f"!app->input.{message}.{flag}" for message, flag in reads)


@emits_c
def parameters(leaf: Leaf, bus: Bus, before: str = "") -> str:
    """The parameters of the user's functions; `before` stands in front."""
    parts = [before] if before else []
    parts.append(f"const {bus.name}_input_t *in")
    if leaf.writes:
        parts.append(f"{bus.name}_output_t *out")
    if leaf.ports:
        parts.append(f"const {leaf.c_name}_ports_t *ports")
    if leaf.state:
        parts.append(f"{leaf.state} *self")
    if leaf.reasons:
        parts.append(f"{leaf.c_name}_reason_t *reason")
    return ", ".join(parts)


@emits_c
def arguments(leaf: Leaf, *, copies: bool = False, before: str = "") -> str:
    """The arguments for these parameters, in a function of the generated code that has `app` and `parameter`."""
    parts = [before] if before else []
    parts.append("&app->input")
    if leaf.writes:
        parts.append("&app->output")
    if leaf.ports:
        parts.append("&ports" if copies else f"&{leaf.c_name}_ports[parameter]")
    if leaf.state:
        parts.append(f"&app->{leaf.c_name}[parameter]")
    if leaf.reasons:
        parts.append(f"&app->reason_of_{leaf.c_name}[parameter]")
    return ", ".join(parts)


@emits_c
def reason_constants(leaf: Leaf) -> list[tuple[str, int]]:
    """The C names of the leaf's reasons, and their numbers; 0 is none."""
    stem = leaf.c_name.upper()
    return [(f"{stem}_REASON_{snake(name).upper()}", number) for number, name in enumerate(("none", *leaf.reasons))]


@emits_c
def prototypes(leaf: Leaf, bus: Bus) -> list[str]:
    """The functions that the user writes, without the final semicolon."""
    name = leaf.c_name
    if leaf.is_inner:
        child = f"{TREE_PARAMETERS}, uint16_t child, canopy_status_t status"
        return [
            f"canopy_step_t {name}_enter({parameters(leaf, bus, TREE_PARAMETERS)})",
            f"canopy_step_t {name}_child({parameters(leaf, bus, child)})",
            f"void {name}_halt({parameters(leaf, bus, TREE_PARAMETERS)})",
        ]
    own = parameters(leaf, bus)
    if leaf.kind == "StatefulAction":
        return [
            f"canopy_status_t {name}_on_start({own})",
            f"canopy_status_t {name}_on_running({own})",
            f"void {name}_on_halted({own})",
        ]
    return [f"canopy_status_t {name}_tick({own})"]


@emits_c
def function_names(leaf: Leaf, bus: Bus) -> list[str]:
    """What the user calls these functions."""
    return [prototype.partition("(")[0].split()[-1] for prototype in prototypes(leaf, bus)]


def _spaced(c_type: str) -> str:
    return c_type if c_type.endswith("*") else f"{c_type} "


def port_members(leaf: Leaf, port: Port, counted: set[tuple[str, str]]) -> list[tuple[str, str]]:
    """(declaration, comment) of the members of the ports struct that a port becomes."""
    notes = [port.description.rstrip(".") + "."] if port.description else []
    if port.type.kind == "duration":
        notes.insert(0, "[ms]")
    if port.type.kind == "fixed":
        notes.insert(0, f"In steps of {plain(port.type.scale)}.")
    if not port.writes:
        c_type = f"const {port.type.c} *" if port.type.kind == "user" else port.type.c
        return [(mark_c(f"{_spaced(c_type)}{port.c_name};"), " ".join(notes))]
    if port.type == NOTHING:
        return [
            (mark_c(f"void *{port.c_name};"), " ".join([*notes, "Nothing is connected to it, and it has no type."]))
        ]
    notes.append(f"Written with {leaf.c_name}_set_{port.c_name}().")
    members = [(mark_c(f"{_stored(port.type)} *{port.c_name};"), " ".join(notes))]
    if (leaf.id, port.name) in counted:
        members.append(
            (mark_c(f"uint32_t *{port.c_name}_updates;"), "Counts the writes, for nodes that wait for them.")
        )
    return members


@emits_c
def setter(leaf: Leaf, port: Port) -> tuple[str, str]:
    """(parameter, expression to store) of the C function with which the user writes an output port."""
    if port.type.kind == "text":
        return f"{leaf.text_type} value", "(uint16_t)value"
    if port.type.kind == "user":
        return f"const {port.type.c} *value", "*value"
    return f"{port.type.c} value", "value"


def has_setter(port: Port) -> bool:
    """Can the node write it?"""
    return port.writes and port.type != NOTHING


def _stored(kind: PortType) -> str:
    return "uint16_t" if kind.kind == "text" else kind.c


@emits_c
def entry_type(entry: Entry) -> str:
    """The C type of an entry's member. Texts are places in the table of texts."""
    return _stored(entry.type)


@emits_c
def item_type(queue: PortType) -> str:
    """The C type of a queue's items."""
    return "uint16_t" if queue.holds_texts else queue.item


def writes_texts(leaf: Leaf) -> bool:
    """Does the leaf have an output port of texts, or of a queue of them?"""
    return any(port.writes and port.type.holds_texts for port in leaf.ports)


def text_constants(leaf: Leaf, places: Mapping[str, int]) -> list[tuple[str, int, str]]:
    """(C name, place in the table, text) of what the leaf may write."""
    if not writes_texts(leaf):
        return []
    return [(f"{leaf.c_name}_{snake(text)}".upper(), places[text], text) for text in leaf.texts]


def entry_note(entry: Entry) -> str:
    """What a reader of the entry's member must know of its type."""
    if entry.type.kind == "fixed":
        return f"; in steps of {plain(entry.type.scale)}"
    return "; place in the table of texts" if entry.type.kind == "text" else ""


@emits_c
def entry_kind(entry: Entry) -> str:
    """How a host program in the same process reads the entry's member: `kind` of canopy_in_process_entry_t."""
    kind = entry.type.kind
    if kind in ("int", "fixed", "duration"):
        return "i" if entry.type.low < 0 else "u"
    return {"bool": "b", "float": "f", "text": "t"}.get(kind, "o") if not entry.type.capacity else "o"


def entry_step(entry: Entry) -> str:
    """The physical size of one step of the member, as a decimal number."""
    return str(plain(entry.type.scale)) if entry.type.kind == "fixed" else "1"
