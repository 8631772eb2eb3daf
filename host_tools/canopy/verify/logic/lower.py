# SPDX-License-Identifier: MIT
"""Scripts as the circuits know them: names of enums' values are numbers, and assignments are statements."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from canopy.compiler.errors import CompileError
from canopy.compiler.script.syntax import (
    Assignment,
    Binary,
    Comparison,
    Conditional,
    Expression,
    Name,
    Number,
    Unary,
    parse,
    parts,
)
from canopy.compiler.tree import Script


def _lowered(expression: Expression, enums: dict[str, int]) -> Expression:
    if isinstance(expression, Name) and expression.name in enums:
        return Number(expression.index, Fraction(enums[expression.name]))
    if isinstance(expression, Unary):
        return replace(expression, operand=_lowered(expression.operand, enums))
    if isinstance(expression, Binary):
        sides = _lowered(expression.left, enums), _lowered(expression.right, enums)
        return replace(expression, left=sides[0], right=sides[1])
    if isinstance(expression, Comparison):
        return replace(expression, operands=tuple(_lowered(part, enums) for part in expression.operands))
    if isinstance(expression, Conditional):
        condition, yes, no = (_lowered(p, enums) for p in (expression.condition, expression.yes, expression.no))
        return replace(expression, condition=condition, yes=yes, no=no)
    if isinstance(expression, Assignment):
        return replace(expression, value=_lowered(expression.value, enums))
    return expression


def statements_of(script: Script) -> tuple[Expression, ...]:
    """The statements of a script.

    Raises:
        CompileError: one has an assignment inside.
    """
    found = parse(script.text)
    for statement in found:
        for part in parts(statement):
            if isinstance(part, Assignment) and part is not statement:
                raise CompileError(
                    script.place(part.index),
                    "an assignment inside an expression is not modelled",
                    "make it a statement of its own",
                )
    enums = script.scope.board.enums
    return tuple(_lowered(statement, enums) for statement in found) if enums else found
