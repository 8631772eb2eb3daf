# SPDX-License-Identifier: MIT
"""Conditions of a model file as unions of conjunctions, by rewriting alone."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

MAX_TEXT = 4_000
MAX_PARTS = 2_000


class RejectedError(Exception):
    """The certificate shows nothing, or tree and model have something that cannot be certified."""


@dataclass(frozen=True)
class Row:
    """coefficients · x <= bound, or < where `strict`."""

    coefficients: tuple[Fraction, ...]
    bound: Fraction
    strict: bool

    def opposite(self) -> Row:
        """What holds where this does not."""
        return Row(tuple(-value for value in self.coefficients), -self.bound, not self.strict)


Part = tuple[Row, ...]
"""All of these hold."""
Union = tuple[Part, ...]
"""One of these holds; no two at once."""


def narrowed(rows: Iterable[Row]) -> Part | None:
    """Of rows in one direction the tightest; None: two that are opposite leave nothing, so nothing is lost."""
    kept: dict[tuple[Fraction, ...], tuple[Fraction, bool]] = {}
    for row in rows:
        lead = next((abs(value) for value in row.coefficients if value), Fraction(0))
        if lead == 0:
            if row.bound < 0 or (row.bound == 0 and row.strict):
                return None
            continue
        key, bound = tuple(value / lead for value in row.coefficients), row.bound / lead
        old = kept.get(key)
        if old is None or (bound, not row.strict) < (old[0], not old[1]):
            kept[key] = (bound, row.strict)
    for key, (bound, strict) in kept.items():
        other = kept.get(tuple(-value for value in key))
        if other is not None and (bound + other[0] < 0 or (bound + other[0] == 0 and (strict or other[1]))):
            return None
    return tuple(Row(key, *kept[key]) for key in sorted(kept))


def meet(one: Union, other: Union) -> Union:
    """The intersection."""
    parts = (narrowed((*a, *b)) for a in one for b in other)
    result = tuple(part for part in parts if part is not None)
    if len(result) > MAX_PARTS:
        raise RejectedError(f"a condition has more than {MAX_PARTS} parts")
    return result


def without(one: Union, other: Union) -> Union:
    """What is in `one` and not in `other`, in parts that do not overlap."""
    for part in other:
        outside: list[Part] = []
        for index, row in enumerate(part):
            made = narrowed((*part[:index], row.opposite()))
            outside.extend([made] if made is not None else [])
        one = meet(one, tuple(outside))
    return one


def join(one: Union, other: Union) -> Union:
    """The union."""
    return (*one, *without(other, one))


EVERYTHING: Union = ((),)
NOTHING: Union = ()


@dataclass(frozen=True)
class Sum:
    """coefficients · x + constant."""

    coefficients: tuple[Fraction, ...]
    constant: Fraction

    def plus(self, other: Sum, factor: Fraction) -> Sum:
        """Self + factor * other."""
        coefficients = (a + factor * b for a, b in zip(self.coefficients, other.coefficients, strict=True))
        return Sum(tuple(coefficients), self.constant + factor * other.constant)

    def at(self, direction: Sequence[Fraction], sums: Sequence[Sum]) -> Sum:
        """Self + direction · sums."""
        total = self
        for factor, one in zip(direction, sums, strict=True):
            total = total.plus(one, factor)
        return total


class Reader:
    """Reads conditions and sums over named variables. The grammar is a part of Python's."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = list(names)
        self.zero = Sum((Fraction(0),) * len(self.names), Fraction(0))
        self._text = ""

    def _parsed(self, text: str) -> ast.expr:
        if len(text) > MAX_TEXT:
            raise RejectedError("an expression is too long")
        self._text = re.sub(r"\[[^\[\]]*\]", "", text).strip()  # units: verify checks them
        try:
            return ast.parse(self._text, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise RejectedError(f"'{text}' cannot be read: {error}") from None

    def condition(self, text: str) -> Union:
        """A condition."""
        return self._condition(self._parsed(text))

    def sum(self, text: str) -> Sum:
        """A linear expression."""
        return self._sum(self._parsed(text))

    def _condition(self, node: ast.expr) -> Union:
        if isinstance(node, ast.BoolOp):
            result = self._condition(node.values[0])
            for value in node.values[1:]:
                other = self._condition(value)
                result = meet(result, other) if isinstance(node.op, ast.And) else join(result, other)
            return result
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return without(EVERYTHING, self._condition(node.operand))
        if isinstance(node, ast.Name) and node.id in ("true", "false"):
            return EVERYTHING if node.id == "true" else NOTHING
        if isinstance(node, ast.Compare):
            result, left = EVERYTHING, self._sum(node.left)
            for operator, right in zip(node.ops, map(self._sum, node.comparators), strict=True):
                result = meet(result, self._compared(left.plus(right, Fraction(-1)), operator))
                left = right
            return result
        raise RejectedError(f"'{self._text}' is not a condition")

    def _compared(self, difference: Sum, operator: ast.cmpop) -> Union:
        def below(strict: bool) -> Row:
            return Row(difference.coefficients, -difference.constant, strict)

        def above(strict: bool) -> Row:
            return Row(tuple(-value for value in difference.coefficients), difference.constant, strict)

        parts: Union
        if isinstance(operator, (ast.Lt, ast.LtE)):
            parts = ((below(isinstance(operator, ast.Lt)),),)
        elif isinstance(operator, (ast.Gt, ast.GtE)):
            parts = ((above(isinstance(operator, ast.Gt)),),)
        elif isinstance(operator, ast.Eq):
            parts = ((below(False), above(False)),)
        elif isinstance(operator, ast.NotEq):
            parts = ((below(True),), (above(True),))
        else:
            raise RejectedError(f"'{self._text}' has a comparison that is not known")
        return meet(parts, EVERYTHING)

    def _sum(self, node: ast.expr) -> Sum:
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            segment = ast.get_source_segment(self._text, node) or ""
            if re.fullmatch(r"\d{1,30}(\.\d{1,30})?", segment) is None:
                raise RejectedError(f"'{segment}' is not a number here")
            return Sum(self.zero.coefficients, Fraction(segment))
        if isinstance(node, ast.Name) and node.id in self.names:
            return Sum(tuple(Fraction(int(name == node.id)) for name in self.names), Fraction(0))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return self.zero.plus(self._sum(node.operand), Fraction(-1))
        if isinstance(node, ast.BinOp):
            return self._binary(self._sum(node.left), self._sum(node.right), node.op)
        raise RejectedError(f"'{self._text}' is not a linear expression")

    def _binary(self, left: Sum, right: Sum, operator: ast.operator) -> Sum:
        if isinstance(operator, (ast.Add, ast.Sub)):
            return left.plus(right, Fraction(1 if isinstance(operator, ast.Add) else -1))
        if isinstance(operator, ast.Mult) and not any(left.coefficients):
            left, right = right, left
        if any(right.coefficients) or not isinstance(operator, (ast.Mult, ast.Div)):
            raise RejectedError(f"'{self._text}' is not linear")
        if isinstance(operator, ast.Div) and right.constant == 0:
            raise RejectedError(f"'{self._text}' divides by 0")
        return self.zero.plus(left, right.constant if isinstance(operator, ast.Mult) else 1 / right.constant)
