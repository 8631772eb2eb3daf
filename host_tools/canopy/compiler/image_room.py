# SPDX-License-Identifier: MIT
"""The room that an application keeps for tree images, and what that costs."""

from __future__ import annotations

from dataclasses import dataclass, replace

from canopy.compiler.budget import ImageCost, array, entries_size, port_size, scalar, struct_size
from canopy.compiler.limits import COUNT, Limits, count, whole
from canopy.compiler.table import Table

SLOTS = 2  # CANOPY_IMAGE_SLOTS
DEFAULT_USES = 8
IMAGE_NODES = Limits(1, 65_534)
IMAGE_USES = Limits(1, 4_096)
IMAGE_TEXTS = Limits(0, 2**32 - 1)
# A text port's share of the texts of an image.
TEXT_BYTES = 32


@dataclass(frozen=True)
class Room:
    """The largest image: nodes, uses of each kind of the user's nodes, and what follows from these."""

    nodes: int
    uses: int
    parameters: int
    words: int
    texts: int


def make_room(table: Table, nodes: int, uses: int) -> Room:
    """Two parameters and two state words a node; texts of 32 bytes for each text port of each use.

    Raises:
        CompileError: images could not address so much.
    """
    place = table.tree.root.place
    count(entries_size(table)[0], "bytes of entries that tree images can use", place, "make queues shorter")
    text_ports = sum(port.type.kind == "text" for use in table.users for port in use.leaf.ports)
    texts = whole(
        TEXT_BYTES * uses * text_ports, IMAGE_TEXTS, "room for the texts of tree images", place, "lower --image-uses"
    )
    return Room(nodes, uses, min(2 * nodes, COUNT.high), min(2 * nodes, COUNT.high), texts)


def exchangeable(table: Table) -> Table:
    """The table, with uses whose ports an image may give."""
    return replace(
        table,
        leaves=tuple(replace(use, exchangeable=True) for use in table.leaves),
        controls=tuple(replace(use, exchangeable=True) for use in table.controls),
    )


def memory_size(table: Table, room: Room) -> tuple[int, int]:
    """(size, alignment) of the struct that the template image_memory.c.j2 declares."""
    u8, u16, u32, u64, pointer = (scalar(t) for t in ("uint8_t", "uint16_t", "uint32_t", "uint64_t", "pointer"))
    tree = struct_size([*[pointer] * 5, *[u16] * 6, u32])
    node = struct_size([u8, u8, *[u16] * 5])
    kinds = []
    for use in table.users:
        ports = use.leaf.ports
        if ports:
            members = []
            for port in ports:
                counted = (use.leaf.id, port.name) in table.bindings.counted_ports
                members += [port_size(port), *[pointer] * counted]
            struct = struct_size(members)
            sources = array(u16, room.uses * len(ports))
            kinds.append(array(struct_size([array(struct, room.uses), sources, array(u16, room.uses)]), SLOTS))
    return struct_size(
        [
            struct_size([array(tree, SLOTS), array(u64, SLOTS), u8, u8]),
            array(node, SLOTS * room.nodes),
            array(u32, SLOTS * room.parameters),
            array(pointer, SLOTS * max(1, len(table.scripts))),
            array(u8, SLOTS * max(1, room.texts)),
            array(u16, max(1, len(table.users))),
            *kinds,
        ]
    )


def catalogue_size(table: Table) -> int:
    """Bytes of constant tables that describe the firmware to images."""
    ports = sum(len(use.leaf.ports) for use in table.users)
    bases = sum(len(use.nodes) for use in table.users if use.leaf.ports)
    entries = len(table.bindings.entries)
    return 56 * len(table.users) + 8 * ports + 8 * bases + 8 * len(table.scripts) + 16 * entries + 104


def image_cost(table: Table, room: Room) -> ImageCost:
    """What the budget adds for images."""
    return ImageCost(room.nodes, room.words, memory_size(table, room), catalogue_size(table))
