# SPDX-License-Identifier: MIT
"""Scripts and entries as a trace has them, in plain arithmetic: what the circuit of scripts is judged by."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from fractions import Fraction

from canopy.compiler.blackboard import Entry, Scope, SignalName, pointer
from canopy.compiler.errors import Place
from canopy.compiler.script import syntax
from canopy.compiler.script.compile import guess
from canopy.compiler.script.syntax import (
    Assignment,
    Binary,
    Comparison,
    Conditional,
    Expression,
    Name,
    Number,
    Unary,
)
from canopy.compiler.script.values import Const
from canopy.compiler.script_bodies import entry_value
from canopy.compiler.tree import Script
from canopy.verify.logic.board import FORMULA, Board, Fact, steps_of
from canopy.verify.logic.memory import Key

Plain = Fraction | str
_ORDER = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
_SUMS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}
_BITS = {"&": operator.and_, "|": operator.or_, "^": operator.xor}


class Runner:
    """`bits`, `numbers`: what the trace gives to the tick; set them before each."""

    def __init__(self, board: Board, unknown: set[tuple[int, str]]) -> None:
        self._board = board
        self._unknown = unknown
        self.entries = [board.initial(entry) for entry in board.entries]
        self.updates = [0] * len(self.entries)
        self.bits: Mapping[Key, bool] = {}
        self.numbers: Mapping[Key, int] = {}

    def knows(self, node: int, what: str) -> bool:
        """Is the script followed? Else the trace says what it answers."""
        return (node, what) in self._board.scripts and (node, what) not in self._unknown and what != "_onHalted"

    def write(self, place: int, value: int) -> None:
        """Writes an entry."""
        self.entries[place] = value
        self.updates[place] += 1

    def held(self) -> tuple[int, ...]:
        """What each entry holds, in steps; 0 for an open one."""
        return tuple(0 if place in self._board.open else steps for place, steps in enumerate(self.entries))

    def leaf(self, node: int, answer: int) -> int:
        """A leaf that answers as the trace says is ticked: what it returns. It writes what the trace says."""
        reads = self._board.reads.get(node)
        if reads is not None and not self.known(reads.messages, reads.signals):
            return reads.stale
        for place, _ in self._board.may_write.get(node, ()):
            if self.bits.get(("writes", node, place), False):
                self.write(place, self.numbers["value", node, place])
        return answer

    def updates_for(self, node: int) -> int | None:
        """How often the entry that a node asks for was written; None: the trace says whether it is new."""
        script = self._board.scripts.get((node, "is true"))
        place = self._board.place(script.target) if script is not None and script.role == "updates" else None
        return None if place is None or place in self._board.open else self.updates[place]

    def run_unknown(self, node: int, what: str) -> None:
        """A script that is not followed writes what the trace says."""
        script = self._board.scripts.get((node, what))
        for place in self._board.targets(script) if script is not None else ():
            if self.bits.get(("writes", node, what, place), False):
                self.write(place, self.numbers["becomes", node, what, place])

    # Scripts

    def run(self, node: int, what: str) -> bool:
        """Runs a script. Returns what it answers."""
        script = self._board.scripts[node, what]
        if script.role == "unset":
            place = self._board.place(script.target)
            if place is not None:
                self.entries[place] = self._board.initial(self._board.entries[place])
            return True
        if script.role == "set":
            return self._set(script, (node, what))
        statements = self._board.read(script)
        if not self.known(*self._board.needs(script.scope, script.place(), statements)):
            return False
        values = Values(self, script.scope, script.place(), (node, what))
        for statement in statements:
            if isinstance(statement, Assignment):
                self._assign(script, values, statement)
        last = statements[-1].target if isinstance(statements[-1], Assignment) else statements[-1]
        return script.role == "action" or values.evaluate(last) != 0

    def known(self, messages: set[str], signals: set[str]) -> bool:
        """Are these messages fresh, and have these signals come?"""
        keys = [("fresh", name) for name in messages] + [("come", name) for name in signals]
        return all(self.bits.get(key, False) for key in keys)

    def _assign(self, script: Script, values: Values, statement: Assignment) -> None:
        target = script.scope.resolve(statement.target.name, script.place())
        if isinstance(target, SignalName):
            return
        value = values.evaluate(statement.value)
        if statement.operator not in (":=", "="):
            value = values.binary(statement.operator[0], values.entry(target), value)
        self._store(target, value)

    def _store(self, target: Entry, value: Plain) -> None:
        place = self._board.place(target)
        if place is None:
            return
        kind = target.type
        if isinstance(value, str):
            steps = self._board.text(value)
        elif kind.kind == "bool":
            steps = int(value != 0)
        else:
            steps = max(kind.low, min(kind.high, int(value / kind.scale)))
        self.write(place, steps)

    def _set(self, script: Script, key: Key) -> bool:
        source, target = entry_value(script), script.target
        assert isinstance(target, Entry)
        if isinstance(source, SignalName) and not self.known(*self._board.needs_of([source.text])):
            return False
        if self._board.place(target) is None:
            return True
        values = Values(self, script.scope, script.place(), key)
        if isinstance(source, str):
            self._store(target, source if target.type.kind == "text" else literal(source))
        else:
            self._store(target, values.target(source))
        return True

    def case(self, node: int) -> int | None:
        """The place of a Switch's case that matches; that of the default, if none does. None: the trace says it."""
        if not self.knows(node, "is true"):
            return None
        script = self._board.scripts[node, "is true"]
        count = len([name for name in script.element.attributes if name.startswith("case_")])
        if not self.known(*self._board.needs_of(self._board.signals_in(script))):
            return count
        values = Values(self, script.scope, script.place(), (node, "is true"))
        variable, names = values.named(script.text, "variable"), values.choices(script.text, "variable")
        for case in range(count):
            attribute = f"case_{case + 1}"
            text = script.element.attributes[attribute]
            value = values.named(text, attribute)
            if isinstance(variable, str) and pointer(text, attribute) is None:
                value = text
            if (names.get(value) if isinstance(value, str) and names else value) == variable:
                return case
        return count

    def holds(self, fact: Fact) -> bool:
        """Does a condition of the formula hold after the tick?"""
        if fact.condition is None:
            return self.bits.get(("fresh", fact.message), False)
        scope, place = self._board.main, FORMULA
        if not self.known(*self._board.needs(scope, place, [fact.condition])):
            return False
        return Values(self, scope, place, ()).evaluate(fact.condition) != 0

    # What names stand for

    def entry(self, place: int, key: Key) -> Plain:
        """What an entry holds, in the entry's unit."""
        asked: Key = ("read", *key, place)
        steps = self.numbers[asked] if place in self._board.open else self.entries[place]
        kind = self._board.entries[place].type
        if kind.kind != "text":
            return steps * kind.scale
        return next((text for text, number in self._board.texts.items() if number == steps), "")

    def raw(self, name: str) -> int:
        """A signal's raw value."""
        received = self._board.received(name)
        assert received is not None
        come = {name} if received.signal.selectors else set()
        valid = received.ever == received.values or self.known({received.message.name}, come)
        return self.numbers["signal" if valid else "old signal", name]

    def place(self, entry: Entry) -> int | None:
        """The entry's place."""
        return self._board.place(entry)

    def signal_names(self, name: str) -> dict[str, Fraction]:
        """The values that a signal's table names, in its unit."""
        received = self._board.received(name)
        if received is None:
            return {}
        scale, offset = steps_of(received.signal)
        return {text: value * scale + offset for value, text in received.signal.choices}

    def physical(self, name: str) -> Fraction:
        """A signal's value in its unit."""
        message, _, signal = name.partition(".")
        if signal == "fresh":
            return Fraction(self.bits.get(("fresh", message), False))
        received = self._board.received(name)
        assert received is not None
        scale, offset = steps_of(received.signal)
        return self.raw(name) * scale + offset


def literal(text: str) -> Plain:
    """A value without a type."""
    value = guess(text)
    return value.value if isinstance(value, Const) else value.text


class Values:
    """The expressions of one script."""

    def __init__(self, runner: Runner, scope: Scope, place: Place, key: Key) -> None:
        self._runner = runner
        self._scope = scope
        self._place = place
        self._key = key

    def entry(self, entry: Entry) -> Plain:
        """What an entry holds."""
        place = self._runner.place(entry)
        assert place is not None, "the circuit follows this script"
        return self._runner.entry(place, self._key)

    def target(self, target: Entry | SignalName) -> Plain:
        """What a name stands for."""
        if isinstance(target, SignalName):
            return self._runner.physical(target.text)
        if target.is_constant:
            return (target.initial or "") if target.type.kind == "text" else literal(target.initial or "")
        return self.entry(target)

    def named(self, text: str, attribute: str) -> Plain:
        """What an attribute says: a name in braces, or a literal."""
        name = pointer(text, attribute)
        return literal(text) if name is None else self.target(self._scope.resolve(name, self._place))

    def choices(self, text: str, attribute: str) -> dict[str, Fraction]:
        """The named values of a signal in braces."""
        name = pointer(text, attribute)
        target = self._scope.resolve(name, self._place) if name is not None else None
        return self._runner.signal_names(target.text) if isinstance(target, SignalName) else {}

    def evaluate(self, expression: Expression) -> Plain:
        """The expression's value."""
        match expression:
            case Number():
                return expression.value
            case syntax.Text():
                return expression.text
            case Name():
                enums = self._scope.board.enums
                if expression.name in enums:
                    return Fraction(enums[expression.name])
                return self.target(self._scope.resolve(expression.name, self._place))
            case Unary():
                return self._unary(expression)
            case Comparison():
                return self._chain(expression)
            case Conditional():
                chosen = expression.yes if self.evaluate(expression.condition) != 0 else expression.no
                return self.evaluate(chosen)
            case Binary():
                if expression.operator in ("&&", "||"):
                    sides = (self.evaluate(expression.left) != 0, self.evaluate(expression.right) != 0)
                    return Fraction(all(sides) if expression.operator == "&&" else any(sides))
                return self.binary(expression.operator, self.evaluate(expression.left), self.evaluate(expression.right))
        raise AssertionError("not an expression")

    def _unary(self, expression: Unary) -> Fraction:
        value = self.evaluate(expression.operand)
        assert isinstance(value, Fraction)
        if expression.operator == "!":
            return Fraction(value == 0)
        return -value if expression.operator == "-" else Fraction(~int(value))

    @staticmethod
    def binary(sign: str, left: Plain, right: Plain) -> Plain:
        """Arithmetic and bits."""
        assert isinstance(left, Fraction) and isinstance(right, Fraction)
        if sign in _BITS:
            return Fraction(_BITS[sign](int(left), int(right)))
        result = _SUMS[sign](left, right)
        assert isinstance(result, Fraction)
        return result

    def _chain(self, chain: Comparison) -> Fraction:
        names: dict[str, Fraction] = {}
        for part in chain.operands:
            target = (
                self._scope.resolve(part.name, self._place) if isinstance(part, Name) and "." in part.name else None
            )
            names |= self._runner.signal_names(target.text) if isinstance(target, SignalName) else {}
        values = []
        for part in chain.operands:
            is_bare = isinstance(part, Name) and part.name in names and not self._scope.knows(part.name)
            values.append(part.name if is_bare and isinstance(part, Name) else self.evaluate(part))
        if any(isinstance(value, Fraction) for value in values):
            values = [names.get(value, value) if isinstance(value, str) else value for value in values]
        rows = zip(chain.operators, values, values[1:], strict=False)
        return Fraction(all(_ORDER[sign](left, right) for sign, left, right in rows))
