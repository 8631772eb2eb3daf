# SPDX-License-Identifier: MIT
"""Where a signal's bits lie in a frame, and the C expressions that take them out and put them in. Shifts and masks only:
bit-fields have no defined layout."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from canopy.compiler.bus_reader import Message, Signal


@dataclass(frozen=True)
class Segment:
    """`bits` bits in a row: from bit `low` of byte `byte` upwards, they are the signal's bits from `shift` upwards."""

    byte: int
    low: int
    bits: int
    shift: int


def _positions(signal: Signal) -> Iterator[tuple[int, int]]:
    """(byte, bit) of each bit of the signal, the least significant first."""
    if signal.little_endian:
        yield from (divmod(signal.start + index, 8) for index in range(signal.length))
        return
    # Motorola: `start` is the most significant bit; the next lower one is to its right, then bit 7 of the next byte.
    place = 8 * (signal.start // 8) + 7 - signal.start % 8
    for index in range(signal.length - 1, -1, -1):
        byte, from_left = divmod(place + index, 8)
        yield byte, 7 - from_left


def segments(signal: Signal) -> tuple[Segment, ...]:
    """The signal's bits, grouped by byte, the least significant first."""
    result: list[Segment] = []
    for shift, (byte, bit) in enumerate(_positions(signal)):
        if result and result[-1].byte == byte and bit == result[-1].low + result[-1].bits:
            last = result.pop()
            result.append(Segment(byte, last.low, last.bits + 1, last.shift))
        else:
            result.append(Segment(byte, bit, 1, shift))
    return tuple(result)


def carrier(signal: Signal) -> str:
    """The unsigned C type in which the signal's raw bits are put together."""
    return "uint32_t" if signal.length <= 32 else "uint64_t"


def value_type(signal: Signal) -> str:
    """The C type in which a raw value is computed with and handed to a setter: it holds the whole raw range."""
    if signal.is_bool:
        return "bool"
    low, high = signal.limits
    if low >= -(2**31) and high < 2**31:
        return "int32_t"
    return "int64_t" if high < 2**63 else "uint64_t"


def number(value: int, c_type: str) -> str:
    """A C literal of that type."""
    macro = {"int32_t": "INT32_C", "int64_t": "INT64_C", "uint64_t": "UINT64_C"}[c_type]
    if value in (-(2**31), -(2**63)):
        return f"({macro}({value + 1}) - 1)"
    return f"{macro}({value})"


def decode_expression(signal: Signal) -> str:
    """C: the signal's raw value out of `data`, as value_type(signal)."""
    unsigned = carrier(signal)
    terms = []
    for part in segments(signal):
        term = f"data[{part.byte}]"
        if part.low:
            term = f"({term} >> {part.low})"
        if part.low + part.bits < 8:
            term = f"({term} & 0x{2**part.bits - 1:X}u)"
        term = f"({unsigned}){term}"
        terms.append(f"({term} << {part.shift})" if part.shift else term)
    raw = " | ".join(terms)
    if signal.is_bool:
        return f"({raw}) != 0u"
    kind = value_type(signal)
    if signal.signed and signal.length not in (32, 64):
        return f"canopy_sign_extend{unsigned[4:6]}({raw}, {signal.length}u)"
    return f"({kind})({raw})"


def encode_lines(message: Message) -> tuple[str, ...]:
    """C: one right-hand side for each byte of `data`, from variables named as the signals."""
    terms: list[list[str]] = [[] for _ in range(message.length)]
    for signal in message.signals:
        for part in segments(signal):
            term = signal.c_name
            if part.shift:
                term = f"({term} >> {part.shift})"
            term = f"({term} & 0x{2**part.bits - 1:X}u)"
            terms[part.byte].append(f"({term} << {part.low})" if part.low else term)
    return tuple(f"(uint8_t)({' | '.join(byte)})" if byte else "0" for byte in terms)


def range_test(signal: Signal) -> str:
    """C: is the decoded value outside the DBC's range? Empty when every value of the bits is allowed."""
    if signal.is_bool:
        return ""
    least, most = signal.limits
    kind = value_type(signal)
    tests = []
    if signal.low > least:
        tests.append(f"{signal.c_name} < {number(signal.low, kind)}")
    if signal.high < most:
        tests.append(f"{signal.c_name} > {number(signal.high, kind)}")
    return " || ".join(tests)
