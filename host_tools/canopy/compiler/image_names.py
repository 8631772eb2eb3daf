# SPDX-License-Identifier: MIT
"""What tree images and firmware agree on by hash: node types, the user's nodes, scripts, entries, connected ports.

A signature is a text that says all that must be the same; its hash stands in images and in the firmware's catalogue.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import asdict

from canopy.compiler.blackboard import Entry, SignalName
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.node_types import node_types
from canopy.compiler.port_types import PortType
from canopy.compiler.table import Table
from canopy.compiler.tree import Bound, Script


def hash64(text: str) -> int:
    """The first 8 bytes of SHA-256, little-endian; never 0, which means "none" in images."""
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") or 1


def engine_hash() -> int:
    """Changes when nodes.def changes what a table means."""
    rows = [asdict(node_type) | {"text": ""} for node_type in node_types().values()]
    return hash64(repr(rows))


def type_signature(kind: PortType) -> str:
    """The type, as far as C knows it; of the user's own types only the name."""
    step = f"*{kind.scale}" if kind.kind == "fixed" else ""
    return f"{kind.kind} {kind.c}{step}"


def leaf_signature(leaf: Leaf) -> str:
    """Kind, ports, and all that the generated code around the user's functions depends on."""
    ports = ", ".join(f"{port.direction} {type_signature(port.type)} {port.name}" for port in leaf.ports)
    reads = " ".join(sorted(leaf.reads)) or "nothing"
    writes = "something" if leaf.writes else "nothing"
    return (
        f"{leaf.kind} {leaf.id}({ports}) reads {reads}, {leaf.stale} when stale, "
        f"writes {writes}, state {leaf.state or 'none'}"
    )


def entry_signature(entry: Entry) -> str:
    """Name, place, type and first value."""
    first = "" if entry.initial is None else f" = {entry.initial!r}"
    path = f"{entry.path}/" if entry.path else ""
    return f"{type_signature(entry.type)} {path}{entry.name}{first} ({entry.c_name})"


def script_signature(script: Script, texts: tuple[str, ...]) -> str:
    """The C of the script, and what the numbers in it may mean where these are places in the table of texts."""
    body = "\n".join(script.body)
    numbers = sorted({int(number) for number in re.findall(r"\b(\d+)u\b", body)})
    meant = [(number, texts[number]) for number in numbers if number < len(texts)]
    return f"{body}\n{meant!r}"


def target_of(bound: Bound) -> Entry | SignalName | str | None:
    """What a port is connected to; a text for a constant, also for an entry that nothing writes."""
    if isinstance(bound.target, Entry) and bound.target.is_constant:
        return bound.target.initial or ""
    return bound.target if bound.target is not None else bound.text


def is_fixed(port: Port, bound: Bound) -> bool:
    """Only firmware can connect this: signals, texts that change, constants of the user's own types, and a NULL."""
    target = target_of(bound)
    if target is None:
        return not port.writes and port.type.kind in ("text", "user")
    if isinstance(target, SignalName):
        return True
    if isinstance(target, Entry):
        return port.type.kind == "text" and not port.writes
    return port.type.kind == "user"


def base_signature(table: Table, use_index: int, node_index: int) -> str:
    """What of a use only firmware can connect; "" if nothing. Both indices count in table.users and its nodes."""
    use = table.users[use_index]
    fixed = [
        (port.name, c.constant, c.copy)
        for port, bound, c in zip(use.leaf.ports, use.nodes[node_index].bound, use.ports[node_index], strict=True)
        if is_fixed(port, bound)
    ]
    return f"{leaf_signature(use.leaf)} {fixed!r}" if fixed else ""
