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
from canopy.compiler.bus_timing import can_load_percent
from canopy.compiler.leaf_c import entry_type, item_type
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.table import Table
from canopy.compiler.trace import Trace
from canopy.compiler.tree import Node

# (size, alignment) on a 32-bit target with 8-byte alignment of 64-bit integers: Arm EABI and RISC-V ILP32.
SIZES = {"bool": 1, "int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4, "uint32_t": 4}
NODE_FLASH = 12  # sizeof(canopy_node_t)
NODE_RAM = 1  # its status
TRACED_NODE_RAM = 2  # and the one that the trace told last
WORD_RAM = 2
MAILBOXES_MAX = 4  # CANOPY_CAN_MAILBOXES_MAX
"""Enough for a bus-off at a period of 50 ms or more: the first restart comes after 50 ms."""
SIZES |= {"int64_t": 8, "uint64_t": 8, "pointer": 4, "float": 4, "double": 8}


def struct_size(members: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """(size, alignment) of a struct of members given as (size, alignment)."""
    size, alignment = 0, 1
    for member_size, member_alignment in members:
        size = -(-size // member_alignment) * member_alignment + member_size
        alignment = max(alignment, member_alignment)
    return -(-size // alignment) * alignment, alignment


def scalar(c_type: str) -> tuple[int, int]:
    """(size, alignment) of a scalar type, or of a value of any type."""
    if c_type == "canopy_value_t":
        return struct_size([(4, 4), (8, 8), (8, 8), (4, 4)])
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
    """Every cyclic message of the DBC, and the trace of a tree in which nothing changes."""
    trace_load_percent: tuple[float, float] | None
    """Of that the trace, and the trace when everything changes in every tick, as far as it may; None: there is none."""
    trace_ram_bytes: int
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


def _trace_ring(capacity: int) -> tuple[int, int]:
    u8, u32, u64 = (scalar(t) for t in ("uint8_t", "uint32_t", "uint64_t"))
    return array(struct_size([u64, u32, *[u8] * 9]), capacity)


def ram_bytes(table: Table, bus: Bus, images: ImageCost, trace: Trace | None) -> int:
    """Size of the application's static object: the struct that the template application.c.j2 declares."""
    u8, u16, u32, u64, pointer = (scalar(t) for t in ("uint8_t", "uint16_t", "uint32_t", "uint64_t", "pointer"))
    nodes = max(len(table.rows), images.nodes)
    outputs = sum(len(message.signals) for message in bus.send)
    instance = struct_size([*[pointer] * 4, u64, u32, u16])
    bus_state = struct_size([*[pointer] * 4, *[u32] * 8, u8, u16])
    trace_state = struct_size([pointer, pointer, u32, u32, *[u16] * 8, *[u8] * 4])
    rx_state = struct_size([u64, *[u8] * 6, u16])
    tx_slot = struct_size([array(u64, 2), *[u32] * 5, *[u8] * 4])
    tx_mailbox = struct_size([u64, u32, u16, u8])
    tx = struct_size(
        [
            *[pointer] * 5,
            u32,
            u16,
            u8,
            *[u32] * 4,
            *[u8] * 6,
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
            *([trace_state] if trace is not None else []),
            tx,
            array(tx_slot, max(1, len(bus.send))),
            _trace_ring(trace.capacity if trace is not None else 1),
            image_in,
            image_out,
            entries_size(table),
            array(rx_state, max(1, len(bus.receive))),
            array(u16, max(1, table.words, images.words)),
            array(u32, -(-nodes // 4)),
            *([array(u32, -(-nodes // 4))] if trace is not None else []),
            *([array(u32, trace.slots)] if trace is not None and trace.slots else []),
            array(u8, max(1, 2 * sum(message.length for message in bus.send))),
            *(array(u8, len(use.nodes)) for use in table.leaves if use.leaf.reasons),
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


def kind_costs(table: Table, node_ram: int) -> tuple[KindCost, ...]:
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
            node_ram + WORD_RAM * node.type.words,
            NODE_FLASH + (_ports_size(node.leaf) if node.leaf is not None else 0),
        )
        for kind, node in first.items()
    ]
    return tuple(sorted(costs, key=lambda cost: (-cost.nodes * cost.flash_each, cost.kind)))


def flash_bytes(table: Table, bus: Bus, trace: Trace | None) -> int:
    """Size of the constant tables: nodes, leaves, parameters, ports, messages."""
    pointer, u8, u16, u32, u64 = (scalar(t) for t in ("pointer", "uint8_t", "uint16_t", "uint32_t", "uint64_t"))
    ports = sum(_ports_size(use.leaf) * len(use.nodes) for use in table.users)
    rx = struct_size([u32, u8, u8, u32, u64, pointer, pointer])[0] * len(bus.receive)
    tx = struct_size([u32, u8, u8, u32, u16, u16, u64, pointer])[0] * len(bus.send)
    accepted = 4 * len(bus.receive) + 12
    tables = accepted + NODE_FLASH * len(table.rows) + 12 * table.leaf_count + 12 * len(table.controls)
    numbers = 4 * (len(table.parameters) + len(table.scripts) + len(table.bindings.texts))
    traced = 8 * trace.slots + struct_size([u32, u8, u8, u8, u32, *[u16] * 5, pointer])[0] if trace is not None else 0
    return tables + numbers + ports + rx + tx + traced


def make_budget(
    table: Table,
    bus: Bus,
    period_ms: int,
    trace: Trace | None,
    bitrate: int,
    others: Others,
    images: ImageCost | None = None,
) -> Budget:
    """The whole budget. A tick visits each node at most once, so it calls each leaf once at most (semantics.md)."""
    images = images or ImageCost()
    ram = ram_bytes(table, bus, images, trace)
    loads = None
    if trace is not None:
        idle, most = (trace.load_percent(period_ms, bitrate, worst=worst) for worst in (False, True))
        loads = (idle, most)
    return Budget(
        ram_bytes=ram,
        flash_bytes=flash_bytes(table, bus, trace) + images.tables,
        nodes=len(table.rows),
        worst_tick_leaf_calls=sum(len(use.nodes) for use in table.leaves),
        max_depth=max(row.depth for row in table.rows),
        can_load_percent=round(can_load_percent(bus, bitrate) + (loads[0] if loads else 0), 2),
        trace_load_percent=loads,
        trace_ram_bytes=ram - ram_bytes(table, bus, images, None),
        bitrate=bitrate,
        kinds=kind_costs(table, TRACED_NODE_RAM if trace is not None else NODE_RAM),
        bounds=make_bounds(bus, bitrate, others, trace.frames_max if trace is not None else 0),
    )
