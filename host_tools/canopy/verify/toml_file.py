# SPDX-License-Identifier: MIT
"""A TOML file with exact numbers, and the line of each of its keys: the parser itself tells no lines."""

from __future__ import annotations

import re
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, Place
from canopy.files import FileError, read_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MAX_BYTES = 1024 * 1024
_HEADER = re.compile(r"\s*(\[\[?)([^\[\]]+)\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")
_PART = re.compile(r"""[\w-]+|"([^"]*)"|'([^']*)'""")

Path_ = tuple[str, ...]
"""Keys from the top; the place in an array of tables is a number as text."""


def _number(text: str) -> Fraction:
    if len(text) > 60 or "n" in text.lower():  # nan, inf
        raise ValueError(f"'{text[:60]}' is not a number that can be used")
    exponent = re.search(r"[eE]([-+]?\d+)", text)
    if exponent is not None and abs(int(exponent[1])) > 30:
        raise ValueError(f"'{text}' is too large or too small")
    return Fraction(text.replace("_", ""))


class TomlFile:
    """Content and lines of a file."""

    def __init__(self, path: Path) -> None:
        """Reads `path`.

        Raises:
            CompileError: It cannot be read, or is not TOML.
        """
        self.path = path
        place = Place(str(path))
        try:
            text = read_text(path, MAX_BYTES)
            self.content: dict[str, Any] = tomllib.loads(text, parse_float=_number)
        except FileError as error:
            raise CompileError(place, error.problem) from error
        except (
            ValueError,
            RecursionError,
            OverflowError,
        ) as error:  # TOMLDecodeError is a ValueError
            line = re.search(r"at line (\d+), column (\d+)", str(error))
            if line is not None:
                place = Place(str(path), int(line[1]), int(line[2]))
            raise CompileError(place, f"not valid TOML: {error}") from error
        self._lines = _lines(text)

    def place(self, *path: str) -> Place:
        """The line of a key, of the first one below it, or of the nearest table around it that has one."""
        below = [line for key, line in self._lines.items() if path and key[: len(path)] == path]
        if below:
            return Place(str(self.path), min(below))
        while path and path not in self._lines:
            path = path[:-1]
        return Place(str(self.path), self._lines.get(path, 0))


def _parts(text: str) -> Path_:
    return tuple(found[1] or found[2] or found[0] for found in _PART.finditer(text))


def _lines(text: str) -> dict[Path_, int]:
    """The line of each key and table that stands on a line of its own."""
    result: dict[Path_, int] = {}
    counts: dict[Path_, int] = {}
    table: Path_ = ()

    def resolved(path: Path_) -> Path_:
        """With the number of the last element of each array of tables on the way."""
        done: Path_ = ()
        for part in path:
            done = (*done, part)
            if done in counts:
                done = (*done, str(counts[done]))
        return done

    for number, line in enumerate(text.splitlines(), 1):
        header = _HEADER.match(line)
        if header is not None:
            *parents, last = _parts(header[2])
            path = (*resolved(tuple(parents)), last)
            if header[1] == "[[":
                counts[path] = counts.get(path, -1) + 1
                path = (*path, str(counts[path]))
            table = path
            result.setdefault(table, number)
            continue
        key = _KEY.match(line)
        if key is not None:
            path = table
            for part in _parts(key[1]):
                path = (*path, part)
                result.setdefault(path, number)
    return result
