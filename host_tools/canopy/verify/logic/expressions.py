# SPDX-License-Identifier: MIT
"""Expressions of scripts in a circuit, exactly: numbers are whole multiples of a step, as the compiler has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from canopy.compiler.blackboard import Entry, Scope, SignalName
from canopy.compiler.errors import Place
from canopy.compiler.port_types import PortType
from canopy.compiler.script.compile import guess
from canopy.compiler.script.syntax import (
    Assignment,
    Binary,
    Comparison,
    Conditional,
    Expression,
    Name,
    Number,
    Text,
    Unary,
)
from canopy.compiler.script.values import Const, common_scale
from canopy.verify.logic.board import steps_of
from canopy.verify.logic.memory import Memory
from canopy.verify.logic.words import NotModelledError, Word

BITS = ("&", "|", "^")


@dataclass(frozen=True)
class Amount:
    """A number: `word` steps of `step`. `choices`: the names of a signal's values, in steps."""

    word: Word
    step: Fraction = Fraction(1)
    choices: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class TextValue:
    """A text, by its number; `text` is there if it is known."""

    word: Word
    text: str | None = None


Value = Amount | TextValue


class Expressions:
    """Evaluates what stands in one script. `key`: the node, and what the script is for."""

    def __init__(self, memory: Memory, scope: Scope, place: Place, key: tuple[str | int, ...]) -> None:
        self._memory = memory
        self._words = memory.words
        self._scope = scope
        self._place = place
        self._key = key

    def evaluate(self, expression: Expression) -> Value:
        """The expression's value.

        Raises:
            NotModelledError: It is in floating point, or too large.
        """
        if isinstance(expression, Number):
            return self.constant(expression.value)
        if isinstance(expression, Text):
            return self.text(expression.text)
        if isinstance(expression, Name):
            return self.named(expression.name)
        if isinstance(expression, Assignment):
            raise NotModelledError("it assigns inside an expression")
        if isinstance(expression, Unary):
            return self._unary(expression.operator, self._amount(expression.operand))
        if isinstance(expression, Comparison):
            return Amount(self._words.truth(self._chain(expression)))
        if isinstance(expression, Conditional):
            yes, no = self.evaluate(expression.yes), self.evaluate(expression.no)
            return self._choose(self.truth(expression.condition), yes, no)
        assert isinstance(expression, Binary)
        return self._binary(expression)

    def truth(self, expression: Expression) -> int:
        """The literal that says that the expression is not 0."""
        return self._words.is_not_zero(self._amount(expression).word)

    def constant(self, value: Fraction) -> Amount:
        """A number that is written down."""
        step = abs(value) if value.denominator != 1 else Fraction(1)
        return Amount(self._words.constant(int(value / step)), step)

    def text(self, text: str) -> TextValue:
        """A text that is written down."""
        return TextValue(self._words.constant(self._memory.board.text(text)), text)

    def literal(self, text: str) -> Value:
        """A value without a type: true, false, a number, or else a text."""
        value = guess(text)
        return self.constant(value.value) if isinstance(value, Const) else self.text(text)

    def _amount(self, expression: Expression) -> Amount:
        value = self.evaluate(expression)
        if not isinstance(value, Amount):
            raise NotModelledError("it computes with a text")
        return value

    # Names

    def named(self, name: str) -> Value:
        """What a name's value is; the values of enums come first."""
        enums = self._scope.board.enums
        if name in enums:
            return self.constant(Fraction(enums[name]))
        return self.target(self._scope.resolve(name, self._place))

    def target(self, target: Entry | SignalName) -> Value:
        """What a name's value is."""
        if isinstance(target, SignalName):
            return self._signal(target.text)
        if target.is_constant and target.type.names:
            raise NotModelledError(f"entry '{target.name}' is a value of an enum")
        if target.is_constant:
            return self.text(target.initial or "") if target.type.kind == "text" else self.literal(target.initial or "")
        return self.stored(target)

    def stored(self, entry: Entry) -> Value:
        """What an entry holds."""
        place = self._memory.board.place(entry)
        if place is None:
            raise NotModelledError(f"entry '{entry.name}' is {entry.type}")
        word = self._memory.read(place, *self._key)
        return TextValue(word) if entry.type.kind == "text" else Amount(word, entry.type.scale)

    def _signal(self, name: str) -> Amount:
        message, _, signal_name = name.partition(".")
        if signal_name == "fresh":
            return Amount(self._words.truth(self._memory.fresh(message)))
        raw = self._memory.signal(name)
        received = self._memory.board.received(name)
        if raw is None or received is None:
            raise NotModelledError(f"'{name}' is floating point")
        scale, offset = steps_of(received.signal)
        step = common_scale(abs(scale), abs(offset))
        factor, shift = int(scale / step), int(offset / step)
        word = self._words.add(self._words.multiply(raw, self._words.constant(factor)), self._words.constant(shift))
        return Amount(word, step, {text: value * factor + shift for value, text in received.signal.choices})

    # Operators

    def in_steps(self, value: Amount, step: Fraction) -> Word:
        """How many steps of a size a number is, of which its own step is a multiple."""
        factor = value.step / step
        if factor.denominator != 1:
            raise NotModelledError("it would be rounded")
        return self._words.multiply(value.word, self._words.constant(int(factor)))

    def _both_in_steps(self, left: Amount, right: Amount) -> tuple[Word, Word, Fraction]:
        step = common_scale(left.step, right.step)
        return self.in_steps(left, step), self.in_steps(right, step), step

    def _unary(self, sign: str, value: Amount) -> Amount:
        if sign == "!":
            return Amount(self._words.truth(self._words.is_not_zero(value.word) ^ 1))
        if sign == "-":
            return self._folded(Amount(self._words.subtract(self._words.constant(0), value.word), value.step))
        return Amount(self._words.inverted(self.in_steps(value, Fraction(1))))

    def _binary(self, expression: Binary) -> Value:
        sign = expression.operator
        if sign in ("&&", "||"):
            left, right = self.truth(expression.left), self.truth(expression.right)
            circuit = self._memory.circuit
            return Amount(self._words.truth((circuit.both if sign == "&&" else circuit.either)(left, right)))
        return self.computed(sign, self.evaluate(expression.left), self.evaluate(expression.right))

    def _folded(self, value: Amount) -> Amount:
        """A number that is known has the step of one that is written down: 3.5 * 2 is 7 whole steps."""
        known = value.word.constant
        return value if known is None else self.constant(known * value.step)

    def computed(self, sign: str, left: Value, right: Value) -> Value:
        """Arithmetic and bits."""
        if isinstance(left, TextValue) or isinstance(right, TextValue) or sign == "..":
            raise NotModelledError("it joins texts")
        return self._folded(self._computed(sign, left, right))

    def _computed(self, sign: str, left: Amount, right: Amount) -> Amount:
        if sign in BITS:
            one, two = self.in_steps(left, Fraction(1)), self.in_steps(right, Fraction(1))
            return Amount(self._words.bitwise(sign, one, two))
        if sign in "+-":
            one, two, step = self._both_in_steps(left, right)
            return Amount(self._words.add(one, two) if sign == "+" else self._words.subtract(one, two), step)
        if sign == "/":
            return self._divided(left, right)
        return Amount(self._words.multiply(left.word, right.word), left.step * right.step)

    def _divided(self, left: Amount, right: Amount) -> Amount:
        if right.word.constant is None:
            raise NotModelledError("it divides in floating point")
        by = right.word.constant * right.step
        word = left.word if by > 0 else self._words.subtract(self._words.constant(0), left.word)
        return Amount(word, left.step / abs(by))

    def _chain(self, chain: Comparison) -> int:
        values = [self._comparable(part, chain) for part in chain.operands]
        rows = zip(chain.operators, values, values[1:], strict=False)
        return self._memory.circuit.all(self.compared(*row) for row in rows)

    def _comparable(self, part: Expression, chain: Comparison) -> Value:
        """As the compiler has it: a name of a signal's value may stand without quotes beside the signal."""
        if isinstance(part, Name) and "." not in part.name and not self._scope.knows(part.name):
            for other in chain.operands:
                if isinstance(other, Name) and "." in other.name:
                    value = self.evaluate(other)
                    if isinstance(value, Amount) and part.name in value.choices:
                        return self.text(part.name)
        return self.evaluate(part)

    def compared(self, sign: str, left: Value, right: Value) -> int:
        """The literal of one comparison."""
        if isinstance(left, TextValue) and isinstance(right, Amount):
            left, right = right, left
        if isinstance(left, TextValue) or isinstance(right, TextValue):
            if sign not in ("==", "!="):
                raise NotModelledError("it asks for the order of texts")
            one, two = self._texts(left, right)
            return self._words.equal(one, two) ^ (sign == "!=")
        one, two, _ = self._both_in_steps(left, right)
        if sign in ("==", "!="):
            return self._words.equal(one, two) ^ (sign == "!=")
        if sign in (">", "<="):
            one, two = two, one
        return self._words.less(one, two) ^ (sign in ("<=", ">="))

    def _texts(self, left: Value, right: Value) -> tuple[Word, Word]:
        if isinstance(left, Amount):
            text = right.text if isinstance(right, TextValue) else None
            if text is None or text not in left.choices:
                raise NotModelledError("it compares a number with a text")
            return left.word, self._words.constant(left.choices[text])
        return left.word, right.word

    def _choose(self, condition: int, yes: Value, no: Value) -> Value:
        if isinstance(yes, Amount) and isinstance(no, Amount):
            one, two, step = self._both_in_steps(yes, no)
            return Amount(self._words.choose(condition, one, two), step)
        if not isinstance(yes, TextValue) or not isinstance(no, TextValue):
            raise NotModelledError("it chooses between a number and a text")
        return TextValue(self._words.choose(condition, yes.word, no.word))

    def converted(self, value: Value, kind: PortType) -> Word:
        """The value as an entry of a type holds it: limited to its range."""
        if isinstance(value, TextValue) != (kind.kind == "text"):
            raise NotModelledError("it stores a text as a number, or a number as a text")
        if isinstance(value, TextValue):
            return value.word
        if kind.kind == "bool":
            return self._words.truth(self._words.is_not_zero(value.word))
        return self._words.limited(self.in_steps(value, kind.scale), kind.low, kind.high)
