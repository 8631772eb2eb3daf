# SPDX-License-Identifier: MIT
"""Where a signal's bits lie in a frame, and the C expressions that take them out and put them in.

Shifts and masks only: bit-fields have no defined layout.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

from canopy.compiler.bus_model import INTEGER_LIMITS, Bus, Message, Ranges, Signal, float_value
from canopy.escape.c import emits_c


@dataclass(frozen=True)
class Segment:
    """`bits` bits in a row: from bit `low` of byte `byte` upwards, they are the signal's bits from `shift` upwards."""

    byte: int
    low: int
    bits: int
    shift: int


@dataclass(frozen=True)
class Branch:
    """Signals that are in a frame under the same condition, a C expression."""

    condition: str
    signals: tuple[Signal, ...]


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


@emits_c
def carrier(signal: Signal) -> str:
    """The unsigned C type in which the signal's raw bits are put together."""
    return "uint32_t" if signal.length <= 32 else "uint64_t"


@emits_c
def value_type(signal: Signal) -> str:
    """The C type in which a raw value is computed with and handed to a setter: it holds the whole raw range."""
    if signal.is_bool:
        return "bool"
    if signal.is_float:
        return signal.c_type
    low, high = signal.limits
    if low >= -(2**31) and high < 2**31:
        return "int32_t"
    return "int64_t" if high < 2**63 else "uint64_t"


@emits_c
def number(value: int, c_type: str) -> str:
    """A C literal of that type."""
    macro = c_type.removesuffix("_t").upper() + "_C"
    if value in (-(2**31), -(2**63)):
        return f"({macro}({value + 1}) - 1)"
    return f"{macro}({value})"


@emits_c
def literal(signal: Signal, value: int) -> str:
    """C: a raw value of the signal, as its member holds it."""
    if signal.is_bool:
        return "true" if value else "false"
    if signal.is_float:
        text = repr(float_value(value, signal.length))
        return f"{text}f" if signal.length == 32 else text
    return str(value) if abs(value) < 2**15 else number(value, value_type(signal))


@emits_c
def local_type(signal: Signal) -> str:
    """The C type of the local variable that holds the signal in a codec: floats are there as bits."""
    return carrier(signal) if signal.is_float else value_type(signal)


@emits_c
def sent_type(signal: Signal) -> str:
    """The C type of the local variable from which the signal is encoded: it holds all that the member can hold."""
    if signal.is_float:
        return carrier(signal)
    return signal.c_type if signal.c_type in ("bool", "uint32_t", "int64_t", "uint64_t") else "int32_t"


@emits_c
def decode_expression(signal: Signal) -> str:
    """C: the signal's raw value out of `data`, as local_type(signal)."""
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
    if signal.is_float:
        return raw
    kind = value_type(signal)
    if signal.signed and signal.length not in (32, 64):
        return f"canopy_sign_extend{unsigned[4:6]}({raw}, {signal.length}u)"
    return f"({kind})({raw})"


@emits_c
def encode_lines(signals: tuple[Signal, ...], length: int) -> tuple[tuple[int, str], ...]:
    """C: (byte, value to put there) for each byte that the signals have bits in, from variables of their names."""
    terms: list[list[str]] = [[] for _ in range(length)]
    for signal in signals:
        wide = signal.c_name if sent_type(signal) == carrier(signal) else f"({carrier(signal)}){signal.c_name}"
        for part in segments(signal):
            term = f"({wide} >> {part.shift})" if part.shift else wide
            term = f"({term} & 0x{2**part.bits - 1:X}u)"
            terms[part.byte].append(f"({term} << {part.low})" if part.low else term)
    return tuple((place, " | ".join(byte)) for place, byte in enumerate(terms) if byte)


@emits_c
def bare(expression: str) -> str:
    """Without the parentheses around the whole of it."""
    if not expression.startswith("("):
        return expression
    depth = 0
    for place, character in enumerate(expression):
        depth += {"(": 1, ")": -1}.get(character, 0)
        if depth == 0:
            return expression[1:-1] if place == len(expression) - 1 else expression
    return expression


def _within(name: str, ranges: Ranges, kind: str) -> str:
    tests = [
        f"{name} == {number(low, kind)}"
        if low == high
        else f"({name} >= {number(low, kind)} && {name} <= {number(high, kind)})"
        if low > INTEGER_LIMITS[kind][0]
        else f"{name} <= {number(high, kind)}"
        for low, high in ranges
    ]
    return tests[0] if len(tests) == 1 else f"({' || '.join(tests)})"


def _outside(name: str, ranges: Ranges, kind: str, held: tuple[int, int]) -> str:
    """C: is the variable in none of the ranges? `held` is what it can hold at all; empty: it always is in one."""
    tests = []
    if ranges[0][0] > held[0]:
        tests.append(f"{name} < {number(ranges[0][0], kind)}")
    for (_, below), (above, _) in pairwise(ranges):
        if above - below == 2:
            tests.append(f"{name} == {number(below + 1, kind)}")
        else:
            tests.append(f"({name} > {number(below, kind)} && {name} < {number(above, kind)})")
    if ranges[-1][1] < held[1]:
        tests.append(f"{name} > {number(ranges[-1][1], kind)}")
    return " || ".join(tests)


def _float_ends(signal: Signal) -> str:
    macro = f"UINT{signal.length}_C"
    width = signal.length // 4
    return f"{macro}(0x{signal.low:0{width}X}), {macro}(0x{signal.high:0{width}X})"


def _float_test(signal: Signal, name: str) -> str:
    if signal.is_unlimited:
        return f"!canopy_float{signal.length}_finite({name})"
    return f"!canopy_float{signal.length}_within({name}, {_float_ends(signal)})"


@emits_c
def refuse_test(signal: Signal) -> str:
    """C: is the decoded value one that the DBC does not allow? Empty when every value of the bits is allowed."""
    if signal.is_bool:
        return ""
    if signal.is_float:
        return _float_test(signal, signal.c_name)
    return _outside(signal.c_name, signal.accepted, value_type(signal), signal.limits)


@emits_c
def refuse_tests(branch: Branch) -> tuple[str, ...]:
    """C: those of refuse_test() that the branch's signals have."""
    return tuple(test for test in map(refuse_test, branch.signals) if test)


@emits_c
def limit_test(signal: Signal, name: str, kind: str, holder: str) -> str:
    """C: must the variable `name` of C type `kind`, filled from one of type `holder`, not be sent as it is?

    Empty when it never must.
    """
    if signal.is_bool:
        return ""
    if signal.is_float:
        return _float_test(signal, name)
    return _outside(name, signal.sendable, kind, INTEGER_LIMITS[holder])


@emits_c
def replacement(signal: Signal, name: str, kind: str, holder: str) -> str:
    """C: what is sent in the place of a variable that may not be sent as it is: the nearest end, or the safe value."""
    if signal.is_float:
        safe = f"UINT{signal.length}_C(0x{signal.safe:0{signal.length // 4}X})"
        limit = f"canopy_float{signal.length}_limit({name}, {_float_ends(signal)}, {safe})"
        return safe if signal.is_unlimited else limit
    if signal.is_strict:
        return number(signal.safe, kind)
    low, high = number(signal.low, kind), number(signal.high, kind)
    if signal.low == INTEGER_LIMITS[holder][0]:
        return high
    if signal.high == INTEGER_LIMITS[holder][1]:
        return low
    return f"{name} < {low} ? {low} : {high}"


@emits_c
def condition(signal: Signal, message: Message, *, sending: bool = False) -> str:
    """C: is the multiplexed signal in the frame? From variables named as the multiplexers; "" when it always is."""
    kinds = {s.c_name: sent_type(s) if sending else value_type(s) for s in message.signals}
    return " && ".join(_within(s.signal, s.values, kinds[s.signal]) for s in signal.selectors)


def always(message: Message) -> tuple[Signal, ...]:
    """The signals that are in every frame."""
    return tuple(signal for signal in message.signals if not signal.selectors)


def nested_multiplexers(message: Message) -> tuple[Signal, ...]:
    """Multiplexers that are multiplexed themselves, the outermost first."""
    return tuple(signal for signal in message.multiplexed if signal.selects)


def branches(message: Message, *, sending: bool = False) -> tuple[Branch, ...]:
    """The multiplexed signals, those with the same condition together."""
    groups: dict[str, list[Signal]] = {}
    for signal in message.multiplexed:
        groups.setdefault(condition(signal, message, sending=sending), []).append(signal)
    return tuple(Branch(test, tuple(signals)) for test, signals in groups.items())


@emits_c
def physical_macro(signal: Signal) -> str:
    """C: the body of the macro that makes a raw value of the constant `physical`."""
    scale, offset = _real(signal.scale), _real(signal.offset)
    if signal.is_float:
        return f"(({signal.c_type})(((physical) - ({offset})) / ({scale})))"
    return f"CANOPY_RAW({value_type(signal)}, physical, {scale}, {offset})"


@dataclass(frozen=True)
class Fixed:
    """Physical values in fixed point: raw * step + offset, in 1/per_unit of the signal's unit; exact."""

    per_unit: int
    step: int
    offset: int
    c_type: str


def fixed_point(signal: Signal) -> Fixed | None:
    """How physical values of the signal are whole numbers; None: they are the raw ones, or no C integer holds them."""
    if signal.is_float or signal.is_bool or signal.is_enum or (signal.scale == 1 and signal.offset == 0):
        return None
    exponents = [number.as_tuple().exponent for number in (signal.scale, signal.offset)]
    places = max(0, *(-exponent for exponent in exponents if isinstance(exponent, int)))
    per_unit = 10**places if places <= 18 else 0
    step, offset = int(signal.scale * per_unit), int(signal.offset * per_unit)
    reached = [part for raw in signal.limits for part in (raw, raw * step, raw * step + offset)] + [
        step,
        offset,
        per_unit,
    ]
    for c_type in ("int32_t", "int64_t"):
        low, high = INTEGER_LIMITS[c_type]
        if per_unit and all(low < value <= high for value in reached):
            return Fixed(per_unit, step, offset, c_type)
    return None


@emits_c
def to_physical(signal: Signal) -> str:
    """C: the body of the macro that makes a double of the raw value `raw`; one rounding where the parts are exact."""
    fixed = fixed_point(signal)
    if fixed is None:
        return f"((double)(raw) * {_real(signal.scale)} + ({_real(signal.offset)}))"
    return f"(((double)(raw) * {fixed.step}.0 + ({fixed.offset}.0)) / {fixed.per_unit}.0)"


def _real(number: Decimal) -> str:
    text = str(number)
    return text if "." in text or "E" in text else f"{text}.0"


def may_limit(message: Message) -> bool:
    """Is there a signal whose struct member can hold what may not be sent?"""
    return any(limit_test(signal, signal.c_name, sent_type(signal), signal.c_type) for signal in message.signals)


@emits_c
def parameter_type(bus: Bus, message: Message, signal: Signal) -> str:
    """The C type in which a setter takes the value."""
    return f"{bus.name}_{message.c_name}_{signal.c_name}_t" if signal.is_enum else value_type(signal)


def range_text(signal: Signal) -> str:
    """For comments: what may be sent, raw."""
    if signal.is_float and signal.is_unlimited:
        return "any finite number"
    if signal.is_float:
        return "..".join(f"{float_value(bits, signal.length):g}" for bits in (signal.low, signal.high))
    return ", ".join(f"{low}..{high}" if low < high else f"{low}" for low, high in signal.sendable)
