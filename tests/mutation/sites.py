# SPDX-License-Identifier: MIT
"""Where C code can be changed a little, and how."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_COMMENT_OR_TEXT = re.compile(
    r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|^[ \t]*#(?:\\\n|[^\n])*', re.S | re.M
)

_OPERATORS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (r"(?<![<\-])<(?![<=])", ("<=", ">=")),
    (r"(?<![<])<=", ("<", ">")),
    (r"(?<![>\-])>(?![>=])", (">=", "<=")),
    (r"(?<![>])>=", (">", "<")),
    (r"==", ("!=",)),
    (r"!=", ("==",)),
    (r"&&", ("||",)),
    (r"\|\|", ("&&",)),
    (r"(?<= )\+(?= )", ("-",)),
    (r"(?<= )-(?= )", ("+",)),
    (r"(?<= )\*(?= )", ("+",)),
    (r"(?<= )/(?= )", ("*",)),
    (r"(?<= )%(?= )", ("/",)),
    (r"\+\+", ("--",)),
    (r"--", ("++",)),
    (r"\+=", ("-=", "=")),
    (r"-=", ("+=", "=")),
    (r"<<(?!=)", (">>",)),
    (r">>(?!=)", ("<<",)),
    (r"(?<= )&(?= )", ("|",)),
    (r"(?<= )\|(?= )", ("&",)),
    (r"\|=", ("=",)),
    (r"&=", ("=",)),
    (r"\^=", ("|=",)),
    (r"\btrue\b", ("false",)),
    (r"\bfalse\b", ("true",)),
    (r"!(?=[\w(])", ("",)),
    (r"~(?=[\w(])", ("",)),
    (r"\bbreak;", (";",)),
    (r"\bcontinue;", (";",)),
    (r"\bmemory_order_(?:acquire|release)\b", ("memory_order_relaxed",)),
    (r"\bCANOPY_SUCCESS\b", ("CANOPY_FAILURE",)),
    (r"\bCANOPY_FAILURE\b", ("CANOPY_SUCCESS",)),
    (r"\bCANOPY_RUNNING\b", ("CANOPY_IDLE",)),
    (r"\bCANOPY_IDLE\b", ("CANOPY_RUNNING",)),
    (r"\bCANOPY_SKIPPED\b", ("CANOPY_FAILURE",)),
)
_NUMBER = re.compile(r"(?<![\w.])(0x[0-9A-Fa-f]+|[0-9]+)([uUlL]*)(?![\w.])")
_CONDITION = re.compile(r"\b(?:if|while) \(")
_STATEMENT = re.compile(
    r"(?<=[;{}\n])([ \t]+)"
    r"(?!return|const|static|case|else|if|for|while|switch|do|goto|break|continue|typedef|struct|enum|union)"
    r"(?!uint|int|bool|size_t|unsigned|canopy_\w+_t\b)"
    r"((?:\(void\))?[*\w][^;{}=]*(?:(?:[-+|&^*/%]|<<|>>)?=[^;{}]+|\([^;{}]*\)|\+\+|--));"
)
_FUNCTION = re.compile(r"^[a-z][^;=\n]*?(\w+)\(", re.M)


@dataclass(frozen=True)
class Mutant:
    """One change of one file."""

    file: str
    """Below the folder of the sources."""
    start: int
    end: int
    new: str
    line: int
    function: str
    """The one it is in, or the last one before it."""
    before: str
    """The line as it is, without its blanks at both ends."""
    after: str

    @property
    def name(self) -> tuple[str, str, str]:
        """The same while the line is the same, wherever it moves."""
        return f"{self.file}:{self.function}", self.before, self.after


def _masked(text: str) -> str:
    """The text with blanks where its comments, texts and directives are; everything else stays in its place."""
    return _COMMENT_OR_TEXT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def _closing(code: str, opening: int) -> int:
    depth = 0
    for place in range(opening, len(code)):
        depth += (code[place] == "(") - (code[place] == ")")
        if depth == 0:
            return place
    return -1


def _changes(code: str) -> list[tuple[int, int, str]]:
    found = []
    for pattern, replacements in _OPERATORS:
        for match in re.finditer(pattern, code):
            found += [(match.start(), match.end(), new) for new in replacements]
    for match in _NUMBER.finditer(code):
        value, suffix = int(match[1], 0), match[2]
        found.append((match.start(), match.end(), f"{value + 1}{suffix}"))
        if value > 0:
            found.append((match.start(), match.end(), f"{value - 1}{suffix}"))
    for match in _CONDITION.finditer(code):
        last = _closing(code, match.end() - 1)
        if last > 0:
            found.append((match.end(), last, f"!({code[match.end() : last]})"))
    found += [(match.start(2), match.end(2), "") for match in _STATEMENT.finditer(code)]
    return found


def find_mutants(folder: Path) -> list[Mutant]:
    """All changes of the sources in a folder, in the order of the files and of the places in them."""
    mutants = []
    for path in sorted(folder.rglob("*.[ch]")):
        text = path.read_text(encoding="utf-8")
        for start, end, new in sorted(set(_changes(_masked(text)))):
            first = text.rfind("\n", 0, start) + 1
            last = text.find("\n", end)
            last = len(text) if last < 0 else last
            before = " ".join(text[first:last].split())
            after = " ".join((text[first:start] + new + text[end:last]).split())
            line = text.count("\n", 0, start) + 1
            heads = [match[1] for match in _FUNCTION.finditer(text, 0, start)]
            function = heads[-1] if heads else ""
            mutants.append(Mutant(str(path.relative_to(folder)), start, end, new, line, function, before, after))
    return mutants
