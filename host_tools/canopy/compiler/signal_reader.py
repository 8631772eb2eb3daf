# SPDX-License-Identifier: MIT
"""One signal of a DBC: its bits, its range and its safe value in raw units, its place among multiplexers."""

from __future__ import annotations

import sys
from decimal import Decimal
from typing import Any

from canopy.compiler.bus_model import Ranges, Selector, Signal, cut, float_bits, float_value, merge
from canopy.compiler.dbc_file import Dbc, attribute, number
from canopy.compiler.dbc_text import dbc_id
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.limits import RAW
from canopy.compiler.names import snake

SCALE_MIN, SCALE_MAX = 1e-100, 1e100
"""Of scales and offsets: products of some of them are still far within a double."""
DOUBLE_MAX = sys.float_info.max


def _raw(physical: Any, scale: Decimal, offset: Decimal) -> Decimal:
    return (Decimal(str(physical)) - offset) / scale


def _ids(signal: Any) -> Ranges:
    return merge((int(value), int(value)) for value in signal.multiplexer_ids)


def _selectors(place: Place, where: str, message: Any, signal: Any) -> tuple[Selector, ...]:
    """What has to hold for the signal to be in a frame."""
    result: list[Selector] = []
    seen = {signal.name}
    while signal.multiplexer_ids:
        owners = [other for other in message.signals if other.name == signal.multiplexer_signal]
        if not owners or owners[0].name in seen:
            raise CompileError(
                place,
                f"{where} is multiplexed, but it is not clear by which multiplexer",
                f"add SG_MUL_VAL_ {dbc_id(message)} {signal.name} MULTIPLEXER RANGES; to the DBC",
            )
        result.insert(0, Selector(owners[0].name, _ids(signal)))
        signal = owners[0]
        seen.add(signal.name)
    return tuple(result)


def _selects(place: Place, where: str, message: Any, signal: Any) -> Ranges:
    """The values that a multiplexer may have: those of its branches, and those that its value table names."""
    branches = {
        other.name: _ids(other)
        for other in message.signals
        if other.multiplexer_ids and other.multiplexer_signal == signal.name
    }
    if not branches:
        return ()
    if signal.is_float:
        raise CompileError(place, f"{where} is a multiplexer and a float", "make it an unsigned integer")
    bits = signal.length - 1 if signal.is_signed else signal.length
    for name, values in branches.items():
        if values[-1][1] >= 2**bits:
            raise CompileError(
                place,
                f"'{message.name}.{name}' is in branch {values[-1][1]}, a value that {where} of {signal.length} bits"
                f"{', signed,' if signal.is_signed else ''} cannot have",
                "make the multiplexer unsigned (@1+) and wide enough",
            )
    named = [(int(value), int(value)) for value in (signal.choices or {})]
    low = -(2 ** (signal.length - 1)) if signal.is_signed else 0
    return cut(merge([*(r for values in branches.values() for r in values), *named]), low, 2**bits - 1)


def _range(place: Place, where: str, signal: Any, limits: tuple[int, int]) -> tuple[int, int]:
    """[minimum, maximum] of the DBC in raw units, each rounded to the nearest; all of the bits when it says none."""
    scale, offset = Decimal(str(signal.scale)), Decimal(str(signal.offset))
    if signal.minimum is None or signal.maximum is None or not signal.minimum < signal.maximum:
        return limits
    ends = sorted(_raw(end, scale, offset) for end in (signal.minimum, signal.maximum))
    if signal.is_float:
        return float_bits(float(ends[0]), signal.length), float_bits(float(ends[1]), signal.length)
    low, high = (int(end.to_integral_value()) for end in ends)
    if low > limits[1] or high < limits[0]:
        raise CompileError(
            place,
            f"no value of {where} is in its range [{signal.minimum}, {signal.maximum}]: its {signal.length} bits hold "
            f"{limits[0]}..{limits[1]} (raw), that is {limits[0] * scale + offset}..{limits[1] * scale + offset}",
            "correct the range, or write [0|0] for none",
        )
    return max(low, limits[0]), min(high, limits[1])


def _check_numbers(place: Place, where: str, signal: Any) -> None:
    """They are computed with in double by the macros, and exactly here; cantools takes 1e400 for infinity."""
    for what, value, smallest, largest in (
        ("scale", signal.scale, SCALE_MIN, SCALE_MAX),
        ("offset", signal.offset, 0, SCALE_MAX),
        ("minimum", signal.minimum or 0, 0, DOUBLE_MAX),
        ("maximum", signal.maximum or 0, 0, DOUBLE_MAX),
    ):
        if value != 0 and not smallest <= abs(value) <= largest:
            size = f"from {smallest:g} " if smallest else "up "
            raise CompileError(
                place, f"{where} has the {what} {value:g}", f"numbers {size}to {largest:g} in size are possible"
            )


def _check_size(place: Place, where: str, signal: Any) -> None:
    if signal.is_float and signal.length not in (32, 64):
        raise CompileError(place, f"{where} is a float of {signal.length} bits", "SIG_VALTYPE_ goes with 32 or 64 bits")
    if signal.length > 64:
        raise CompileError(place, f"{where} has {signal.length} bits; at most 64 are possible", "split the signal")
    if signal.scale == 0:
        raise CompileError(place, f"{where} has the scale 0, so all its values are the same", "set its scale, or 1")


def read_signal(dbc: Dbc, message: Any, signal: Any) -> Signal:
    """The signal, from cantools' one. Raises CompileError for what has no code."""
    place = dbc.text.signal(message, signal)
    where = f"signal '{message.name}.{signal.name}'"
    _check_size(place, where, signal)
    _check_numbers(place, where, signal)
    if signal.is_float:
        limits = float_bits(float("-inf"), signal.length), float_bits(float("inf"), signal.length)
    elif signal.is_signed:
        limits = -(2 ** (signal.length - 1)), 2 ** (signal.length - 1) - 1
    else:
        limits = 0, 2**signal.length - 1
    low, high = _range(place, where, signal, limits)
    result = Signal(
        name=signal.name,
        c_name=snake(signal.name),
        start=signal.start,
        length=signal.length,
        little_endian=signal.byte_order == "little_endian",
        signed=signal.is_signed and not signal.is_float,
        is_float=signal.is_float,
        scale=Decimal(str(signal.scale)),
        offset=Decimal(str(signal.offset)),
        low=low,
        high=high,
        safe=0,
        unit=signal.unit or "",
        comment=str(signal.comment or ""),
        choices=tuple(sorted((int(value), str(text)) for value, text in (signal.choices or {}).items())),
        selectors=_selectors(place, where, message, signal),
        selects=_selects(place, where, message, signal),
    )
    return Signal(**{**result.__dict__, "safe": _safe(dbc, message, result, signal)})


def _safe(dbc: Dbc, message: Any, signal: Signal, given: Any) -> int:
    """GenSigInactiveValue; where there is none, of all that may be sent, what is nearest to 0."""
    if signal.is_float:
        value = number(dbc, "GenSigInactiveValue", message, given)
        bits = float_bits(float(value or 0), signal.length)
        return bits if value is not None else nearest_allowed(signal, bits)
    raw = attribute(dbc, "GenSigInactiveValue", RAW, message, given)
    return raw if raw is not None else nearest_allowed(signal, 0)


def nearest_allowed(signal: Signal, raw: int) -> int:
    """Of the raw values (bits, for floats) that may be sent, the nearest one."""
    if signal.is_float:
        low, high, value = (float_value(bits, signal.length) for bits in (signal.low, signal.high, raw))
        return float_bits(max(low, min(high, value)), signal.length)
    ends = (max(low, min(high, raw)) for low, high in signal.sendable or signal.accepted)
    return min(ends, key=lambda end: abs(end - raw))


def is_safe(signal: Signal) -> bool:
    """Is the safe value one that may be sent?"""
    if signal.is_float:
        low, high, safe = (float_value(bits, signal.length) for bits in (signal.low, signal.high, signal.safe))
        return low <= safe <= high
    return any(low <= signal.safe <= high for low, high in signal.accepted)
