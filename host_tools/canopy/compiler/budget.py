# SPDX-License-Identifier: MIT
"""What an application costs: RAM and constant tables on a 32-bit target, leaf calls in the worst tick, bus load.

RAM and flash are those of the generated tables and of the one static object; the sizes of the user's own state types
are not known here, and code is not counted: the CMake target `sizes` measures what is linked.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass

from canopy.compiler.bounds import Bounds, Others, make_bounds
from canopy.compiler.bus_reader import Bus, Message
from canopy.compiler.bus_timing import can_load_percent, trace_capacity, trace_frames
from canopy.compiler.leaf_c import entry_type, item_type
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.table import Table
from canopy.compiler.tree import Node

# (size, alignment) on a 32-bit target with 8-byte alignment of 64-bit integers: Arm EABI and RISC-V ILP32.
SIZES = {"bool": 1, "int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4, "uint32_t": 4}
NODE_FLASH = 12  # sizeof(canopy_node_t)
NODE_RAM = 2  # its status, and the one that the trace sent last
WORD_RAM = 2
MAILBOXES_MAX = 4  # CANOPY_CAN_MAILBOXES_MAX
SIZES |= {"int64_t": 8, "uint64_t": 8, "pointer": 4, "float": 4, "double": 8}


def struct_size(members: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """(size, alignment) of a struct of members given as (size, alignment)."""
    size, alignment = 0, 1
    for member_size, member_alignment in members:
        size = -(-size // member_alignment) * member_alignment + member_size
        alignment = max(alignment, member_alignment)
    return -(-size // alignment) * alignment, alignment


def scalar(c_type: str) -> tuple[int, int]:
    """(size, alignment) of a scalar type."""
    return SIZES[c_type], SIZES[c_type]


def array(element: tuple[int, int], count: int) -> tuple[int, int]:
    """(size, alignment) of an array."""
    return element[0] * count, element[1]


@dataclass(frozen=True)
class KindCost:
    """What the nodes of one kind cost: so many, and [bytes] of RAM and of constant tables each."""

    kind: str
    nodes: int
    ram_each: int
    flash_each: int


@dataclass(frozen=True)
class Budget:
    """The figures that are printed and written to the model file. `kinds`: the dearest in flash first."""

    ram_bytes: int
    flash_bytes: int
    nodes: int
    worst_tick_leaf_calls: int
    max_depth: int
    can_load_percent: float
    bitrate: int
    kinds: tuple[KindCost, ...]
    bounds: Bounds

    def as_dict(self) -> dict[str, object]:
        """For the model file."""
        return asdict(self)


def _message_struct(message: Message, *, received: bool) -> tuple[int, int]:
    members = [scalar(signal.c_type) for signal in message.signals]
    if received:
        members += [scalar("bool")] * len(message.multiplexed) + [scalar("uint16_t"), scalar("bool")]
    return struct_size(members)


@dataclass(frozen=True)
class ImageCost:
    """What tree images add: nodes and words at least, a member of the static object (size, alignment), and tables."""

    nodes: int = 0
    words: int = 0
    memory: tuple[int, int] = (0, 1)
    tables: int = 0


def ram_bytes(table: Table, bus: Bus, images: ImageCost, changes_max: int) -> int:
    """Size of the application's static object: the struct that the template application.c.j2 declares."""
    u8, u16, u32, u64, pointer = (scalar(t) for t in ("uint8_t", "uint16_t", "uint32_t", "uint64_t", "pointer"))
    nodes = max(len(table.rows), images.nodes)
    outputs = sum(len(message.signals) for message in bus.send)
    instance = struct_size([*[pointer] * 4, u64, u32, u16])
    bus_state = struct_size([*[pointer] * 6, *[u32] * 7, u8, u8])
    trace_state = struct_size([pointer, u16, u8, u8])
    transport = struct_size([u64, u64, u16, u16, u8, u8])
    rx_state = struct_size([u64, *[u8] * 6, u16])
    tx_slot = struct_size([array(u64, 2), *[u32] * 4, *[u8] * 3])
    tx_trace = struct_size([u64, u32, *[u8] * 9])
    tx_mailbox = struct_size([u64, u32, u16, u8])
    tx = struct_size(
        [
            *[pointer] * 5,
            u32,
            u16,
            u8,
            *[u32] * 3,
            *[u8] * 4,
            u64,
            array(tx_mailbox, MAILBOXES_MAX),
            *[u32] * 5,
        ]
    )
    image_in = struct_size([u64, u8, u8, *(_message_struct(m, received=True) for m in bus.receive)])
    image_out = struct_size(
        [array(u32, max(1, -(-outputs // 32))), u32, u8, *(_message_struct(m, received=False) for m in bus.send)]
    )
    return struct_size(
        [
            instance,
            bus_state,
            trace_state,
            tx,
            array(tx_slot, max(1, len(bus.send))),
            array(tx_trace, trace_capacity(bus, changes_max)),
            image_in,
            image_out,
            entries_size(table),
            array(rx_state, max(1, len(bus.receive))),
            array(transport, len(bus.transported)),
            array(u16, max(1, table.words, images.words)),
            array(u8, nodes),
            array(u8, nodes),
            array(u8, max(1, 2 * sum(message.length for message in bus.send))),
            array(u8, sum(message.length for message in bus.transported)),
            images.memory,
        ]
    )[0]


def port_size(port: Port) -> tuple[int, int]:
    """A port's member: a pointer for outputs, texts and types of the user's."""
    return scalar("pointer" if port.writes or port.type.kind in ("text", "user") else port.type.c)


def entries_size(table: Table) -> tuple[int, int]:
    """The blackboard. Entries of the user's own types are not counted."""
    members = []
    for entry in table.bindings.entries:
        if entry.type.capacity:
            members.append(struct_size([scalar("uint16_t"), array(scalar(item_type(entry.type)), entry.type.capacity)]))
        elif entry.type.kind != "user":
            members.append(scalar(entry_type(entry)))
        if entry.counted:
            members.append(scalar("uint32_t"))
    return struct_size([*members, scalar("uint32_t")]) if members or table.scripts else (0, 1)


def _ports_size(leaf: Leaf) -> int:
    return struct_size(port_size(port) for port in leaf.ports)[0] if leaf.ports else 0


def kind_costs(table: Table) -> tuple[KindCost, ...]:
    """What each kind of node costs. Parameters, scripts and functions are shared, and not counted here."""
    first: dict[str, Node] = {}
    count: Counter[str] = Counter()
    for row in table.rows:
        kind = row.node.xml_name or row.node.type.name
        first.setdefault(kind, row.node)
        count[kind] += 1
    costs = [
        KindCost(
            kind,
            count[kind],
            NODE_RAM + WORD_RAM * node.type.words,
            NODE_FLASH + (_ports_size(node.leaf) if node.leaf is not None else 0),
        )
        for kind, node in first.items()
    ]
    return tuple(sorted(costs, key=lambda cost: (-cost.nodes * cost.flash_each, cost.kind)))


def flash_bytes(table: Table, bus: Bus) -> int:
    """Size of the constant tables: nodes, leaves, parameters, ports, messages."""
    pointer, u8, u16, u32, u64 = (scalar(t) for t in ("pointer", "uint8_t", "uint16_t", "uint32_t", "uint64_t"))
    ports = sum(_ports_size(use.leaf) * len(use.nodes) for use in table.users)
    rx = struct_size([u32, u32, u16, u8, u8, u32, u64, pointer, pointer])[0] * len(bus.receive)
    tx = struct_size([u32, u8, u8, u32, u16, u16, u64, pointer])[0] * len(bus.send)
    masked = sum(not message.is_exact for message in bus.receive)
    accepted = 4 * (len(bus.receive) + masked) + 20 + (16 + 4 * len(bus.transported) if bus.transported else 0)
    tables = accepted + NODE_FLASH * len(table.rows) + 12 * table.leaf_count + 12 * len(table.controls)
    numbers = 4 * (len(table.parameters) + len(table.scripts) + len(table.bindings.texts))
    return tables + numbers + ports + rx + tx


def make_budget(
    table: Table,
    bus: Bus,
    period_ms: int,
    changes_max: int,
    bitrate: int,
    others: Others,
    images: ImageCost | None = None,
) -> Budget:
    """The whole budget. A tick visits each node at most once, so it calls each leaf once at most (semantics.md)."""
    images = images or ImageCost()
    return Budget(
        ram_bytes=ram_bytes(table, bus, images, changes_max),
        flash_bytes=flash_bytes(table, bus) + images.tables,
        nodes=len(table.rows),
        worst_tick_leaf_calls=sum(len(use.nodes) for use in table.leaves),
        max_depth=max(row.depth for row in table.rows),
        can_load_percent=can_load_percent(bus, period_ms, changes_max, bitrate),
        bitrate=bitrate,
        kinds=kind_costs(table),
        bounds=make_bounds(bus, bitrate, others, trace_frames(bus, changes_max)),
    )
