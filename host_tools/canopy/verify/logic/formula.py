# SPDX-License-Identifier: MIT
"""Formulas over what nodes do, with past operators, as text: `responds(SUCCESS(Overheated), RUNNING(Fan), 3)`.

formula  a implies b, a or b, a and b, not a, (a), true, false, atoms, operators; `implies` binds least and to the right
atom     WHAT(NODE): NODE is a name or a path; in "quotes" unless it is letters, digits, _ and /
         FRESH(MESSAGE)
         {condition}: in the language of scripts, of the main tree's entries and of signals, after the tick
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from canopy.compiler.errors import nearest
from canopy.verify.expression import ExpressionError

MAX_LENGTH = 4_000
MAX_DEPTH = 60
MAX_TICKS = 1_000

ATOMS = {
    "RUNNING": "is RUNNING after the tick",
    "IDLE": "is IDLE after the tick: not ticked yet, or reset",
    "SUCCESS": "returned SUCCESS in this tick",
    "FAILURE": "returned FAILURE in this tick",
    "SKIPPED": "returned SKIPPED in this tick",
    "TICKED": "was ticked in this tick",
    "HALTED": "was RUNNING and was halted in this tick",
}
FRESH = "FRESH"
# Formulas that each takes, and whether a number of ticks follows: no, may, must.
OPERATORS = {
    "previous": (1, "no"),
    "once": (1, "may"),
    "historically": (1, "may"),
    "since": (2, "no"),
    "responds": (2, "must"),
}
CONNECTIVES = ("implies", "or", "and", "not")
KNOWN = (*ATOMS, FRESH, *OPERATORS, *CONNECTIVES, "true", "false")

_TOKEN = re.compile(r'\s*(?:(?P<word>[\w/]+)|"(?P<quoted>[^"]*)"|\{(?P<script>[^{}]*)\}|(?P<sign>[(),]))')
_OPENING = {"quoted": '"', "script": "{"}


class Names(Protocol):
    """What the names in a formula stand for. Each raises ExpressionError, `at` the place of a name in the text."""

    def number(self, what: str, name: str, at: int) -> int:
        """The number of a node, for an atom."""

    def fresh(self, message: str, at: int) -> int:
        """The number of the fact that a message is fresh."""

    def condition(self, text: str, at: int) -> int:
        """The number of the fact that a condition in the language of scripts holds."""


@dataclass(frozen=True)
class Formula:
    """`what`: an atom, `fact`, an operator or a connective. `node`: an atom's, or a fact's. `ticks`: an operator's."""

    what: str
    parts: tuple[Formula, ...] = ()
    node: int = 0
    ticks: int | None = None


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    at: int


def _split(text: str) -> list[_Token]:
    tokens = []
    at = 0
    while text[at:].strip():
        found = _TOKEN.match(text, at)
        if found is None or found.lastgroup is None:
            at += len(text[at:]) - len(text[at:].lstrip())
            closed = {'"': "a quote is not closed", "{": "a brace is not closed, or another one is in it"}
            message = closed.get(text[at], f"unexpected '{text[at]}'")
            raise ExpressionError(at, message, 'write for example: RUNNING(A) and not once(SUCCESS("Go home"), 3)')
        start = found.start(found.lastgroup) - (found.lastgroup in _OPENING)
        tokens.append(_Token(found.lastgroup, found[found.lastgroup], start))
        at = found.end()
    return tokens


class _Parser:
    def __init__(self, text: str, names: Names) -> None:
        if len(text) > MAX_LENGTH:
            raise ExpressionError(0, f"the formula is longer than {MAX_LENGTH} characters")
        self._tokens = [*_split(text), _Token("end", "", len(text))]
        self._names = names
        self._depth = 0

    def _take(self) -> _Token:
        return self._tokens.pop(0) if len(self._tokens) > 1 else self._tokens[0]

    def _is(self, text: str) -> bool:
        token = self._tokens[0]
        if token.kind in _OPENING or token.text != text:
            return False
        self._take()
        return True

    def _need(self, sign: str) -> None:
        token = self._tokens[0]
        if not self._is(sign):
            raise ExpressionError(token.at, f"expected '{sign}', not {_shown(token)}")

    def whole(self) -> Formula:
        result = self._implies()
        token = self._tokens[0]
        if token.kind != "end":
            raise ExpressionError(token.at, f"unexpected {_shown(token)}", "join formulas with: and, or, implies")
        return result

    def _implies(self) -> Formula:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ExpressionError(self._tokens[0].at, f"the formula is nested more than {MAX_DEPTH} deep")
        left = self._joined("or", lambda: self._joined("and", self._not))
        if self._is("implies"):
            left = Formula("or", (Formula("not", (left,)), self._implies()))
        self._depth -= 1
        return left

    def _joined(self, word: str, part: Callable[[], Formula]) -> Formula:
        parts = [part()]
        while self._is(word):
            parts.append(part())
        return parts[0] if len(parts) == 1 else Formula(word, tuple(parts))

    def _not(self) -> Formula:
        inverted = False
        while self._is("not"):
            inverted = not inverted
        result = self._single()
        return Formula("not", (result,)) if inverted else result

    def _single(self) -> Formula:
        token = self._take()
        if token == _Token("sign", "(", token.at):
            result = self._implies()
            self._need(")")
            return result
        if token.kind == "script":
            return Formula("fact", (), self._names.condition(token.text, token.at + 1))
        if token.kind != "word":
            raise ExpressionError(token.at, f"expected a formula, not {_shown(token)}", "write for example: RUNNING(A)")
        if token.text in ("true", "false"):
            return Formula(token.text)
        if token.text in (*ATOMS, FRESH):
            return self._atom(token)
        if token.text in OPERATORS:
            return self._operator(token)
        raise ExpressionError(token.at, f"unknown '{token.text}'", nearest(token.text, KNOWN))

    def _atom(self, token: _Token) -> Formula:
        self._need("(")
        name = self._take()
        if name.kind not in ("word", "quoted"):
            raise ExpressionError(name.at, f"expected a name, not {_shown(name)}")
        if token.text == FRESH:
            what, number = "fact", self._names.fresh(name.text, name.at)
        else:
            what, number = token.text, self._names.number(token.text, name.text, name.at)
        if self._tokens[0].kind == "word":
            raise ExpressionError(
                self._tokens[0].at, f"expected ')', not {_shown(self._tokens[0])}", 'quote names with blanks: "Go home"'
            )
        self._need(")")
        return Formula(what, (), number)

    def _operator(self, token: _Token) -> Formula:
        count, number = OPERATORS[token.text]
        self._need("(")
        parts = [self._implies()]
        while len(parts) < count:
            self._need(",")
            parts.append(self._implies())
        ticks = None
        if number == "must" or (number == "may" and self._tokens[0].text == ","):
            self._need(",")
            given = self._take()
            if not re.fullmatch("[0-9]{1,9}", given.text) or int(given.text) > MAX_TICKS:
                raise ExpressionError(given.at, f"expected a number of ticks, 0 to {MAX_TICKS}, not {_shown(given)}")
            ticks = int(given.text)
        self._need(")")
        return Formula(token.text, tuple(parts), 0, ticks)


def _shown(token: _Token) -> str:
    return "the end" if token.kind == "end" else f"'{token.text}'"


def parse(text: str, names: Names) -> Formula:
    """Reads a formula.

    Raises:
        ExpressionError: It is not one; says at which character.
    """
    return _Parser(text, names).whole()
