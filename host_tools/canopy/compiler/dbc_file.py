# SPDX-License-Identifier: MIT
"""A DBC file as cantools reads it, within limits; its attributes, and the ids that it writes."""

from __future__ import annotations

import logging
import re
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import cantools
import cantools.database.can
from cantools.database.errors import Error as DatabaseError

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.files import FileError, read_bytes

MAX_BYTES = 16 * 1024 * 1024
MAX_SIGNALS = 2_048  # of a message
MAX_MESSAGE_BYTES = 1785  # of J1939's transport protocol
_MESSAGE_LENGTH = re.compile(r"\s*BO_\s+\d+\s+(\w+)\s*:\s*(\d+)")


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


def read_dbc(path: Path) -> bytes:
    """The bytes of a DBC file.

    Raises:
        CompileError: it cannot be read, or has a byte that stands for no character.
    """
    try:
        data = read_bytes(path, MAX_BYTES)
        decode_dbc(data)
    except FileError as error:
        raise CompileError(Place(str(path)), error.problem) from error
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise CompileError(
            Place(str(path), line),
            f"byte 0x{data[error.start]:02x} is no character: a DBC is in UTF-8 or in Windows-1252",
            "save the file as UTF-8",
        ) from None
    return data


def load_dbc(path: Path) -> Any:
    """The database of a DBC file, in cantools' strict mode.

    Raises:
        CompileError: it cannot be read, is too large, or has two messages of one name or id.
    """
    place = Place(str(path))
    text = decode_dbc(read_dbc(path))
    _check_sizes(path, text)
    try:
        logging.getLogger("cantools").setLevel(logging.ERROR)  # what it warns of is refused below
        database = cantools.database.load_string(text, database_format="dbc", strict=True)
    except (DatabaseError, ValueError, KeyError, ArithmeticError) as error:
        raise CompileError(place, f"not a DBC that can be read: {error}") from error
    if not isinstance(database, cantools.database.can.Database):
        raise CompileError(place, "not a CAN database")
    _check_unique(place, database)
    return database


def _check_sizes(path: Path, text: str) -> None:
    """Refuses messages that nobody sends: cantools takes time for each bit of them, and for each pair of signals."""
    name, signals = "", 0
    for line_number, line in enumerate(text.splitlines(), 1):
        place = Place(str(path), line_number)
        found = _MESSAGE_LENGTH.match(line)
        if found is not None:
            name, signals = found[1], 0
            if len(found[2]) > 4 or int(found[2]) > MAX_MESSAGE_BYTES:
                raise CompileError(place, f"message '{name}' is longer than {MAX_MESSAGE_BYTES} bytes", "CAN FD has 64")
        signals += line.lstrip().startswith("SG_ ")
        if signals > MAX_SIGNALS:
            raise CompileError(place, f"message '{name}' has more than {MAX_SIGNALS} signals")


def _check_unique(place: Place, database: Any) -> None:
    names: set[str] = set()
    identifiers: dict[tuple[int, bool], str] = {}
    for message in database.messages:
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


def number(database: Any, place: Place, owner: Any, name: str) -> Decimal | None:
    """An attribute that is a number."""
    value = _given(database, owner, name)
    try:
        return None if value is None or value == "" else Decimal(str(value))
    except InvalidOperation:
        raise CompileError(place, f"attribute {name} of '{owner.name}' is {value!r}, and must be a number") from None


def attribute(database: Any, place: Place, owner: Any, name: str, default: int) -> int:
    """An attribute that is a whole number."""
    value = number(database, place, owner, name)
    return default if value is None else int(value)


def dbc_id(message: Any) -> int:
    """The id as the DBC writes it."""
    return int(message.frame_id | (0x80000000 if message.is_extended_frame else 0))
