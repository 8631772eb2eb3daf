# SPDX-License-Identifier: MIT
"""Scripts of a tree, run exactly: numbers, entries of the main tree, signals in physical units."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
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
    ScriptError,
    Unary,
    parse,
    parts,
)
from canopy.compiler.tree import Script
from canopy.convert.machine import AskingWorld, Program

_COMPARE: dict[str, Callable[[Fraction, Fraction], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_ARITHMETIC: dict[str, Callable[[Fraction, Fraction], Fraction]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
}


class _Evaluator:
    def __init__(self, world: AskingWorld, entries: Mapping[str, int]) -> None:
        self._world = world
        self._entries = entries

    def value(self, part: Expression) -> Fraction:
        if isinstance(part, Number):
            return part.value
        if isinstance(part, Name):
            return self._named(part.name)
        if isinstance(part, Unary):
            inner = self.value(part.operand)
            return Fraction(inner == 0) if part.operator == "!" else -inner
        if isinstance(part, Binary):
            return self._binary(part)
        if isinstance(part, Comparison):
            return self._chain(part)
        if isinstance(part, Conditional):
            return self.value(part.yes if self.value(part.condition) != 0 else part.no)
        assert isinstance(part, Assignment), part  # program() refuses anything else
        value = self.value(part.value)
        if part.operator not in (":=", "="):
            value = _ARITHMETIC[part.operator[0]](self._named(part.target.name), value)
        assert value.denominator == 1, "the compiler refuses an entry that would have to be rounded"
        self._world.write(self._entries[part.target.name], int(value))
        return value

    def _named(self, name: str) -> Fraction:
        if name in self._entries:
            return Fraction(self._world.entries[self._entries[name]])
        if name.endswith(".fresh"):
            return Fraction(self._world.fresh(name.removesuffix(".fresh")))
        return self._world.signal(name)

    def _binary(self, part: Binary) -> Fraction:
        left = self.value(part.left)
        if part.operator == "&&":
            return Fraction(left != 0 and self.value(part.right) != 0)
        if part.operator == "||":
            return Fraction(left != 0 or self.value(part.right) != 0)
        return _ARITHMETIC[part.operator](left, self.value(part.right))

    def _chain(self, part: Comparison) -> Fraction:
        left = self.value(part.operands[0])
        for sign, operand in zip(part.operators, part.operands[1:], strict=True):
            right = self.value(operand)
            if not _COMPARE[sign](left, right):
                return Fraction(0)
            left = right
        return Fraction(1)


def _check(script: Script, every: list[Expression]) -> None:
    """Refuses what is not run here."""
    for part in every:
        wrong = None
        if (isinstance(part, Unary) and part.operator == "~") or (
            isinstance(part, Binary) and part.operator not in (*_ARITHMETIC, "&&", "||")
        ):
            wrong = part.operator
        elif isinstance(part, Assignment) and (part.operator == "/=" or "." in part.target.name):
            wrong = f"{part.target.name} {part.operator}"
        elif not isinstance(part, Number | Name | Unary | Binary | Comparison | Conditional | Assignment):
            wrong = "a text"
        elif isinstance(part, Name) and part.name.startswith("@"):
            wrong = part.name
        if wrong is not None:
            raise CompileError(
                script.place(part.index),
                f"'{wrong}' in a script cannot be checked for equivalence",
                "numbers, entries, signals, comparisons, && and ||, + - * can",
            )


def program(script: Script, entries: Mapping[str, int]) -> Program:
    """A script that can be run. `entries`: where the world keeps each entry.

    Raises:
        CompileError: it is no script, or has in it what is not run here.
    """
    try:
        statements = parse(script.text)
    except ScriptError as error:
        raise CompileError(script.place(error.index), error.message, error.help_text) from error
    every = [part for statement in statements for part in parts(statement)]
    _check(script, every)
    names = [part.name for part in every if isinstance(part, Name) and "." in part.name]
    messages = {name.partition(".")[0] for name in names}
    # A script that asks Message.fresh decides for that message; else it is not run while a message is stale.
    needed = sorted(messages - {name.removesuffix(".fresh") for name in names if name.endswith(".fresh")})

    def run(world: AskingWorld) -> Fraction:
        if not all(world.fresh(message) for message in needed):
            return Fraction(0)
        evaluator = _Evaluator(world, entries)
        return [evaluator.value(statement) for statement in statements][-1]

    return run


def entry_names(scripts: list[Script]) -> tuple[str, ...]:
    """The entries that scripts name, in the order of their first use."""
    found: dict[str, None] = {}
    for script in scripts:
        try:
            every = [part for statement in parse(script.text) for part in parts(statement)]
        except ScriptError:
            continue  # program() says why
        for part in every:
            name = part.target.name if isinstance(part, Assignment) else part.name if isinstance(part, Name) else ""
            if name and "." not in name:
                found[name] = None
    return tuple(found)
