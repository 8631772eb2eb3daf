# SPDX-License-Identifier: MIT
"""The layout of the trace's messages (docs/trace.md), and the DBC that tells it to other tools.

The runtime's trace files write these bits, and `canopy.trace` reads them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from canopy.compiler.names import is_c_identifier

VERSION = 2
"""CANOPY_TRACE_VERSION."""


@dataclass(frozen=True)
class Field:
    """A signal of a trace message, little-endian and unsigned. `page`: of a message with pages, the one that has it."""

    name: str
    start: int
    length: int
    unit: str = ""
    factor: int = 1
    page: int | None = None


def _fields(*rows: tuple[str, int, int]) -> tuple[Field, ...]:
    return tuple(Field(*row) for row in rows)


def _counters(page: int, *rows: tuple[str, int, int]) -> tuple[Field, ...]:
    return tuple(Field(name, start, length, page=page) for name, start, length in rows)


MESSAGES: dict[str, tuple[Field, ...]] = {
    "CanopyTick": _fields(
        ("Crc", 0, 8),
        ("Counter", 8, 4),
        ("Version", 12, 4),
        ("Tick", 16, 32),
        ("Sequence", 48, 6),
        ("HasSnapshot", 54, 1),
        ("HasChanges", 55, 1),
        ("RootStatus", 56, 3),
        ("Values", 59, 3),
        ("Overruns", 62, 2),
    ),
    "CanopyInputs": (
        Field("Now", 0, 24, "us"),
        *_fields(
            ("Taken", 24, 8),
            ("Check", 32, 8),
            ("CanState", 40, 3),
            ("Overload", 43, 1),
            ("Returning", 44, 1),
            ("Ages", 45, 2),
            ("Many", 47, 1),
            ("Age0", 48, 8),
            ("Age1", 56, 8),
        ),
    ),
    "CanopyArrivals": _fields(
        ("Tick", 0, 4), ("Bytes", 4, 3), ("Last", 7, 1), *((f"Age{place}", 8 + 8 * place, 8) for place in range(7))
    ),
    "CanopySnapshot": _fields(
        ("Sequence", 0, 6),
        ("Part", 8, 13),
        ("Tick", 21, 3),
        *((f"Status{place}", 24 + 4 * place, 4) for place in range(10)),
    ),
    "CanopyChange": _fields(
        ("Sequence", 0, 6),
        ("More", 6, 2),
        ("Block", 8, 12),
        ("Tick", 20, 4),
        *(
            row
            for place in range(5)
            for row in ((f"Code{place}", 24 + 8 * place, 4), (f"Gap{place}", 28 + 8 * place, 4))
        ),
    ),
    "CanopyValue": _fields(("Slot", 0, 12), ("Tick", 12, 4), ("More", 16, 1), ("Value", 32, 32)),
    "CanopyHealth": (
        *_fields(("Page", 0, 4)),
        *_counters(0, ("Filtered", 4, 1), ("RxRejected", 8, 16), ("RxUnknown", 24, 16), ("RxLost", 40, 16)),
        *_counters(0, ("RxBacklogs", 56, 8)),
        *_counters(1, ("TxReplaced", 8, 16), ("TxExpired", 24, 16), ("TraceDropped", 40, 16), ("Restarts", 56, 8)),
        *_counters(2, ("Overruns", 8, 16)),
        Field("LongestCycle", 24, 24, "us", page=2),
        Field("LatestStart", 48, 16, "us", 10, page=2),
        *_counters(3, *((f"Late{place}", 8 + 4 * place, 4) for place in range(12)), ("Slips", 56, 8)),
        *_counters(4, ("LeafFaults", 8, 16), ("RxErrors", 24, 16), ("Timeouts", 40, 16)),
    ),
    "CanopyModel": (
        *_fields(("Page", 0, 4), ("Version", 4, 4)),
        *_counters(0, ("Hash", 8, 32), ("Nodes", 40, 16)),
        *_counters(1, ("TickLow", 8, 16)),
        Field("NowUpper", 24, 24, page=1),
    ),
}
"""In the order of their arbitration ids."""

IDS = {message: offset for offset, message in enumerate(MESSAGES)}
"""Message -> what its arbitration id is above CanopyTick's."""


def _lines(base: int, extended: bool, node: str) -> Iterator[str]:
    sender = node if is_c_identifier(node) else "Controller"
    yield 'VERSION ""'
    yield "NS_ :"
    yield "BS_:"
    yield f"BU_: {sender}"
    for message, fields in MESSAGES.items():
        yield ""
        yield f"BO_ {base + IDS[message] + (0x80000000 if extended else 0)} {message}: 8 {sender}"
        paged = any(field.page is not None for field in fields)
        for field in fields:
            page = "" if field.page is None else f" m{field.page}"
            page = " M" if paged and field.name == "Page" else page
            yield (
                f' SG_ {field.name}{page} : {field.start}|{field.length}@1+ ({field.factor},0) [0|0] "{field.unit}" '
                "Vector__XXX"
            )


def dbc(base: int, extended: bool, node: str) -> str:
    """A DBC of the trace of one controller, for cantools, candump's decoders and other tools."""
    return "\n".join(_lines(base, extended, node)) + "\n"
