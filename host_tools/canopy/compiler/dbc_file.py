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

from canopy.compiler.dbc_text import DbcText
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.limits import DATA_ID, TIME_MS, Limits, whole
from canopy.files import FileError, read_bytes

MAX_BYTES = 16 * 1024 * 1024


@dataclass(frozen=True)
class Dbc:
    """A DBC as cantools reads it, and its text, which knows the lines."""

    database: Any
    text: DbcText


def decode_dbc(data: bytes) -> str:
    """The text of a DBC: in UTF-8 if it is that, else in Windows-1252, in which most tools write DBCs.

    Raises:
        UnicodeDecodeError: a byte stands for no character in either.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _decoded(path: Path, data: bytes) -> str:
    try:
        return decode_dbc(data)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise CompileError(
            Place(str(path), line),
            f"byte 0x{data[error.start]:02x} is no character: a DBC is in UTF-8 or in Windows-1252",
            "save the file as UTF-8",
        ) from None


def read_dbc(path: Path) -> bytes:
    """The bytes of a DBC file.

    Raises:
        CompileError: it cannot be read, or has a byte that stands for no character.
    """
    try:
        data = read_bytes(path, MAX_BYTES)
    except FileError as error:
        raise CompileError(Place(str(path)), error.problem) from error
    _decoded(path, data)
    return data


def load_dbc(path: Path) -> Dbc:
    """A DBC file, in cantools' strict mode: no two signals overlap, and none is longer than its message.

    Raises:
        CompileError: it cannot be read, is too large, or has two messages of one name or id.
    """
    return parse_dbc(path, read_dbc(path))


def parse_dbc(path: Path, data: bytes, *, strict: bool = True) -> Dbc:
    """The same of the bytes of a file. Raises CompileError as load_dbc() does."""
    place = Place(str(path))
    content = decode_dbc(data)
    text = DbcText(str(path), content)
    try:
        logging.getLogger("cantools").setLevel(logging.ERROR)  # what it warns of is refused below
        database = cantools.database.load_string(content, database_format="dbc", strict=strict)
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


def check_timing(dbc: Dbc, message: Any) -> None:
    """Raises CompileError when a time or the data id of a message is not one that the runtime can have."""
    for name, limits in (("GenMsgCycleTime", TIME_MS), ("GenMsgTimeoutTime", TIME_MS), ("E2EDataId", DATA_ID)):
        attribute(dbc, name, limits, message)


def attribute(dbc: Dbc, name: str, limits: Limits, message: Any, signal: Any = None) -> int | None:
    """An attribute that is a whole number, within limits.

    Raises:
        CompileError: it is not; with the line of the attribute.
    """
    value = number(dbc, name, message, signal)
    if value is None:
        return None
    return whole(value, limits, f"{name} of {_owner(message, signal)}", dbc.text.attribute(name, message, signal))
