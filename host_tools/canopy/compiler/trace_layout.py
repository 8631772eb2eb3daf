# SPDX-License-Identifier: MIT
"""The layout of the trace's messages, which the DBC has to describe as it is."""

from __future__ import annotations

from typing import Any

from canopy.compiler.errors import CompileError, Place

# Layout of the trace's messages: signal -> (start bit, length), all little-endian and unsigned. The runtime's trace.c
# writes these bits; the DBC must say the same, so that other tools read them right.
TRACE_LAYOUT: dict[str, dict[str, tuple[int, int]]] = {
    "CanopyTick": {
        "Sequence": (0, 8),
        "Tick": (8, 32),
        "RootStatus": (40, 4),
        "Tree": (44, 4),
        "Changes": (48, 8),
        "Overruns": (56, 8),
    },
    "CanopyInputs": {"Now": (0, 48), "Taken": (48, 8), "Check": (56, 8)},
    "CanopyArrivals": {
        "CanState": (0, 3),
        "Overload": (3, 1),
        "Count": (4, 2),
        "Returning": (6, 1),
        "Age0": (8, 16),
        "Age1": (24, 16),
        "Age2": (40, 16),
        "Tick": (56, 8),
    },
    "CanopyChange": {
        "Sequence": (0, 8),
        "NodeA": (8, 16),
        "NodeB": (24, 16),
        "StatusA": (40, 4),
        "StatusB": (44, 4),
        "Tree": (48, 4),
    },
    "CanopySnapshot": {
        "Sequence": (0, 8),
        "First": (8, 16),
        **{f"Status{place}": (24 + 4 * place, 4) for place in range(10)},
    },
    "CanopyHealth": {"RxRejected": (0, 16), "RxUnknown": (16, 16), "TxDropped": (32, 16), "Faults": (48, 16)},
    "CanopyModel": {"Hash": (0, 32), "Nodes": (32, 16)},
}


def trace_kind(name: str) -> str | None:
    """Which trace message a message of the DBC is by its name: `CanopyTick`, or `CanopyTick_` and any more.

    Names are unique in a DBC, and each node that runs a tree has trace messages of its own.
    """
    kind = name.partition("_")[0]
    return kind if kind in TRACE_LAYOUT else None


def check_trace(place: Place, message: Any, kind: str) -> None:
    """Raises CompileError when a message of the DBC has another layout than the trace message that its name says."""
    layout = {s.name: (s.start, s.length) for s in message.signals if s.byte_order == "little_endian"}
    wanted = TRACE_LAYOUT[kind]
    if message.length != 8 or layout != wanted or any(s.is_signed for s in message.signals):
        rows = ", ".join(f"{name} {start}|{length}@1+" for name, (start, length) in wanted.items())
        raise CompileError(place, f"message '{message.name}' must have 8 bytes and these signals: {rows}")
