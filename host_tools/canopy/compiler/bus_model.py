# SPDX-License-Identifier: MIT
"""Signals, messages and the bus, as the code generator needs them. Values are raw unless a name says physical."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from canopy.compiler.dbc_file import Dbc

FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""What a CAN FD frame can carry (ISO 11898-1, DLC 0..15)."""

INTEGER_LIMITS = {
    f"{'u' if low == 0 else ''}int{bits}_t": (low, high)
    for bits in (8, 16, 32, 64)
    for low, high in ((0, 2**bits - 1), (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
}
"""C type -> (smallest, largest)."""

Ranges = tuple[tuple[int, int], ...]
"""Disjoint ranges of whole numbers, both ends included, ascending."""


def merge(ranges: Iterable[tuple[int, int]]) -> Ranges:
    """The same numbers in as few ranges as can be."""
    result: list[tuple[int, int]] = []
    for low, high in sorted(ranges):
        if result and low <= result[-1][1] + 1:
            result[-1] = (result[-1][0], max(high, result[-1][1]))
        else:
            result.append((low, high))
    return tuple(result)


def cut(ranges: Ranges, low: int, high: int) -> Ranges:
    """What of the ranges lies in low..high."""
    return tuple((max(a, low), min(b, high)) for a, b in ranges if a <= high and b >= low)


@dataclass(frozen=True)
class Selector:
    """A multiplexed signal is in a frame when the multiplexer `signal` of its message has a value in `values`."""

    signal: str
    values: Ranges


@dataclass(frozen=True)
class Enumerator:
    """A value that the DBC's table names. `c_name` is the whole name of the C constant, without the bus's prefix."""

    value: int
    text: str
    c_name: str


@dataclass(frozen=True)
class Signal:
    """A signal: physical value = raw * scale + offset.

    `low`, `high` and `safe` are raw: integers, or the bits of an IEEE number for a float signal.
    """

    name: str
    c_name: str
    start: int
    length: int
    little_endian: bool
    signed: bool
    is_float: bool
    scale: Decimal
    offset: Decimal
    low: int
    high: int
    safe: int
    unit: str
    comment: str
    choices: tuple[tuple[int, str], ...]
    enumerators: tuple[Enumerator, ...] = ()
    selectors: tuple[Selector, ...] = ()
    """Multiplexed: all of these hold when the signal is in the frame; the outermost multiplexer first."""
    selects: Ranges = ()
    """A multiplexer: the values that it may have."""
    has_name: str = ""
    """Multiplexed: the C name of the flag that says whether the signal has come."""

    @property
    def is_enum(self) -> bool:
        """A value table makes an enum, unless the signal is a quantity.

        That is one with a unit, a scale, a table that names values outside the signal's range, or a float. There the
        table names exceptions (254 "Error"), and the signal stays a number.
        """
        if self.is_float:
            return False
        named = cut(merge((value, value) for value, _ in self.choices), *self.limits)
        return (
            bool(named)
            and named == cut(named, self.low, self.high)
            and not self.unit
            and self.scale == 1
            and self.offset == 0
            and all(-(2**31) <= value < 2**31 for value, _ in self.choices)
        )

    @property
    def exceptions(self) -> tuple[Enumerator, ...]:
        """The named values of a signal that stays a number."""
        if self.is_enum or self.is_float:
            return ()
        return tuple(named for named in self.enumerators if self.limits[0] <= named.value <= self.limits[1])

    @property
    def is_bool(self) -> bool:
        """One unsigned bit without a value table is a bool."""
        plain = self.scale == 1 and self.offset == 0 and (self.low, self.high) == (0, 1)
        return self.length == 1 and not self.signed and not self.choices and not self.selects and plain

    @property
    def is_strict(self) -> bool:
        """Only listed values may be sent: any other gives way to the safe one, not to the nearest."""
        return self.is_enum or bool(self.selects)

    @property
    def c_type(self) -> str:
        """The smallest C type that holds every raw value of the signal's bits."""
        if self.is_bool:
            return "bool"
        if self.is_float:
            return "float" if self.length == 32 else "double"
        bits = next(size for size in (8, 16, 32, 64) if self.length <= size)
        return f"{'' if self.signed else 'u'}int{bits}_t"

    @property
    def limits(self) -> tuple[int, int]:
        """Smallest and largest raw value that the signal's bits can hold. Not for floats."""
        if self.signed:
            return -(2 ** (self.length - 1)), 2 ** (self.length - 1) - 1
        return 0, 2**self.length - 1

    @property
    def is_unlimited(self) -> bool:
        """A float for which every finite number is in range."""
        ends = (float_bits(end, self.length) for end in (float("-inf"), float("inf")))
        return self.is_float and (self.low, self.high) == tuple(ends)

    @property
    def accepted(self) -> Ranges:
        """Raw values that are taken from the bus: the DBC's range, and what its table names. Not for floats."""
        if self.selects:
            return self.selects
        named = cut(merge((value, value) for value, _ in self.choices), *self.limits)
        return merge([(self.low, self.high), *named])

    @property
    def sendable(self) -> Ranges:
        """Raw values that may be sent. Not for floats."""
        if self.is_enum and not self.selects:
            return cut(merge((value, value) for value, _ in self.choices), *self.limits)
        return self.accepted


@dataclass(frozen=True)
class Message:
    """A message. `signals` are those that the application sees. Times in ms; 0: none.

    `length` is that of the frame: for CAN FD the next one that exists, with zeros at the end.
    """

    name: str
    c_name: str
    id: int
    extended: bool
    fd: bool
    length: int
    cycle_ms: int
    timeout_ms: int
    data_id: int | None
    signals: tuple[Signal, ...]
    comment: str

    @property
    def multiplexed(self) -> tuple[Signal, ...]:
        """The signals that are not in every frame."""
        return tuple(signal for signal in self.signals if signal.selectors)

    @property
    def has_floats(self) -> bool:
        """Is a signal an IEEE number?"""
        return any(signal.is_float for signal in self.signals)


@dataclass(frozen=True)
class Bus:
    """The bus as `node` sees it. `load` lists (frame length, extended, fd, cycle ms) of every cyclic message on it.

    `node` is "" for a codec of all messages: then each is in `receive` and in `send`. `source` is the file as it was
    read.
    """

    path: Path
    name: str
    node: str
    receive: tuple[Message, ...]
    send: tuple[Message, ...]
    source: Dbc = field(repr=False, compare=False)
    load: tuple[tuple[int, bool, bool, float], ...] = ()

    @property
    def messages(self) -> tuple[Message, ...]:
        """Every message that there is code for, each once."""
        return tuple({message.name: message for message in (*self.receive, *self.send)}.values())

    @property
    def received(self) -> frozenset[str]:
        """Names of the messages in `receive`."""
        return frozenset(message.name for message in self.receive)

    @property
    def sent(self) -> frozenset[str]:
        """Names of the messages in `send`."""
        return frozenset(message.name for message in self.send)

    @property
    def has_floats(self) -> bool:
        """Does the code need canopy/float_bits.h?"""
        return any(message.has_floats for message in self.messages)


def float_bits(value: float, length: int) -> int:
    """The IEEE number nearest to `value`, of 32 or 64 bits; beyond the largest finite one, that."""
    largest = (
        struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
        if length == 32
        else struct.unpack("<d", b"\xff" * 6 + b"\xef\x7f")[0]
    )
    value = max(-largest, min(largest, value)) + 0.0  # -0 becomes 0
    return int.from_bytes(struct.pack("<f" if length == 32 else "<d", value), "little")


def float_value(bits: int, length: int) -> float:
    """The number that has these bits."""
    result: float = struct.unpack("<f" if length == 32 else "<d", bits.to_bytes(length // 8, "little"))[0]
    return result
