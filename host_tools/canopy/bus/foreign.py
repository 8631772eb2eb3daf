# SPDX-License-Identifier: MIT
"""Bus descriptions that are no DBC: KCD, SYM and ARXML, as cantools reads them."""

from __future__ import annotations

import logging
import re
from decimal import Decimal
from pathlib import Path

import cantools
from cantools.database.can import Database, Message, Signal
from cantools.errors import Error

from canopy.bus.source import Given, Source, SourceMessage, SourceSignal
from canopy.compiler.bus_model import merge
from canopy.compiler.errors import CompileError, Place

KINDS = {".kcd": "kcd", ".sym": "sym", ".arxml": "arxml"}
"""Suffix -> cantools' name of the kind."""
CONVERTIBLE = (".xls", ".xlsx", ".csv", ".json", ".yaml", ".yml", ".dbf", ".xml", ".xlsm", ".fibex")
"""What canmatrix can convert."""
_OTHERS = {".ldf": "a LIN bus", ".cdd": "diagnostics", ".a2l": "measurement and calibration", ".odx": "diagnostics"}
_ENTITY = re.compile(r"<!(?:DOCTYPE|ENTITY)")
_WORD = re.compile(r"\w+")


def refuse_kind(path: Path) -> None:
    """Raises CompileError for a file of a kind that is known, and cannot be read; with how to convert it."""
    suffix, place = path.suffix.lower(), Place(str(path))
    if suffix in CONVERTIBLE:
        raise CompileError(place, f"a {suffix} file cannot be read: DBC, KCD, SYM and ARXML can", _way(path))
    if suffix in _OTHERS:
        raise CompileError(place, f"a {suffix} file describes {_OTHERS[suffix]}, not a CAN bus")


def _way(path: Path) -> str:
    return f"to convert it: pip install canmatrix; canconvert {path.name} {path.stem}.dbc"


def _reason(error: Exception, kind: str) -> str:
    """What cantools says of the file. What Python says of cantools' own variables helps nobody."""
    inner = getattr(error, f"e_{kind}", None) or error
    if not isinstance(inner, (Error, ValueError, SyntaxError)):
        return "it has parts that cantools does not know"
    return " ".join(str(inner).split())


class _Lines:
    """Where a name stands first in a text."""

    def __init__(self, file: str, text: str) -> None:
        self._file = file
        self._first: dict[str, int] = {}
        for number, line in enumerate(text.split("\n"), 1):
            for word in _WORD.findall(line):
                self._first.setdefault(word, number)

    def place(self, name: str) -> Place:
        """The line, if the name is one word."""
        return Place(self._file, self._first.get(name, 0))


def read_foreign(path: Path, text: str) -> Source:
    """The file, from its text.

    Raises:
        CompileError: cantools cannot read it.
    """
    kind, place = KINDS[path.suffix.lower()], Place(str(path))
    if _ENTITY.search(text):
        raise CompileError(place, f"a {kind.upper()} file with a DOCTYPE or an ENTITY is not read", "remove it")
    logging.getLogger("cantools").setLevel(logging.ERROR)  # what it warns of is checked here
    try:
        database = cantools.database.load_string(text, database_format=kind, strict=False)
    except Exception as error:  # cantools lets through what its parsers raise, of any type
        text = f"not a {kind.upper()} file that can be read: {_reason(error, kind)}"
        raise CompileError(place, text, _way(path)) from error
    if not isinstance(database, Database):
        raise CompileError(place, "not a CAN bus")
    lines = _Lines(str(path), text)
    nodes = list(dict.fromkeys(node.name for node in database.nodes))
    return Source(nodes=nodes, messages=[_message(message, lines) for message in database.messages])


def _message(message: Message, lines: _Lines) -> SourceMessage:
    place = lines.place(message.name)
    result = SourceMessage(
        name=message.name,
        place=place,
        id=message.frame_id | (0x80000000 if message.is_extended_frame else 0),
        length=message.length,
        senders=list(message.senders),
        signals=[_signal(signal, lines) for signal in message.signals],
        comment=str(message.comment or ""),
        is_fd=message.is_fd,
        is_j1939=message.protocol == "j1939" and message.is_extended_frame,
    )
    if message.cycle_time:
        result.attributes["GenMsgCycleTime"] = Given(str(message.cycle_time), place)
    if message.is_container:
        result.problem = CompileError(place, f"message '{message.name}' is a container of others, which has no code")
    return result


def _signal(signal: Signal, lines: _Lines) -> SourceSignal:
    ends = [None if end is None else Decimal(str(end)) for end in (signal.minimum, signal.maximum)]
    result = SourceSignal(
        name=signal.name,
        place=lines.place(signal.name),
        start=signal.start,
        length=signal.length,
        little_endian=signal.byte_order == "little_endian",
        is_signed=signal.is_signed,
        scale=Decimal(str(signal.scale)),
        offset=Decimal(str(signal.offset)),
        minimum=ends[0] if None not in ends else None,
        maximum=ends[1] if None not in ends else None,
        unit=signal.unit or "",
        comment=str(signal.comment or ""),
        receivers=list(signal.receivers),
        is_float=signal.is_float,
        choices={int(value): str(text) for value, text in (signal.choices or {}).items()},
        is_multiplexer=signal.is_multiplexer,
        multiplexer=signal.multiplexer_signal,
        branches=merge((value, value) for value in signal.multiplexer_ids or ()),
    )
    if signal.raw_initial is not None:
        result.attributes["GenSigStartValue"] = Given(str(signal.raw_initial), result.place)
    return result
