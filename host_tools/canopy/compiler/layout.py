# SPDX-License-Identifier: MIT
"""Generated C as a reviewer expects it: no line over 120 columns, comments behind code in one column.

The templates write each statement on one line and leave its breaks to this. The rules are those of the repository's
.clang-format, as far as generated code needs them; tests/integration/test_golden.py holds the one against the other.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import accumulate

COLUMNS = 120
TOO_LONG = 5_000  # a statement that no reader would read on several lines, either

_CONTINUED = 4
# What a line may end with (the two of ?: begin the next one instead), the loosest first.
_LOOSEST_FIRST = (", ", " ? ", " : ", " || ", " && ", " | ", " + ", " - ", " * ")
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[(\[{]|[)\]}]| = |' + "|".join(map(re.escape, _LOOSEST_FIRST)))


@dataclass(frozen=True)
class _Break:
    """A place where a line may end. The next one begins with the text at `place`, in the last one of `columns`.

    `columns` has an entry for the statement and one for each bracket that is open there; `rank` tells how tightly the
    place is bound, `is_member` that it stands between the members of a {.x = …, .y = …}.
    """

    place: int
    columns: tuple[int, ...]
    rank: tuple[int, int]
    is_assignment: bool = False
    is_member: bool = False


def _breaks(line: str, columns: tuple[int, ...]) -> Iterator[_Break]:
    indent = len(line) - len(line.lstrip())
    stack = list(columns or [indent + (len("return ") if line.startswith("return ", indent) else _CONTINUED)])
    continued = (indent + _CONTINUED,)
    members: list[int] = []
    for token in _TOKEN.finditer(line, indent):
        text = token[0]
        if text[0] in "([{":
            stack.append(token.end())
            if line.startswith("{.", token.start()):
                members.append(len(stack))
        elif text[0] in ")]}":
            if members and members[-1] == len(stack):
                members.pop()
            stack.pop()
        elif text == " = ":
            if len(stack) == 1:
                yield _Break(token.end(), continued, (0, 0), is_assignment=True)
                stack[0] = token.end()
        elif text[0] != '"':
            place = token.start() + 1 if text in (" ? ", " : ") else token.end()
            is_member = text == ", " and bool(members) and members[-1] == len(stack)
            yield _Break(place, tuple(stack), (len(stack), _LOOSEST_FIRST.index(text)), is_member=is_member)


def _split(line: str, at: _Break) -> list[str]:
    rest = " " * at.columns[-1] + line[at.place :]
    return [line[: at.place].rstrip(), *_wrap(rest, at.columns)]


def _wrap(line: str, columns: tuple[int, ...] = ()) -> list[str]:
    """The statement on as many lines as it needs, broken at the loosest places that will do.

    Args:
        line: The statement, or the rest of one.
        columns: For the rest of a statement: where the lines of each bracket that is still open begin.
    """
    if len(line) <= COLUMNS:
        return [line]
    places = list(_breaks(line, columns))
    members = [place for place in places if place.is_member]
    if members:  # one a line
        ends = [place.place for place in members if place.columns == members[0].columns]
        parts = [line[begin:end].rstrip() for begin, end in zip([0, *ends], [*ends, None], strict=True)]
        return [parts[0], *(" " * members[0].columns[-1] + part for part in parts[1:])]
    fitting = [p for p in places if len(line[: p.place].rstrip()) <= COLUMNS and p.place > p.columns[-1]]
    inside = [place for place in fitting if not place.is_assignment]
    assigned = [_split(line, place) for place in fitting if place.is_assignment]
    if not inside:
        return assigned[0] if assigned else [line]
    loosest = min(place.rank for place in inside)
    best = [place for place in inside if place.rank == loosest][-1]
    broken = _split(line, best)
    # With as many lines either way, a bracket is kept whole rather than the assignment.
    slack = 0 if len(broken) == 2 or len(best.columns) > 1 else 1
    return assigned[0] if assigned and len(assigned[0]) + slack <= len(broken) else broken


def _comment(line: str) -> list[str]:
    """A line that is one comment, on as many lines as it needs."""
    indent = line[: len(line) - len(line.lstrip())]
    mark, _, text = line.strip().removesuffix(" */").partition(" ")
    inner = f"{indent} * "
    words = textwrap.TextWrapper(
        COLUMNS, initial_indent=inner, subsequent_indent=inner, break_long_words=False, break_on_hyphens=False
    )
    return [indent + mark, *words.wrap(text), f"{indent} */"]


def _whole(line: str) -> list[str]:
    """A line that no comment is behind."""
    if len(line) <= COLUMNS:
        return [line]
    text = line.lstrip()
    if text.startswith(("/* ", "/** ")) and text.endswith(" */"):
        return _comment(line)
    return [line] if text.startswith(("/*", "*", "#")) or len(line) > TOO_LONG else _wrap(line)


def _above(code: str, comment: str) -> str:
    """The comment as a line above its code."""
    return code[: len(code) - len(code.lstrip())] + comment.replace("/**<", "/**", 1)


def _with_comments(run: list[tuple[str, str]]) -> Iterator[str]:
    """Lines of code that have comments behind them, one after another: the comments in one column.

    A comment that finds no room there goes above its line.
    """
    widest = list(accumulate((len(code) for code, _ in reversed(run)), max))  # of the last 1, 2, … lines
    start = 0
    while start < len(run):
        column = widest[len(run) - start - 1] + 1
        end = start
        while end < len(run) and column + len(run[end][1]) <= COLUMNS:
            end += 1
        beside = run[start:end]
        column = max((len(code) + 1 for code, _ in beside), default=0)
        for code, comment in beside:
            yield f"{code.ljust(column)}{comment}"
        start = end
        if start < len(run):
            code, comment = run[start]
            yield from _whole(_above(code, comment))
            yield from _whole(code)
        start += 1


def _trailing(line: str) -> tuple[str, str] | None:
    """Code and the comment behind it; None when the line is not both."""
    if not line.endswith("*/"):
        return None
    place = line.rfind("/*")  # in a comment there is none
    code = line[:place].rstrip(" ")
    alone = not code or code.lstrip().startswith(("/*", "*"))
    return None if alone or line[place - 1] != " " else (code, line[place:])


def _lines(lines: Iterable[str]) -> Iterator[str]:
    run: list[tuple[str, str]] = []
    for line in lines:
        trailing = _trailing(line)
        if trailing is not None:
            run.append(trailing)
            continue
        yield from _with_comments(run)
        run = []
        yield from _whole(line)
    yield from _with_comments(run)


def layout(text: str) -> str:
    """The text of a C file, laid out."""
    text = re.sub(r"\n\n+( *\})", r"\n\1", text).rstrip()
    return "\n".join(_lines(text.split("\n"))) + "\n"
