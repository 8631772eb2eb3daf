# SPDX-License-Identifier: MIT
"""A DBC file as cantools reads it, within limits; its attributes, and the ids that it writes."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import cantools
import cantools.database.can
from cantools.database.errors import Error as DatabaseError

from canopy.compiler.bounds import Limits, whole
from canopy.compiler.dbc_text import DbcText
from canopy.compiler.errors import CompileError, Place, nearest

MAX_BYTES = 16 * 1024 * 1024


@dataclass(frozen=True)
class Dbc:
    """A DBC as cantools reads it, and its text, which knows the lines."""

    database: Any
    text: DbcText


def load_dbc(path: Path) -> Dbc:
    """A DBC file, in cantools' strict mode.

    Raises:
        CompileError: it cannot be read, is too large, or has two messages of one name or id.
    """
    place = Place(str(path))
    try:
        if path.stat().st_size > MAX_BYTES:
            raise CompileError(place, f"the file has {path.stat().st_size} bytes; at most {MAX_BYTES} are read")
        text = DbcText(str(path), path.read_text(encoding="cp1252", errors="replace"))
        logging.getLogger("cantools").setLevel(logging.ERROR)  # what it warns of is refused below
        database = cantools.database.load_file(str(path), database_format="dbc", strict=True)
    except OSError as error:
        raise CompileError(place, f"cannot be read: {error.strerror}") from error
    except (DatabaseError, ValueError, LookupError, ArithmeticError, TypeError, AttributeError) as error:
        # The last four are what cantools does not catch itself: an attribute's type that is none, an index of an enum.
        raise CompileError(place, f"not a DBC that can be read: {error}") from error
    if not isinstance(database, cantools.database.can.Database):
        raise CompileError(place, "not a CAN database")
    _check_unique(text, database)
    return Dbc(database, text)


def _check_unique(text: DbcText, database: Any) -> None:
    names: set[str] = set()
    identifiers: dict[tuple[int, bool], str] = {}
    for message in database.messages:
        place = text.message(message)
        if message.name in names:
            raise CompileError(place, f"there are two messages '{message.name}'")
        names.add(message.name)
        other = identifiers.setdefault((message.frame_id, message.is_extended_frame), message.name)
        if other != message.name:
            raise CompileError(
                place, f"messages '{other}' and '{message.name}' have the same id 0x{message.frame_id:X}"
            )


def check_node(place: Place, database: Any, node: str) -> None:
    """Raises CompileError when the DBC has no such node."""
    nodes = [known.name for known in database.nodes]
    if node not in nodes:
        raise CompileError(place, f"no node '{node}'", nearest(node, nodes))


def _given(database: Any, owner: Any, name: str) -> Any:
    """An attribute's value: given on the object, else the DBC's default for it, else None."""
    given = owner.dbc.attributes.get(name) if owner.dbc is not None else None
    if given is not None:
        return given.value
    definition = database.dbc.attribute_definitions.get(name)
    return definition.default_value if definition is not None else None


def _owner(message: Any, signal: Any) -> str:
    return f"message '{message.name}'" if signal is None else f"signal '{message.name}.{signal.name}'"


def number(dbc: Dbc, name: str, message: Any, signal: Any = None) -> Decimal | None:
    """An attribute of a message, or of one of its signals, that is a number."""
    value = _given(dbc.database, message if signal is None else signal, name)
    try:
        result = None if value is None or value == "" else Decimal(str(value))
    except InvalidOperation:
        result = Decimal("nan")
    if result is not None and not result.is_finite():
        raise CompileError(
            dbc.text.attribute(name, message, signal),
            f"attribute {name} of {_owner(message, signal)} is {value!r}, and must be a number",
        )
    return result


def attribute(dbc: Dbc, name: str, limits: Limits, message: Any, signal: Any = None) -> int | None:
    """An attribute that is a whole number, within limits.

    Raises:
        CompileError: it is not; with the line of the attribute.
    """
    value = number(dbc, name, message, signal)
    if value is None:
        return None
    return whole(value, limits, f"{name} of {_owner(message, signal)}", dbc.text.attribute(name, message, signal))
