# SPDX-License-Identifier: MIT
"""Ports without a type: the type that all their uses have, else a value that says what it is."""

from __future__ import annotations

from collections.abc import Sequence

from canopy.compiler.blackboard import Entry
from canopy.compiler.port_types import BOOL, DOUBLE, INT32, INT64, NOTHING, TEXT, PortType
from canopy.compiler.script.compile import guess
from canopy.compiler.script.values import TextConst
from canopy.compiler.tree import Bound
from canopy.escape.c import emits_c, string

VALUE = PortType("value", "canopy_value_t", label="a value of any type")
"""A struct with `kind`, and `number`, `real` or `text`."""

_RANK = (BOOL, INT32, INT64, DOUBLE)


def literal_kind(text: str, floats: bool) -> PortType:
    """The type of a literal that stands alone."""
    value = guess(text)
    if isinstance(value, TextConst):
        return TEXT
    if value.is_bool:
        return BOOL
    if value.value.denominator != 1:
        return DOUBLE if floats else TEXT
    return INT32 if -(2**31) <= value.value < 2**31 else INT64


def _kind(bound: Bound, floats: bool) -> PortType | None:
    """What one use says; None: nothing is connected, or a signal, which fits itself to the port."""
    if isinstance(bound.target, Entry):
        if bound.target.is_constant:
            return literal_kind(bound.target.initial or "", floats)
        return bound.target.type if bound.target.type.kind != "any" else None
    return literal_kind(bound.text, floats) if bound.text is not None else None


def generic_type(uses: Sequence[Bound], floats: bool) -> PortType:
    """The type of a port that has none, from all its uses in the tree."""
    kinds = [kind for kind in (_kind(bound, floats) for bound in uses) if kind is not None]
    if not kinds:
        return INT32 if any(bound.target is not None for bound in uses) else NOTHING
    if all(kind == kinds[0] for kind in kinds):
        return kinds[0]
    if uses[0].port.writes:
        return kinds[0]  # and the others are an error that names both
    literals = all(bound.text is not None for bound in uses)
    if literals and BOOL not in kinds and all(kind in _RANK for kind in kinds):
        return max(kinds, key=_RANK.index)
    return VALUE


@emits_c
def value_of(text: str, floats: bool) -> str:
    """The members of a value that is a literal."""
    value = guess(text)
    if isinstance(value, TextConst):
        return f".kind = CANOPY_VALUE_TEXT, .text = {string(text)}"
    if value.value.denominator != 1 or not -(2**63) < value.value < 2**63:
        if floats:
            return f".kind = CANOPY_VALUE_REAL, .real = {float(value.value)!r}"
        return f".kind = CANOPY_VALUE_TEXT, .text = {string(text)}"
    return f".kind = CANOPY_VALUE_NUMBER, .number = INT64_C({int(value.value)})"
