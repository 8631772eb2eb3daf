# SPDX-License-Identifier: MIT
"""Statements and names of scripts: what a name stands for, and how a value is stored."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from functools import cache

from canopy.compiler.blackboard import Entry, Scope, SignalName
from canopy.compiler.bus_reader import Bus, Message, Signal
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.numbers import exact
from canopy.compiler.script.arithmetic import Arithmetic
from canopy.compiler.script.outputs import write_signal
from canopy.compiler.script.storing import Storing, stripped
from canopy.compiler.script.syntax import (
    Assignment,
    Binary,
    Comparison,
    Conditional,
    Expression,
    Name,
    Number,
    ScriptError,
    Text,
    Unary,
    parts,
)
from canopy.compiler.script.values import (
    INT64,
    Const,
    Double,
    Num,
    TextConst,
    TextVar,
    Value,
    boolean,
    common_scale,
)

FAULTS = "&app->entries.script_faults"


class UntypedError(Exception):
    """An entry whose type is not known yet."""

    def __init__(self, entry: Entry) -> None:
        super().__init__(entry.name)
        self.entry = entry


class Texts:
    """The application's table of texts: each one once, in the order in which they were first met."""

    def __init__(self, texts: Iterable[str] = ("",)) -> None:
        self._places = {text: place for place, text in enumerate(texts)}

    @property
    def all(self) -> tuple[str, ...]:
        """The texts, each at its place."""
        return tuple(self._places)

    def index(self, text: str) -> int:
        """The text's place in the table; 0 is the empty text, which entries begin with."""
        return self._places.setdefault(text, len(self._places))


def guess(text: str) -> Const | TextConst:
    """The value of a literal without a type: true, false, a number, or else a text."""
    if text.strip() in ("true", "false"):
        return Const(Fraction(text.strip() == "true"), is_bool=True)
    try:
        return Const(exact(text))
    except ValueError:
        return TextConst(text)


@cache
def _steps(scale: Decimal, offset: Decimal) -> tuple[Fraction, Fraction, Fraction]:
    """A signal's scale and offset exactly, and the step of which both are multiples."""
    return Fraction(scale), Fraction(offset), common_scale(abs(Fraction(scale)), abs(Fraction(offset)))


class Compiler:
    """Compiles the expressions of one script.

    `used`: the messages it reads; `tested`: those it asks for `.fresh`; `parts`: C flags of multiplexed signals.
    """

    def __init__(self, scope: Scope, place: Place, bus: Bus, texts: Texts, floats: bool) -> None:
        self.scope = scope
        self._place = place
        self.bus = bus
        self._texts = texts
        self.arithmetic = Arithmetic(floats, FAULTS, texts.index)
        self.storing = Storing(self.arithmetic, FAULTS)
        self.used: dict[str, Message] = {}
        self.tested: set[str] = set()
        self.parts: set[str] = set()
        self._first: list[str] = []
        self._seen: set[int] = set()
        self._choosing = 0

    # Values

    def evaluate(self, expression: Expression) -> Value:
        """The expression's value."""
        if isinstance(expression, Number):
            return Const(expression.value, expression.is_bool)
        if isinstance(expression, Text):
            return TextConst(expression.text)
        if isinstance(expression, Name):
            return self.named(expression.name, expression.index)
        if isinstance(expression, Unary):
            return self.arithmetic.unary(expression.operator, self.evaluate(expression.operand), expression.index)
        if isinstance(expression, Binary):
            return self._binary(expression)
        if isinstance(expression, Comparison):
            return self._chain(expression)
        if isinstance(expression, Conditional):
            condition = self.truth(expression.condition)
            self._choosing += 1
            yes, no = self.evaluate(expression.yes), self.evaluate(expression.no)
            self._choosing -= 1
            return self.arithmetic.choose(condition, yes, no, expression.index)
        assert isinstance(expression, Assignment)
        return self._assigned(expression)

    def _assigned(self, expression: Assignment) -> Value:
        """An assignment inside an expression: it is done before the rest, which must not have read the entry."""
        target = self._resolve(expression.target.name, expression.target.index)
        if self._choosing or isinstance(target, SignalName) or id(target) in self._seen:
            why = "that is not always reached" if self._choosing else "that reads the entry before"
            message = f"an assignment inside an expression {why}"
            raise ScriptError(expression.index, message, "make it a statement of its own")
        lines = self._lines(expression)
        self._first += lines
        return self.stored(target, expression.index)

    def first(self) -> list[str]:
        """C lines of assignments inside the expressions that were evaluated since the last call."""
        lines, self._first = self._first, []
        self._seen.clear()
        return lines

    def truth(self, expression: Expression) -> Num | Const:
        """The expression as a condition."""
        return self.arithmetic.truth(self.evaluate(expression), expression.index)

    def _binary(self, expression: Binary) -> Value:
        if expression.operator not in ("&&", "||"):
            left, right = self.evaluate(expression.left), self.evaluate(expression.right)
            return self.arithmetic.binary(expression.operator, left, right, expression.index)
        return self._both(expression.operator, self.truth(expression.left), self.truth(expression.right))

    @staticmethod
    def _both(sign: str, left: Num | Const, right: Num | Const) -> Num | Const:
        decides = Fraction(sign == "||")  # a constant that decides, whatever the other side is
        for one, other in ((left, right), (right, left)):
            if isinstance(one, Const):
                return Const(decides, is_bool=True) if one.value == decides else other
        assert isinstance(left, Num) and isinstance(right, Num)
        return boolean(f"({left.c} {sign} {right.c})")

    def _chain(self, expression: Comparison) -> Num | Const:
        values = [self._comparable(part, expression) for part in expression.operands]
        answer: Num | Const = Const(Fraction(1), is_bool=True)
        for place, sign in enumerate(expression.operators):
            index = expression.operands[place + 1].index
            answer = self._both("&&", answer, self.arithmetic.compare(sign, values[place], values[place + 1], index))
        return answer

    def _comparable(self, part: Expression, chain: Comparison) -> Value:
        """A name of a signal's value may stand without quotes beside the signal, as enums do in BehaviorTree.CPP."""
        if isinstance(part, Name) and "." not in part.name and not self.scope.knows(part.name):
            for other in chain.operands:
                if isinstance(other, Name) and "." in other.name:
                    value = self.named(other.name, other.index)
                    if isinstance(value, Num) and part.name in value.choices:
                        return TextConst(part.name)
        return self.evaluate(part)

    # Names

    def named(self, name: str, index: int) -> Value:
        """What a name's value is; the values of enums come first, as in BehaviorTree.CPP."""
        if name in self.scope.board.enums:
            return Const(Fraction(self.scope.board.enums[name]))
        return self.target_value(self._resolve(name, index), index)

    def _resolve(self, name: str, index: int) -> Entry | SignalName:
        try:
            return self.scope.resolve(name, self._place)
        except CompileError as error:
            raise ScriptError(index, error.message, error.help_text) from error

    def entry(self, entry: Entry, index: int) -> Value:
        """An entry's value."""
        if entry.is_constant:
            if entry.initial in dict(entry.type.names):
                return Const(Fraction(dict(entry.type.names)[entry.initial or ""]))
            value = guess(entry.initial or "")
            return TextConst(entry.initial or "") if entry.type.kind == "text" else value
        if entry.initial is None and not entry.is_written:
            hint = f"{self.scope.help_for(entry.name)}; a value of an enum is declared: <Enum> in <TreeNodesModel>"
            raise ScriptError(index, f"nothing writes entry '{entry.name}'", hint)
        return self.stored(entry, index)

    def stored(self, entry: Entry, index: int) -> Value:
        """The value of the entry's member."""
        self._seen.add(id(entry))
        c, kind = f"app->entries.{entry.c_name}", entry.type
        if kind.kind == "any":
            raise UntypedError(entry)
        if kind.kind == "user":
            raise ScriptError(index, f"'{entry.name}' is of your type {kind.c}: scripts cannot read it", "write a leaf")
        if kind.kind == "text":
            return TextVar(c)
        if kind.kind == "float":
            return Double(c if kind.c == "double" else f"(double){c}")
        if kind.high > INT64[1]:
            return Num(f"canopy_limit_unsigned({c}, {FAULTS})", "int64_t", 0, INT64[1], kind.scale)
        choices = dict(kind.names)
        return Num(c, kind.c, kind.low, kind.high, kind.scale, is_bool=kind.kind == "bool", choices=choices)

    def message(self, name: str, messages: tuple[Message, ...], verb: str, index: int) -> Message:
        """The message of that name.

        Raises:
            ScriptError: it is none of these.
        """
        for message in messages:
            if message.name == name:
                return message
        known = [message.name for message in messages]
        raise ScriptError(
            index, f"node '{self.bus.node}' of {self.bus.path.name} does not {verb} '{name}'", nearest(name, known)
        )

    def signal(self, text: str, index: int) -> Num | Double:
        """A received signal in physical units, or whether its message is fresh."""
        message_name, _, signal_name = text.partition(".")
        message = self.message(message_name, self.bus.receive, "receive", index)
        member = f"app->input.{message.c_name}"
        if signal_name == "fresh":
            self.tested.add(message.name)
            return Num(f"{member}.fresh", "bool", 0, 1, is_bool=True)
        signal = self.known_signal(message, signal_name, index)
        self.used[message.name] = message
        if signal in message.multiplexed:
            self.parts.add(f"{member}.{signal.has_name}")
        c = f"{member}.{signal.c_name}"
        if signal.is_float:
            return self._float(Double(c if signal.c_type == "double" else f"(double){c}"), signal, index)
        if signal.is_bool:
            return Num(c, "bool", 0, 1, is_bool=True)
        low, high = signal.limits
        raw = Num(c, signal.c_type, low, high)
        if high > INT64[1]:
            raw = Num(f"canopy_limit_unsigned({c}, {FAULTS})", "int64_t", 0, INT64[1])
        return self._physical(raw, signal, index)

    def known_signal(self, message: Message, name: str, index: int) -> Signal:
        """The signal of that name.

        Raises:
            ScriptError: the message has none, or it is floating point where that is not allowed.
        """
        for signal in message.signals:
            if signal.name == name and signal.is_float and not self.arithmetic.floats:
                raise ScriptError(
                    index,
                    f"'{message.name}.{name}' is floating point, which this application does not allow",
                    "use a leaf, or compile with --allow-floating-point",
                )
            if signal.name == name:
                return signal
        known = ["fresh", *(signal.name for signal in message.signals)]
        raise ScriptError(index, f"message '{message.name}' has no signal '{name}'", nearest(name, known))

    def _float(self, raw: Double, signal: Signal, index: int) -> Double:
        """A floating-point signal in physical units."""
        scaled = raw if signal.scale == 1 else self.arithmetic.binary("*", raw, Const(Fraction(signal.scale)), index)
        if signal.offset != 0:
            scaled = self.arithmetic.binary("+", scaled, Const(Fraction(signal.offset)), index)
        assert isinstance(scaled, Double)
        return scaled

    def _physical(self, raw: Num, signal: Signal, index: int) -> Num:
        scale, offset, step = _steps(signal.scale, signal.offset)
        value = self.arithmetic.scaled(Num(raw.c, raw.c_type, raw.low, raw.high, abs(scale)), step, index)
        if scale < 0:
            negative = self.arithmetic.unary("-", value, index)
            assert isinstance(negative, Num)
            value = negative
        shift = int(offset / step)
        if shift:
            moved = self.arithmetic.binary("+", value, Const(offset), index)
            assert isinstance(moved, Num)
            value = moved
        factor = int(scale / step)
        names = {text: raw_value * factor + shift for raw_value, text in signal.choices}
        return Num(value.c, value.c_type, value.low, value.high, value.scale, choices=names)

    def target_value(self, target: Entry | SignalName, index: int) -> Value:
        """The value of what a name stands for."""
        return self.signal(target.text, index) if isinstance(target, SignalName) else self.entry(target, index)

    def compare_values(self, sign: str, left: Value, right: Value) -> Num | Const:
        """A comparison of values that are no expressions: a Switch's cases."""
        return self.arithmetic.compare(sign, left, right, 0)

    # Statements

    def statement(self, expression: Expression) -> list[str]:
        """C lines of a statement; none for one that only computes."""
        if isinstance(expression, Conditional) and any(isinstance(part, Assignment) for part in parts(expression)):
            return self._branches(expression)
        if not isinstance(expression, Assignment):
            self.evaluate(expression)
            return self.first()
        lines = self._lines(expression)
        return [*self.first(), *lines]

    def _branches(self, expression: Conditional) -> list[str]:
        """A choice between statements: `c ? a := 1 : b := 2`."""
        condition = self.truth(expression.condition)
        first = self.first()
        yes, no = self.statement(expression.yes), self.statement(expression.no)
        if isinstance(condition, Const):
            return [*first, *(yes if condition.value else no)]
        indented = [[f"    {line}" for line in lines] for lines in (yes, no)]
        lines = [f"if ({stripped(condition.c)}) {{", *indented[0]]
        return [*first, *lines, *(["} else {", *indented[1]] if no else []), "}"]

    def _lines(self, expression: Assignment) -> list[str]:
        if expression.target.name in self.scope.board.enums:
            message = f"'{expression.target.name}' is a value of an enum: it cannot be written"
            raise ScriptError(expression.target.index, message, "give the entry another name")
        target = self._resolve(expression.target.name, expression.target.index)
        if isinstance(target, SignalName):
            return write_signal(self, target.text, expression)
        value = self.evaluate(expression.value)
        if expression.operator not in (":=", "="):
            value = self.arithmetic.binary(
                expression.operator[0], self.stored(target, expression.index), value, expression.index
            )
        if target.type.kind == "any":
            raise UntypedError(target)
        return self.store(target, self.storing.convert(value, target.type, expression.value.index))

    @staticmethod
    def store(target: Entry, c: str) -> list[str]:
        """C lines that write an entry."""
        lines = [f"app->entries.{target.c_name} = {stripped(c)};"]
        if target.counted:
            lines.append(f"app->entries.{target.c_name}_updates++;")
        return lines
