# SPDX-License-Identifier: MIT
"""One signal of a DBC: its bits, its range and its safe value in raw units, its place among multiplexers."""

from __future__ import annotations

import dataclasses
import sys
from decimal import Decimal, localcontext
from fractions import Fraction

from canopy.bus.source import SourceMessage, SourceSignal
from canopy.compiler.bus_model import Ranges, Selector, Signal, cut, float_bits, float_value, merge
from canopy.compiler.dbc_file import Dbc, attribute, number
from canopy.compiler.errors import CompileError
from canopy.compiler.limits import RAW
from canopy.compiler.names import snake
from canopy.compiler.numbers import DIGITS_MAX

SCALE_MIN, SCALE_MAX = Decimal("1e-100"), Decimal("1e100")
"""Of scales and offsets: products of some of them are still far within a double."""
DOUBLE_MAX = Decimal(sys.float_info.max)
_NONE = Decimal(0)


def _selectors(where: str, message: SourceMessage, signal: SourceSignal) -> tuple[Selector, ...]:
    """What has to hold for the signal to be in a frame."""
    result: list[Selector] = []
    place, written = signal.place, signal.name
    seen = {signal.name}
    while signal.multiplexer is not None:
        owner = message.signal(signal.multiplexer)
        if owner.name in seen:
            raise CompileError(
                place,
                f"{where} is multiplexed, but it is not clear by which multiplexer",
                f"add SG_MUL_VAL_ {message.id} {written} MULTIPLEXER RANGES; to the DBC",
            )
        result.insert(0, Selector(owner.name, signal.branches))
        signal = owner
        seen.add(signal.name)
    return tuple(result)


def _selects(where: str, message: SourceMessage, signal: SourceSignal) -> Ranges:
    """The values that a multiplexer may have: those of its branches, and those that its value table names."""
    branches = {
        other.name: other.branches for other in message.signals if other.branches and other.multiplexer == signal.name
    }
    if not branches:
        return ()
    if signal.is_float:
        raise CompileError(signal.place, f"{where} is a multiplexer and a float", "make it an unsigned integer")
    place = signal.place
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


def _range(signal: SourceSignal, limits: tuple[int, int]) -> tuple[int, int]:
    """[minimum, maximum] of the DBC in raw units, each rounded to the nearest; all of the bits when it says none."""
    scale, offset = Fraction(signal.scale), Fraction(signal.offset)
    if signal.minimum is None or signal.maximum is None or not signal.minimum < signal.maximum:
        return limits
    ends = sorted((Fraction(end) - offset) / scale for end in (signal.minimum, signal.maximum))
    if signal.is_float:
        return float_bits(float(ends[0]), signal.length), float_bits(float(ends[1]), signal.length)
    low, high = (round(end) for end in ends)
    if low > limits[1] or high < limits[0]:
        return limits  # see impossible_range(): it cannot be meant, and there is a warning
    return max(low, limits[0]), min(high, limits[1])


def _check_numbers(where: str, signal: SourceSignal) -> None:
    """They are computed with in double by the macros, and exactly here; cantools takes 1e400 for infinity."""
    for what, value, smallest, largest in (
        ("scale", signal.scale, SCALE_MIN, SCALE_MAX),
        ("offset", signal.offset, _NONE, SCALE_MAX),
        ("minimum", signal.minimum or _NONE, _NONE, DOUBLE_MAX),
        ("maximum", signal.maximum or _NONE, _NONE, DOUBLE_MAX),
    ):
        if value != 0 and not smallest <= abs(value) <= largest:
            size = f"from {smallest:g} " if smallest else "up "
            raise CompileError(
                signal.place,
                f"{where} has the {what} {value:g}",
                f"numbers {size}to {float(largest):g} in size are possible",
            )


def _check_size(where: str, signal: SourceSignal) -> None:
    place = signal.place
    if signal.is_float and signal.length not in (32, 64):
        raise CompileError(place, f"{where} is a float of {signal.length} bits", "SIG_VALTYPE_ goes with 32 or 64 bits")
    if signal.length > 64:
        raise CompileError(place, f"{where} has {signal.length} bits; at most 64 are possible", "split the signal")
    if signal.scale == 0:
        raise CompileError(place, f"{where} has the scale 0, so all its values are the same", "set its scale, or 1")


def read_signal(message: SourceMessage, signal: SourceSignal) -> Signal:
    """The signal, whose safe value is what is nearest to 0. Raises CompileError for what has no code."""
    where = f"signal '{message.name}.{signal.name}'"
    _check_size(where, signal)
    _check_numbers(where, signal)
    if signal.is_float:
        limits = float_bits(float("-inf"), signal.length), float_bits(float("inf"), signal.length)
    elif signal.is_signed:
        limits = -(2 ** (signal.length - 1)), 2 ** (signal.length - 1) - 1
    else:
        limits = 0, 2**signal.length - 1
    low, high = _range(signal, limits)
    result = Signal(
        name=signal.name,
        c_name=snake(signal.name),
        start=signal.start,
        length=signal.length,
        little_endian=signal.little_endian,
        signed=signal.is_signed and not signal.is_float,
        is_float=signal.is_float,
        scale=_tidy(signal.scale),
        offset=_tidy(signal.offset),
        low=low,
        high=high,
        safe=0,
        unit=signal.unit,
        comment=signal.comment,
        choices=tuple(sorted(signal.choices.items())),
        selectors=_selectors(where, message, signal),
        selects=_selects(where, message, signal),
    )
    return dataclasses.replace(result, safe=nearest_allowed(result, 0))


def _tidy(value: Decimal) -> Decimal:
    """The same number as the shortest text that is one in C, too: 1.50 is 1.5, and 1E+2 is 100."""
    with localcontext() as context:
        context.prec = 2 * DIGITS_MAX
        short = value.normalize() + 0  # -0 is 0
        exponent = short.as_tuple().exponent
        return short.quantize(Decimal(1)) if isinstance(exponent, int) and 0 < exponent < 20 else short


def with_safe_value(dbc: Dbc, message: SourceMessage, signal: Signal) -> Signal:
    """The signal with its GenSigInactiveValue, if it has one.

    Raises:
        CompileError: that is no number.
    """
    written = message.signal(signal.name)
    if signal.is_float:
        value = number(dbc, "GenSigInactiveValue", message, written)
        return signal if value is None else dataclasses.replace(signal, safe=float_bits(float(value), signal.length))
    raw = attribute(dbc, "GenSigInactiveValue", RAW, message, written)
    return signal if raw is None else dataclasses.replace(signal, safe=raw)


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
