# SPDX-License-Identifier: MIT
"""Guards and updates as text: `x1 > 0 and not x2 < 0.48`, `x1 + (50 - x1)/50`. Numbers are exact, units are checked.

formula     a or b, a and b, not a, (a), true, false, comparisons; a < b <= c is a < b and b <= c
comparison  <, <=, >, >=, ==, !=
sum         +, -, * and / by numbers, (…); a number may say its unit in brackets: 0.1[%/m] * x1
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from canopy.compiler.errors import nearest
from canopy.verify.linear import Affine, Formula, Polyhedron, atom, everything, nothing
from canopy.verify.units import Unit, parse_unit

MAX_LENGTH = 4_000
MAX_DEPTH = 60
MAX_PARTS = 2_000
KEYWORDS = ("and", "or", "not", "true", "false")

_TOKEN = re.compile(
    r"\s*(?:(?P<number>\d{1,30}(?:\.\d{1,30})?)|(?P<unit>\[[^\[\]]*\])"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<operator><=|>=|==|!=|[-+*/()<>]))"
)


class ExpressionError(Exception):
    """What is wrong with an expression, `at` which character (from 0), and what to write instead."""

    def __init__(self, at: int, message: str, help_text: str = "") -> None:
        super().__init__(message)
        self.at = at
        self.message = message
        self.help_text = help_text


@dataclass(frozen=True)
class Quantity:
    """A linear expression with its unit; None: a plain number, which goes with any unit."""

    value: Affine
    unit: Unit | None

    @property
    def is_constant(self) -> bool:
        """Does it depend on no variable?"""
        return not any(self.value.coefficients)


Value = Quantity | Formula


class _Parser:
    def __init__(self, text: str, variables: Mapping[str, Unit]) -> None:
        if len(text) > MAX_LENGTH:
            raise ExpressionError(0, f"the expression is longer than {MAX_LENGTH} characters")
        self.names = list(variables)
        self.units = variables
        self.width = len(self.names)
        self.tokens = self._split(text)
        self.next = 0
        self.depth = 0
        self.end = len(text)

    @staticmethod
    def _split(text: str) -> list[tuple[str, str, int]]:
        tokens = []
        at = 0
        while text[at:].strip():
            found = _TOKEN.match(text, at)
            if found is None or found.lastgroup is None:
                at += len(text[at:]) - len(text[at:].lstrip())
                raise ExpressionError(at, f"unexpected '{text[at]}'", "write for example: x1 > 0 and x2 <= 0.48")
            tokens.append((found.lastgroup, found[found.lastgroup], found.start(found.lastgroup)))
            at = found.end()
        return tokens

    def peek(self) -> str:
        return self.tokens[self.next][1] if self.next < len(self.tokens) else ""

    @property
    def at(self) -> int:
        return self.tokens[self.next][2] if self.next < len(self.tokens) else self.end

    def accept(self, *texts: str) -> str:
        if self.peek() not in texts or self.next >= len(self.tokens):
            return ""
        self.next += 1
        return self.tokens[self.next - 1][1]

    # Formulas.

    def disjunction(self) -> Value:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ExpressionError(self.at, f"more than {MAX_DEPTH} parentheses inside each other")
        value = self._joined("or", lambda: self._joined("and", self.negation, lambda a, b: a & b), lambda a, b: a | b)
        self.depth -= 1
        return value

    def _joined(self, word: str, part: Callable[[], Value], join: Callable[[Formula, Formula], Formula]) -> Value:
        at = self.at
        value = part()
        while self.peek() == word:
            left = self._formula(value, at)
            self.next += 1
            at = self.at
            value = join(left, self._formula(part(), at))
            if len(value.parts) > MAX_PARTS:
                raise ExpressionError(at, f"the formula has more than {MAX_PARTS} alternatives")
        return value

    def _formula(self, value: Value, at: int) -> Formula:
        if isinstance(value, Quantity):
            raise ExpressionError(at, "a condition is expected here, and this is a number", "compare it: x1 > 0")
        return value

    def _number(self, value: Value, at: int) -> Quantity:
        if isinstance(value, Formula):
            raise ExpressionError(at, "a number is expected here, and this is a condition")
        return value

    def negation(self) -> Value:
        if self.accept("not"):
            at = self.at
            return ~self._formula(self.negation(), at)
        return self.comparison()

    def comparison(self) -> Value:
        at = self.at
        left = self.sum()
        if self.peek() not in ("<", "<=", ">", ">=", "==", "!="):
            return left
        result = everything(self.width)
        while operator := self.accept("<", "<=", ">", ">=", "==", "!="):
            right_at = self.at
            right = self.sum()
            difference = self._sum(self._number(left, at), self._number(right, right_at), -1, right_at)
            result = result & self._compared(difference.value, operator)
            left, at = right, right_at
        return result

    def _compared(self, difference: Affine, operator: str) -> Formula:
        flipped = Affine(tuple(-value for value in difference.coefficients), -difference.constant)
        below = atom(difference, strict=operator in ("<", "!="))
        above = atom(flipped, strict=operator in (">", "!="))
        if operator == "==":
            return Formula(self.width, (Polyhedron(self.width, (below, above)),))
        chosen = {"<": [below], "<=": [below], ">": [above], ">=": [above]}.get(operator, [below, above])
        parts = tuple(Polyhedron(self.width, (one,)) for one in chosen)
        return Formula(self.width, tuple(part for part in parts if not part.is_empty))

    # Numbers.

    def sum(self) -> Value:
        at = self.at
        value = self.term()
        while operator := self.accept("+", "-"):
            right_at = self.at
            right = self._number(self.term(), right_at)
            value = self._sum(self._number(value, at), right, 1 if operator == "+" else -1, right_at)
        return value

    def _sum(self, left: Quantity, right: Quantity, sign: int, at: int) -> Quantity:
        unit = left.unit if left.unit is not None else right.unit
        for one in (left, right):
            if one.unit is None and not one.is_constant:
                raise AssertionError("an expression with variables has a unit")
            if one.unit is not None and one.unit != unit:
                raise ExpressionError(
                    at,
                    f"units do not match: {left.unit} and {right.unit}",
                    f"give a factor its unit in brackets: 0.1[{unit}/({right.unit})]".replace("(", "").replace(")", "")
                    if right.unit is not None and right.unit.powers
                    else "",
                )
        coefficients = (a + sign * b for a, b in zip(left.value.coefficients, right.value.coefficients, strict=True))
        return Quantity(Affine(tuple(coefficients), left.value.constant + sign * right.value.constant), unit)

    def term(self) -> Value:
        at = self.at
        value = self.factor()
        while operator := self.accept("*", "/"):
            right_at = self.at
            left, right = self._number(value, at), self._number(self.factor(), right_at)
            value = self._product(left, right, operator, right_at)
        return value

    def _product(self, left: Quantity, right: Quantity, operator: str, at: int) -> Quantity:
        if operator == "*" and not right.is_constant:
            left, right = right, left
        if not right.is_constant:
            how = "divides by a variable" if operator == "/" else "multiplies two variables"
            raise ExpressionError(
                at, f"this is not linear: it {how}", "only sums of numbers times variables can be verified"
            )
        factor = right.value.constant
        if operator == "/":
            if factor == 0:
                raise ExpressionError(at, "division by 0")
            factor = 1 / factor
        unit = left.unit
        if right.unit is not None:
            unit = (unit or Unit()) * (right.unit if operator == "*" else right.unit.inverse())
        coefficients = tuple(factor * value for value in left.value.coefficients)
        return Quantity(Affine(coefficients, factor * left.value.constant), unit)

    def factor(self) -> Value:
        at = self.at
        if self.accept("-"):
            inner = self._number(self.factor(), at)
            return Quantity(
                Affine(tuple(-value for value in inner.value.coefficients), -inner.value.constant), inner.unit
            )
        if self.accept("("):
            value = self.disjunction()
            if not self.accept(")"):
                raise ExpressionError(self.at, "')' is missing")
            return value
        return self._primary()

    def _primary(self) -> Value:
        if self.next >= len(self.tokens):
            raise ExpressionError(self.end, "the expression ends too early")
        kind, text, at = self.tokens[self.next]
        self.next += 1
        if kind == "number":
            return Quantity(Affine((Fraction(0),) * self.width, Fraction(text)), self._unit())
        if text in ("true", "false"):
            return everything(self.width) if text == "true" else nothing(self.width)
        if kind != "name" or text in KEYWORDS:
            raise ExpressionError(at, f"unexpected '{text}'", "a variable, a number or '(' is expected here")
        if text not in self.units:
            raise ExpressionError(at, f"no variable '{text}'", nearest(text, self.names))
        coefficients = tuple(Fraction(int(name == text)) for name in self.names)
        return Quantity(Affine(coefficients, Fraction(0)), self.units[text])

    def _unit(self) -> Unit | None:
        if self.next >= len(self.tokens) or self.tokens[self.next][0] != "unit":
            return None
        _, text, at = self.tokens[self.next]
        self.next += 1
        try:
            return parse_unit(text[1:-1])
        except ValueError as error:
            raise ExpressionError(at, str(error)) from None

    def finished(self) -> None:
        if self.next < len(self.tokens):
            raise ExpressionError(self.at, f"unexpected '{self.peek()}'")


def parse_formula(text: str, variables: Mapping[str, Unit]) -> Formula:
    """A condition on the variables (name -> unit, in the order of the state).

    Raises:
        ExpressionError: It is none.
    """
    parser = _Parser(text, variables)
    value = parser.disjunction()
    parser.finished()
    return parser._formula(value, 0)


def parse_sum(text: str, variables: Mapping[str, Unit]) -> Quantity:
    """A linear expression.

    Raises:
        ExpressionError: It is none.
    """
    parser = _Parser(text, variables)
    value = parser.disjunction()
    parser.finished()
    return parser._number(value, 0)
