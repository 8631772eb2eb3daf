# SPDX-License-Identifier: MIT
"""Values of scripts as what they are stored in: entries, ports, signals and parameters. Exact, or refused by name."""

from __future__ import annotations

import re

from canopy.compiler.errors import nearest
from canopy.compiler.numbers import plain
from canopy.compiler.port_types import PortType, fits_float, integer
from canopy.compiler.script.arithmetic import Arithmetic
from canopy.compiler.script.syntax import ScriptError
from canopy.compiler.script.values import INT64, Const, Double, Num, TextConst, TextVar, Value, describe, number

_BRACKETS = re.compile("[()]")


class Storing:
    """Conversions to the types of ports and entries. `faults`: C pointer to the fault counter."""

    def __init__(self, arithmetic: Arithmetic, faults: str) -> None:
        self._arithmetic = arithmetic
        self._faults = faults

    def parameter(self, value: Value, least: int) -> str:
        """The C expression of a node's parameter: 32 bits, and not below `least`."""
        if isinstance(value, Num) and value.is_bool:
            return f"(int32_t){value.c}"
        return self.convert(value, PortType("int", "int32_t", least, 2**31 - 1), 0)

    def convert(self, value: Value, kind: PortType, index: int) -> str:
        """The C expression that stores a value in an entry or port of a type."""
        if kind.kind == "text":
            if isinstance(value, (TextConst, TextVar)):
                return self._arithmetic.text(value)
            if isinstance(value, Const) and value.value.denominator == 1 and not value.is_bool:
                return self._arithmetic.text(TextConst(plain(value.value)))  # a text port reads a number as text
            raise ScriptError(index, f"{describe(value)} cannot be stored as a text", "write it in '…'")
        if isinstance(value, TextConst) and kind.names:
            named = dict(kind.names)
            if value.text not in named:
                raise ScriptError(index, f"'{value.text}' is no value of {kind}", nearest(value.text, named))
            return integer(named[value.text], kind)
        if isinstance(value, (TextConst, TextVar)) or kind.kind == "user":
            raise ScriptError(index, f"{describe(value)} cannot be stored as {kind}")
        if kind.kind == "float":
            c = self._arithmetic.double(value, index)
            if isinstance(value, Const) and not fits_float(float(value.value), kind.c):
                raise ScriptError(index, f"{plain(value.value)} is too large or too small for a {kind.c}")
            return c if kind.c == "double" else f"(float)({stripped(c)})"
        if kind.kind == "bool":
            truth = self._arithmetic.truth(value, index)
            return ("true" if truth.value else "false") if isinstance(truth, Const) else truth.c
        if isinstance(value, Double):
            steps = self._arithmetic.double(self._arithmetic.binary("/", value, Const(kind.scale), index), index)
            c = value.c if kind.scale == 1 else steps
            return f"({kind.c})canopy_whole({stripped(c)}, {_limits(kind)}, {self._faults})"
        return self.whole(value, kind, index)

    def whole(self, value: Num | Const, kind: PortType, index: int) -> str:
        """The C expression of a whole number of the type's steps."""
        if isinstance(value, Const):
            return self._constant(value, kind, index)
        factor = 1 if value.scale == kind.scale else (value.scale / kind.scale).denominator
        if factor != 1:
            help_text = f"multiply it by {factor}, and count in that unit"
            if kind.kind == "fixed":
                help_text = f"declare a type in steps of which {plain(value.scale)} is a multiple"
            raise ScriptError(index, f"{describe(value)} would lose precision as {kind}", help_text)
        steps = self._arithmetic.scaled(value, kind.scale, index)
        if kind.low <= steps.low and steps.high <= kind.high:
            return steps.c if steps.c_type == kind.c else f"({kind.c}){steps.c}"
        return f"({kind.c})canopy_limit({stripped(steps.as_type(True))}, {_limits(kind)}, {self._faults})"

    @staticmethod
    def _constant(value: Const, kind: PortType, index: int) -> str:
        steps = value.value / kind.scale
        if steps.denominator != 1 and kind.kind == "fixed":
            raise ScriptError(index, f"{plain(value.value)} is no multiple of the step, and {kind} is wanted")
        if steps.denominator != 1:
            raise ScriptError(
                index,
                f"{plain(value.value)} is no whole number, and {kind} is wanted",
                "declare the entry in fixed point, as a port of its tree: type='int32_t*0.01'",
            )
        if not kind.low <= steps <= kind.high:
            ends = (plain(kind.low * kind.scale), plain(kind.high * kind.scale))
            raise ScriptError(index, f"{plain(value.value)} is outside {kind} [{ends[0]}, {ends[1]}]")
        return integer(int(steps), kind)


def _limits(kind: PortType) -> str:
    """The limits of a type as C names where it has such."""
    bits = kind.c.strip("uint_")
    low = "0" if kind.low == 0 else f"INT{bits}_MIN" if kind.low == -(2 ** (int(bits) - 1)) else number(kind.low, True)
    if kind.high > INT64[1]:
        return f"{low}, INT64_MAX"
    return f"{low}, {'U' if kind.high == 2 ** int(bits) - 1 else ''}INT{bits}_MAX"


def stripped(c: str) -> str:
    """Without the parentheses around the whole."""
    if not (c.startswith("(") and c.endswith(")")):
        return c
    depth = 0
    for bracket in _BRACKETS.finditer(c):
        depth += 1 if bracket[0] == "(" else -1
        if depth == 0 and bracket.end() != len(c):
            return c
    return c[1:-1]
