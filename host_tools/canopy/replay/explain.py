# SPDX-License-Identifier: MIT
"""What two frames of a message differ in: by signal, or by node."""

from __future__ import annotations

from canopy.bus.decode import UndecodableError, physical, raw_values
from canopy.compiler.bus_model import Message
from canopy.replay.log import Bus
from canopy.trace import status_name

_SNAPSHOT_NODES = 10
_NO_NODE = 0xFFFF
_NO_STATUS = 15


def explain(bus: Bus, message: int, recorded: bytes, replayed: bytes) -> list[tuple[str, str, str]]:
    """Signal or node, what the log has, what the replay has; the frame's bytes where they cannot be decoded.

    Args:
        bus: The controller's.
        message: Key of a message that it sends.
        recorded: Of the log.
        replayed: Of the replay.
    """
    kind = bus.trace.get(message)
    if kind in ("CanopyChange", "CanopySnapshot"):
        read = _changes if kind == "CanopyChange" else _snapshot
        return _explain_nodes(bus, read(recorded), read(replayed))
    was, now = _decode(bus.sent[message], recorded), _decode(bus.sent[message], replayed)
    names = [name for name in was if was[name] != now.get(name)]
    values = [name for name in names if not name.startswith("E2E_")] or names
    found = [(name, was[name], now.get(name, "none")) for name in values]
    return found or [("frame", recorded.hex(" "), replayed.hex(" "))]


def _explain_nodes(bus: Bus, was: dict[int, str], now: dict[int, str]) -> list[tuple[str, str, str]]:
    nodes = bus.model.nodes
    found = []
    for node in sorted(was.keys() | now.keys()):
        if was.get(node) != now.get(node):
            name = f"node {node}" + (f" '{nodes[node].name}'" if node < len(nodes) else "")
            found.append((name, was.get(node, "not in this frame"), now.get(node, "not in this frame")))
    return found or [("Sequence", "another one", "another one")]


def _decode(message: Message, data: bytes) -> dict[str, str]:
    try:
        raw = raw_values(message, data)
    except UndecodableError:
        return {"frame": data.hex(" ")}
    signals = {signal.name: signal for signal in message.signals}
    values = {name: physical(signals[name], value) for name, value in raw.items()}
    return {
        name: f"{value} ({raw[name]})" if isinstance(value, str) else f"{value:g}" for name, value in values.items()
    }


def _status(code: int) -> str:
    try:
        return status_name(code)
    except ValueError:
        return f"code {code}"


def _changes(data: bytes) -> dict[int, str]:
    pairs = (
        (int.from_bytes(data[1:3], "little"), data[5] & 15),
        (int.from_bytes(data[3:5], "little"), data[5] >> 4),
    )
    return {node: _status(code) for node, code in pairs if node != _NO_NODE}


def _snapshot(data: bytes) -> dict[int, str]:
    first = int.from_bytes(data[1:3], "little")
    codes = [(byte >> shift) & 15 for byte in data[3:] for shift in (0, 4)]
    return {first + place: _status(code) for place, code in enumerate(codes) if code != _NO_STATUS}
