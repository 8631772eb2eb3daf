# SPDX-License-Identifier: MIT
"""Scripts that write signals: a value as the argument of the output image's setter."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from canopy.compiler.bus_reader import Message, Signal
from canopy.compiler.codec import value_type
from canopy.compiler.errors import nearest
from canopy.compiler.numbers import plain
from canopy.compiler.port_types import DOUBLE, FLOAT, PortType
from canopy.compiler.script.storing import stripped
from canopy.compiler.script.syntax import Assignment, ScriptError
from canopy.compiler.script.values import INT64, Const, Num, TextConst, Value, describe

if TYPE_CHECKING:
    from canopy.compiler.script.compile import Compiler


def write_signal(compiler: Compiler, text: str, expression: Assignment) -> list[str]:
    """C lines that write a signal, given in physical units.

    Raises:
        ScriptError: the node does not send it, or the value would be rounded or lies outside its range.
    """
    message_name, _, signal_name = text.partition(".")
    index = expression.target.index
    message = compiler.message(message_name, compiler.bus.send, "send", index)
    signal = compiler.known_signal(message, signal_name, index)
    if expression.operator not in (":=", "="):
        raise ScriptError(index, f"'{text}' is an output: it is written, not read", "compute in an entry, then write")
    value = compiler.evaluate(expression.value)
    setter = f"{compiler.bus.name}_set_{message.c_name}_{signal.c_name}"
    c = _raw(compiler, value, message, signal, expression.value.index, text)
    return [f"{setter}(&app->output, {stripped(c)});"]


def _raw(compiler: Compiler, value: Value, message: Message, signal: Signal, index: int, text: str) -> str:
    """The C expression of a raw value, of the setter's type."""
    if signal.is_float:
        return _raw_float(compiler, value, signal, index)
    if isinstance(value, TextConst) and signal.choices:
        names = {named.text: named.c_name for named in signal.enumerators if signal.is_enum}
        names = names or {named.text: named.c_name for named in signal.exceptions}
        if value.text not in names:
            raise ScriptError(index, f"'{value.text}' is no value of '{text}'", nearest(value.text, names))
        return f"{compiler.bus.name.upper()}_{names[value.text]}"
    if signal.is_enum:
        if not isinstance(value, (Num, Const)):
            raise ScriptError(index, f"{describe(value)} is no value of '{text}'")
        wide = PortType("int", "int32_t", -(2**31), 2**31 - 1)
        enum = f"{compiler.bus.name}_{message.c_name}_{signal.c_name}_t"
        return f"({enum})({compiler.storing.whole(value, wide, index)})"
    if signal.is_bool:
        truth = compiler.arithmetic.truth(value, index)
        return ("true" if truth.value else "false") if isinstance(truth, Const) else truth.c
    if not isinstance(value, (Num, Const)):
        raise ScriptError(
            index,
            f"{describe(value)} cannot be written to '{text}', which is in fixed point",
            "compute it in whole numbers",
        )
    return _raw_number(compiler, value, signal, index, text)


def _raw_float(compiler: Compiler, value: Value, signal: Signal, index: int) -> str:
    raw = value
    if signal.offset != 0:
        raw = compiler.arithmetic.binary("-", raw, Const(Fraction(signal.offset)), index)
    if signal.scale != 1:
        raw = compiler.arithmetic.binary("/", raw, Const(Fraction(signal.scale)), index)
    return compiler.storing.convert(raw, FLOAT if signal.c_type == "float" else DOUBLE, index)


def _raw_number(compiler: Compiler, value: Num | Const, signal: Signal, index: int, text: str) -> str:
    scale, offset = Fraction(signal.scale), Fraction(signal.offset)
    moved = compiler.arithmetic.binary("-", value, Const(offset), index)
    raw = compiler.arithmetic.binary("/", moved, Const(scale), index)
    if isinstance(raw, Const):
        if raw.value.denominator != 1:
            raise ScriptError(index, f"'{text}' is in steps of {signal.scale}: this value lies between two", "round it")
        if not signal.low <= raw.value <= signal.high:
            ends = sorted((signal.low * scale + offset, signal.high * scale + offset))
            raise ScriptError(index, f"outside the range of '{text}' [{plain(ends[0])}, {plain(ends[1])}]")
    assert isinstance(raw, (Num, Const))
    if isinstance(raw, Num) and raw.scale.denominator != 1:
        raise ScriptError(
            index, f"'{text}' is in steps of {signal.scale}: the value would be rounded", "use such steps"
        )
    c_type = value_type(signal)
    low, high = {"int32_t": (-(2**31), 2**31 - 1), "int64_t": INT64, "uint64_t": (0, 2**64 - 1)}[c_type]
    return compiler.storing.whole(raw, PortType("int", c_type, low, high), index)
