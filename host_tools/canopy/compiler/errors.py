# SPDX-License-Identifier: MIT
"""What is wrong with an input: the place, what was expected, and a way out."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

from canopy.escape.visible import brief


@dataclass(frozen=True)
class Place:
    """A place in an input file. `line` and `column` count from 1; 0 means the file as a whole."""

    file: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        if self.line == 0:
            return self.file
        return f"{self.file}:{self.line}:{self.column}" if self.column else f"{self.file}:{self.line}"


class CompileError(Exception):
    """An input that cannot be compiled. Printed as `FILE:LINE:COLUMN: error: MESSAGE`, then `help: HELP`."""

    def __init__(self, place: Place, message: str, help_text: str = "") -> None:
        super().__init__(message)
        self.place = place
        self.message = message
        self.help_text = help_text

    def __str__(self) -> str:
        text = f"{brief(str(self.place))}: error: {brief(self.message)}"
        return f"{text}\n  help: {brief(self.help_text)}" if self.help_text else text


class UnsupportedTypeError(CompileError):
    """A port has a type for which there is nothing in C. It matters only where a tree uses the port's node."""


def nearest(word: str, known: Iterable[str]) -> str:
    """A help text that names what `word` may have been meant to be: the nearest known name, else all of them."""
    names = sorted(set(known))
    close = difflib.get_close_matches(word, names, n=1)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"known here: {', '.join(names)}" if names else "none is known here"
