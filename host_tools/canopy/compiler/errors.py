# SPDX-License-Identifier: MIT
"""What is wrong with an input: the place, what was expected, and a way out."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
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


MOST_ERRORS = 20


class CombinedError(CompileError):
    """Several errors of one input; the first one's place and message are its own."""

    def __init__(self, errors: Sequence[CompileError]) -> None:
        super().__init__(errors[0].place, errors[0].message, errors[0].help_text)
        self.errors = tuple(errors)

    def __str__(self) -> str:
        shown = [str(error) for error in self.errors[:MOST_ERRORS]]
        more = len(self.errors) - MOST_ERRORS
        return "\n".join([*shown, f"and {more} more errors"] if more > 0 else shown)


class Errors:
    """Collects what is wrong, so that one run names it all: each error once, in the order in which they were met."""

    def __init__(self) -> None:
        self._found: dict[tuple[Place, str], CompileError] = {}

    def add(self, error: CompileError) -> None:
        """One more; its own ones, if it is several."""
        for one in error.errors if isinstance(error, CombinedError) else (error,):
            self._found.setdefault((one.place, one.message), one)

    def __len__(self) -> int:
        return len(self._found)

    def raise_any(self) -> None:
        """Ends the step.

        Raises:
            CompileError: all that was collected.
        """
        found = list(self._found.values())
        if found:
            raise found[0] if len(found) == 1 else CombinedError(found)


class UnsupportedTypeError(CompileError):
    """A port has a type for which there is nothing in C. It matters only where a tree uses the port's node."""


MOST_NAMES = 40
LONGEST_NAME = 200  # looking for the nearest of two longer ones takes long


def nearest(word: str, known: Iterable[str]) -> str:
    """A help text that names what `word` may have been meant to be: the nearest known name, else the first of them."""
    names = sorted(set(known))
    close = None
    if len(word) <= LONGEST_NAME:
        close = difflib.get_close_matches(word, [name for name in names if len(name) <= LONGEST_NAME], n=1)
    if close:
        return f"did you mean '{close[0]}'?"
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"known here: {', '.join(names[:MOST_NAMES])}{more}" if names else "none is known here"
