# SPDX-License-Identifier: MIT
"""JSON that somebody else has written, within bounds; numbers stay as they are written."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.numbers import exact
from canopy.files import FileError, read_text

MAX_BYTES = 16 * 1024 * 1024


class Written(str):
    """A number as it stands in the file."""


def _refuse_constant(text: str) -> None:
    raise ValueError(f"{text} is not a number")


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key '{key}' is there twice")
        found[key] = value
    return found


def read_json(path: Path) -> Any:
    """The content of a JSON file; numbers are `Written`.

    Raises:
        CompileError: it cannot be read, is too large or nested too deep, or is not valid JSON.
    """
    place = Place(str(path))
    try:
        return json.loads(
            read_text(path, MAX_BYTES),
            parse_float=Written,
            parse_int=Written,
            parse_constant=_refuse_constant,
            object_pairs_hook=_no_duplicates,
        )
    except FileError as error:
        raise CompileError(place, error.problem) from error
    except json.JSONDecodeError as error:
        raise CompileError(Place(str(path), error.lineno, error.colno), f"not valid JSON: {error.msg}") from error
    except (ValueError, RecursionError) as error:
        reason = "nested too deep" if isinstance(error, RecursionError) else str(error)
        raise CompileError(place, f"not valid JSON: {reason}") from error


def fields(value: Any, place: Place, where: str, needed: tuple[str, ...], optional: tuple[str, ...] = ()) -> Any:
    """`value`, which must be an object with these keys and no others."""
    if not isinstance(value, dict):
        raise CompileError(place, f"{where} must be an object", f"with {', '.join(needed)}")
    for key in value:
        if key not in (*needed, *optional):
            raise CompileError(place, f"{where} has an unknown key '{key}'", nearest(key, (*needed, *optional)))
    for key in needed:
        if key not in value:
            raise CompileError(place, f"{where} lacks '{key}'")
    return value


def text(value: Any, place: Place, where: str) -> str:
    """`value`, which must be a text."""
    if not isinstance(value, str) or isinstance(value, Written):
        raise CompileError(place, f"{where} must be a text")
    return value


def number(value: Any, place: Place, where: str) -> Fraction:
    """`value`, which must be a number, exactly as it is written."""
    if not isinstance(value, Written):
        raise CompileError(place, f"{where} must be a number")
    try:
        return exact(value)
    except ValueError as error:
        raise CompileError(place, f"{where}: {error}") from error


def integer(value: Any, place: Place, where: str) -> int:
    """`value`, which must be a whole number."""
    found = number(value, place, where)
    if found.denominator != 1:
        raise CompileError(place, f"{where} must be a whole number, not {value}", "choose a smaller unit")
    return int(found)
