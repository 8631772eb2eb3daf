# SPDX-License-Identifier: MIT
"""The grammar of scripts, and its parser: that of BehaviorTree.CPP 4.10.

script     = [expression {";" expression}] [";"]
expression = name (":=" | "=" | "+=" | "-=" | "*=" | "/=") expression
           | binary ["?" expression ":" conditional]
binary     = prefix {operator prefix}, where operators bind in this order, the loosest first, each from left to right:
             "||"    "&&"    "==" "!=" "<" "<=" ">" ">=", which chain    "|" "^"    "&"    "+" "-" ".."    "*" "/"
prefix     = {"-" | "!" | "~"} atom
atom       = number | 'text' | true | false | name | "(" expression ")"
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from canopy.compiler.numbers import exact

MAX_NESTING = 100
MAX_CHARACTERS = 10_000  # of a script
MAX_WORDS = 200  # of a statement: names, numbers, operators

ASSIGNMENTS = (":=", "=", "+=", "-=", "*=", "/=")
COMPARISONS = ("==", "!=", "<=", ">=", "<", ">")
BITS = ("&", "|", "^")
# How tightly an operator binds; what binds tighter is computed first.
COMPARING = 5
POWERS = {
    "||": 3,
    "&&": 4,
    **dict.fromkeys(COMPARISONS, COMPARING),
    **dict.fromkeys(("|", "^"), 6),
    "&": 7,
    **dict.fromkeys(("+", "-", ".."), 8),
    **dict.fromkeys(("*", "/"), 9),
}

_TOKEN = re.compile(
    r"""\s*(?:
      (?P<number>0[xX][0-9A-Fa-f]+|\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)
    | (?P<text>'[^']*')
    | (?P<name>@?[^\W\d]\w*(?:\.[^\W\d]\w*)*)
    | (?P<operator>:=|==|!=|<=|>=|\+=|-=|\*=|/=|&&|\|\||\.\.|[-+*/&|^~!<>?:;()=])
    )""",
    re.VERBOSE,
)
_END = re.compile(r"\s*\Z")


class ScriptError(Exception):
    """What is wrong in a script, at a character of its text."""

    def __init__(self, index: int, message: str, help_text: str = "") -> None:
        super().__init__(message)
        self.index = index
        self.message = message
        self.help_text = help_text


@dataclass(frozen=True)
class Expression:
    """A part of a script; `index` is its character in the text."""

    index: int


@dataclass(frozen=True)
class Number(Expression):
    """A number, exactly as written. `is_bool`: it was written true or false."""

    value: Fraction
    is_bool: bool = False


@dataclass(frozen=True)
class Text(Expression):
    """'…'."""

    text: str


@dataclass(frozen=True)
class Name(Expression):
    """An entry or a signal."""

    name: str


@dataclass(frozen=True)
class Unary(Expression):
    """-x, !x, ~x."""

    operator: str
    operand: Expression


@dataclass(frozen=True)
class Binary(Expression):
    """Arithmetic, bits, && and ||."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Comparison(Expression):
    """A chain: `a < b <= c` is `a < b && b <= c`."""

    operands: tuple[Expression, ...]
    operators: tuple[str, ...]


@dataclass(frozen=True)
class Conditional(Expression):
    """condition ? yes : no."""

    condition: Expression
    yes: Expression
    no: Expression


@dataclass(frozen=True)
class Assignment(Expression):
    """What writes; its value is what is then stored."""

    operator: str
    target: Name
    value: Expression


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    index: int


def _tokens(text: str) -> list[_Token]:
    tokens = []
    position = words = 0
    if len(text) > MAX_CHARACTERS:
        raise ScriptError(
            MAX_CHARACTERS, f"a script of more than {MAX_CHARACTERS} characters", "make several nodes of it"
        )
    while not _END.match(text, position):
        match = _TOKEN.match(text, position)
        if match is None:
            index = position + len(text[position:]) - len(text[position:].lstrip())
            if text[index] == "'":
                raise ScriptError(index, "a text without its closing '")
            raise ScriptError(index, f"'{text[index]}' has no meaning in a script")
        kind = match.lastgroup or ""
        word = match[kind]
        index = match.start(kind)
        if kind == "number" and re.match(r"\w", text[match.end() : match.end() + 1]):
            raise ScriptError(index, f"'{word}{text[match.end()]}…' is neither a number nor a name")
        words = 0 if word == ";" else words + 1
        if words > MAX_WORDS:
            raise ScriptError(index, f"a statement of more than {MAX_WORDS} words", "make several statements of it")
        tokens.append(_Token(kind, word, index))
        position = match.end()
    tokens.append(_Token("end", "", len(text)))
    return tokens


class _Parser:
    def __init__(self, text: str) -> None:
        self._tokens = _tokens(text)
        self._next = 0
        self._nesting = 0

    def _peek(self) -> _Token:
        return self._tokens[self._next]

    def _is(self, *operators: str) -> bool:
        token = self._peek()
        return token.kind == "operator" and token.text in operators

    def _take(self) -> _Token:
        token = self._peek()
        self._next += 1
        return token

    def _expect(self, operator: str, what: str) -> None:
        if not self._is(operator):
            raise ScriptError(self._peek().index, f"'{operator}' is missing {what}")
        self._take()

    def script(self) -> tuple[Expression, ...]:
        statements = []
        while self._peek().kind != "end":
            if self._is(";"):
                self._take()
                continue
            statements.append(self._expression())
            if self._peek().kind != "end" and not self._is(";"):
                token = self._peek()
                raise ScriptError(
                    token.index, f"'{token.text}' does not belong here", "statements are separated by ';'"
                )
        if not statements:
            raise ScriptError(0, "the script is empty")
        return tuple(statements)

    def _expression(self) -> Expression:
        """With assignments, which take all that follows."""
        self._nesting += 1
        if self._nesting > MAX_NESTING:
            raise ScriptError(self._peek().index, f"nested more than {MAX_NESTING} deep")
        first = self._peek()
        value = self._conditional()
        if self._is(*ASSIGNMENTS):
            operator = self._take()
            if not isinstance(value, Name):
                message = f"the left side of '{operator.text}' must be a name"
                raise ScriptError(first.index, message, "to compare, write ==")
            value = Assignment(first.index, operator.text, value, self._expression())
        self._nesting -= 1
        return value

    def _conditional(self) -> Expression:
        condition = self._binary(0)
        if not self._is("?"):
            return condition
        self._nesting += 1
        if self._nesting > MAX_NESTING:
            raise ScriptError(self._peek().index, f"nested more than {MAX_NESTING} deep")
        index = self._take().index
        yes = self._expression()
        self._expect(":", "after '?'")
        no = self._conditional()
        self._nesting -= 1
        return Conditional(index, condition, yes, no)

    def _power(self) -> int:
        token = self._peek()
        return POWERS.get(token.text, 0) if token.kind == "operator" else 0

    def _binary(self, least: int) -> Expression:
        """Operators that bind tighter than `least`."""
        left = self._prefix()
        while self._power() > least:
            if self._power() == COMPARING:
                left = self._chain(left)
                continue
            token = self._take()
            left = Binary(token.index, token.text, left, self._binary(POWERS[token.text]))
        return left

    def _chain(self, first: Expression) -> Expression:
        operands = [first]
        operators = []
        while self._is(*COMPARISONS):
            operators.append(self._take().text)
            operands.append(self._binary(COMPARING))
        return Comparison(first.index, tuple(operands), tuple(operators))

    def _prefix(self) -> Expression:
        operators = []
        while self._is("-", "!", "~"):
            operators.append(self._take())
            if len(operators) > MAX_NESTING:
                raise ScriptError(operators[-1].index, f"nested more than {MAX_NESTING} deep")
        value = self._atom()
        for token in reversed(operators):
            value = Unary(token.index, token.text, value)
        return value

    def _atom(self) -> Expression:
        token = self._take()
        if token.kind == "number":
            try:
                return Number(token.index, exact(token.text))
            except ValueError:
                raise ScriptError(token.index, "a number that is too long") from None
        if token.kind == "text":
            return Text(token.index, token.text[1:-1])
        if token.kind == "name":
            if token.text in ("true", "false"):
                return Number(token.index, Fraction(token.text == "true"), is_bool=True)
            return Name(token.index, token.text)
        if token.text == "(":
            inner = self._expression()
            self._expect(")", f"for the '(' at character {token.index + 1}")
            return inner
        what = f"'{token.text}'" if token.text else "the end of the script"
        raise ScriptError(token.index, f"a value is expected here, not {what}")


@lru_cache(maxsize=100_000)  # conditions of a tree are often the same
def parse(text: str) -> tuple[Expression, ...]:
    """The statements of a script, at least one.

    Raises:
        ScriptError: it is not in the grammar.
    """
    return _Parser(text).script()


def parts(expression: Expression) -> list[Expression]:
    """The expression and all its parts."""
    found: list[Expression] = []
    waiting = [expression]
    while waiting:
        part = waiting.pop()
        found.append(part)
        if isinstance(part, Unary):
            waiting.append(part.operand)
        elif isinstance(part, Binary):
            waiting += [part.left, part.right]
        elif isinstance(part, Comparison):
            waiting += part.operands
        elif isinstance(part, Conditional):
            waiting += [part.condition, part.yes, part.no]
        elif isinstance(part, Assignment):
            waiting += [part.target, part.value]
    return found
