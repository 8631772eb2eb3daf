# SPDX-License-Identifier: MIT
"""The trace's frames as their bits say, without a memory of other frames (docs/trace.md, Layout)."""

from __future__ import annotations

from typing import NamedTuple

from canopy.live.codes import NO_CODE

SNAPSHOT_NODES = 10
_BLOCK_NODES = 16
_SKIP_MAX = 13
_END = 15
_MORE_MAX = 2


class TickFrame(NamedTuple):
    """CanopyTick, without its protection."""

    version: int
    tick: int
    sequence: int
    has_snapshot: bool
    has_changes: bool
    root_status: int
    values: int
    overruns: int

    @staticmethod
    def read(data: bytes) -> TickFrame:
        """From 8 bytes."""
        return TickFrame(
            version=data[1] >> 4,
            tick=int.from_bytes(data[2:6], "little"),
            sequence=data[6] & 0x3F,
            has_snapshot=bool(data[6] & 0x40),
            has_changes=bool(data[6] & 0x80),
            root_status=data[7] & 7,
            values=data[7] >> 3 & 7,
            overruns=data[7] >> 6,
        )


class ArrivalsFrame(NamedTuple):
    """CanopyArrivals."""

    tick: int
    """Modulo 16."""
    is_last: bool
    ages: bytes
    """Of the list of ages."""

    @staticmethod
    def read(data: bytes) -> ArrivalsFrame | None:
        """From 8 bytes; None where they say what cannot be."""
        count = data[0] >> 4 & 7
        return ArrivalsFrame(data[0] & 15, bool(data[0] & 0x80), data[1 : 1 + count]) if count else None


class SnapshotFrame(NamedTuple):
    """CanopySnapshot."""

    sequence: int
    first: int
    tick: int
    """Modulo 8."""
    codes: tuple[int, ...]

    @staticmethod
    def read(data: bytes) -> SnapshotFrame:
        """From 8 bytes."""
        place = int.from_bytes(data[1:3], "little")
        codes = tuple(byte >> shift & 15 for byte in data[3:] for shift in (0, 4))
        return SnapshotFrame(data[0] & 0x3F, SNAPSHOT_NODES * (place & 0x1FFF), place >> 13, codes)


class ChangeFrame(NamedTuple):
    """CanopyChange."""

    sequence: int
    more: int
    """0: more of these frames follow; 1: the last one; 2: the last one, and nodes wait."""
    tick: int
    """Modulo 16."""
    nodes: tuple[int, ...]
    """Going up; one at least."""
    codes: tuple[int, ...]

    @staticmethod
    def read(data: bytes) -> ChangeFrame | None:
        """From 8 bytes; None where they say what cannot be."""
        place = int.from_bytes(data[1:3], "little")
        position = _BLOCK_NODES * (place & 0xFFF)
        nodes, codes = [], []
        for byte in data[3:]:
            code, gap = byte & 15, byte >> 4
            if code != NO_CODE:
                nodes.append(position + gap)
                codes.append(code)
                position += gap + 1
            elif gap <= _SKIP_MAX:
                position += _BLOCK_NODES * (gap + 1)
            elif gap == _END:
                break
            else:
                return None
        if not nodes or data[0] >> 6 > _MORE_MAX:
            return None
        return ChangeFrame(data[0] & 0x3F, data[0] >> 6, place >> 12, tuple(nodes), tuple(codes))


class ValueFrame(NamedTuple):
    """CanopyValue."""

    slot: int
    tick: int
    """Modulo 16."""
    more: bool
    """More slots have changed than fit."""
    bits: int
    """32 of them."""

    @staticmethod
    def read(data: bytes) -> ValueFrame:
        """From 8 bytes."""
        place = int.from_bytes(data[:2], "little")
        return ValueFrame(place & 0xFFF, place >> 12, bool(data[2] & 1), int.from_bytes(data[4:], "little"))
