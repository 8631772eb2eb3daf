# SPDX-License-Identifier: MIT
"""What two frames of a message differ in: by signal, or by node."""

from __future__ import annotations

from cantools.database.can import Message as DbcMessage

from canopy.live.codes import NO_CODE, code_name
from canopy.live.frames import ChangeFrame, SnapshotFrame, ValueFrame
from canopy.replay.log import Bus


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
    if kind == "CanopyValue":
        return _explain_values(bus, ValueFrame.read(recorded), ValueFrame.read(replayed))
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


def _decode(message: DbcMessage, data: bytes) -> dict[str, str]:
    try:
        raw = message.decode_simple(data, decode_choices=False, scaling=False)
        values = message.decode_simple(data)
    except Exception:
        # cantools: too short, an unknown multiplexer
        return {"frame": data.hex(" ")}
    return {
        name: f"{value} ({raw[name]})" if isinstance(value, str) or not isinstance(value, int | float) else f"{value:g}"
        for name, value in values.items()
    }


def _changes(data: bytes) -> dict[int, str]:
    frame = ChangeFrame.read(data)
    return dict(zip(frame.nodes, map(code_name, frame.codes), strict=True)) if frame is not None else {}


def _snapshot(data: bytes) -> dict[int, str]:
    frame = SnapshotFrame.read(data)
    return {frame.first + place: code_name(code) for place, code in enumerate(frame.codes) if code != NO_CODE}


def _explain_values(bus: Bus, was: ValueFrame, now: ValueFrame) -> list[tuple[str, str, str]]:
    names = {
        slot: value.title for value in bus.model.trace.values for slot in range(value.slot, value.slot + value.slots)
    }
    if was.slot == now.slot and was.bits != now.bits:
        return [(f"value '{names.get(was.slot, was.slot)}'", f"0x{was.bits:X}", f"0x{now.bits:X}")]
    return [("value", f"'{names.get(was.slot, was.slot)}'", f"'{names.get(now.slot, now.slot)}'")]
