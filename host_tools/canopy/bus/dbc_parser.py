# SPDX-License-Identifier: MIT
"""Reads a DBC as it is met: a statement that is wrong costs itself, or its message, and never the file."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable
from decimal import Decimal

from canopy.bus.dbc_grammar import PAIR, RANGE, TEXT, WORD, Statement, statements, unquoted
from canopy.bus.source import (
    MAX_MESSAGE_BYTES,
    MAX_SIGNALS,
    Given,
    ReversedRange,
    Source,
    SourceMessage,
    SourceSignal,
)
from canopy.compiler.bus_model import Ranges, merge
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.numbers import DIGITS_MAX

UNASSIGNED = "VECTOR__INDEPENDENT_SIG_MSG"
NOBODY = "Vector__XXX"
FLOAT_BITS = {1: 32, 2: 64}
"""SIG_VALTYPE_ -> bits."""
_EXPONENT = re.compile(r"[eE][-+]?\d{4,}")
_FORMATS = (
    "StandardCAN", "ExtendedCAN", "reserved", "J1939PG", *["reserved"] * 10, "StandardCAN_FD", "ExtendedCAN_FD",
)  # fmt: skip


class _BadNumberError(Exception):
    """A number that nobody can have meant; the text says why."""


def is_too_long(text: str) -> bool:
    """Would computing with the number take long? Ten digits of exponent keep any program busy for ever."""
    return len(text) > DIGITS_MAX or _EXPONENT.search(text) is not None


def too_long(text: str) -> str:
    """What is wrong with it."""
    return f"the number {text[:20]}{'…' if len(text) > 20 else ''} is too long to be read"


LONG_HELP = f"at most {DIGITS_MAX} digits, and 3 of exponent"


def _decimal(text: str) -> Decimal:
    if is_too_long(text):
        raise _BadNumberError(too_long(text))
    return Decimal(text)


def _whole(text: str) -> int:
    return int(_decimal(text))


def _nodes(text: str | None) -> list[str]:
    return [name for name in WORD.findall(text or "") if name != NOBODY]


class DbcParser:
    """One file."""

    def __init__(self, file: str, text: str) -> None:
        """Reads `text`; `source` is the result, and `is_dbc` whether it has any statement at all."""
        self.source = Source()
        self.is_dbc = False
        self._file = file
        self._text = text
        self._ends = [match.start() for match in re.finditer("\n", text)]
        self._current: SourceMessage | None = None
        self._nobody = SourceMessage(UNASSIGNED, Place(file), 0, 0)
        """Has the signals that belong to no message."""
        self._messages: dict[int, list[SourceMessage]] = {}
        self._numbers: dict[int, int] = {
            id(self._nobody): -1
        }  # id() of a message -> the number by which its file calls it
        self._signals: dict[tuple[int, str], list[SourceSignal]] = {}
        self._definitions: dict[str, list[str]] = {}
        self._tables: dict[str, dict[int, str]] = {}
        self._multiplexers: dict[tuple[int, str], tuple[str, Ranges]] = {}
        later = []
        for statement in statements(text):
            self.is_dbc = True
            if statement.kind in ("BO_", "SG_", "BU_", "VAL_TABLE_", "BA_DEF_"):
                self._read(statement)
            else:
                later.append(statement)  # what it says of a message may stand before it
        for statement in later:
            self._read(statement)
        self._finish()

    def _place(self, offset: int) -> Place:
        return Place(self._file, bisect_right(self._ends, offset - 1) + 1)

    def _read(self, statement: Statement) -> None:
        place = self._place(statement.start)
        try:
            if statement.found is None:
                raise _BadNumberError(f"{statement.kind} cannot be read here: {self._line(statement.start)}")
            _HANDLERS[statement.kind](self, statement.found, place)
        except _BadNumberError as error:
            self._blame(statement, CompileError(place, str(error), LONG_HELP if "too long" in str(error) else ""))

    def _line(self, offset: int) -> str:
        line = self._text[offset : offset + 80].split("\n", 1)[0]
        return line.strip()

    def _blame(self, statement: Statement, problem: CompileError) -> None:
        """Whose fault it is: the message's of which the statement speaks."""
        if statement.kind == "SG_":
            if self._current is not None:
                self._current.problem = self._current.problem or problem
                self._current.has_lost_signals = True
                return
        elif statement.kind in ("VAL_", "SG_MUL_VAL_", "SIG_VALTYPE_") and statement.found is not None:
            for message in self._messages_of(statement.found["message"]):
                message.problem = message.problem or problem
            return
        if statement.kind == "BO_":
            self._current = self._nobody  # its signals are as unreadable as it is
        if statement.kind in ("BO_", "SG_"):
            self.source.problems.append(problem)

    def _skip(self, found: re.Match[str], place: Place) -> None:
        """Nothing of it is needed."""

    # Messages and signals

    def _take_nodes(self, found: re.Match[str], _place: Place) -> None:
        self.source.nodes += [name for name in _nodes(found["nodes"]) if name not in self.source.nodes]

    def _take_message(self, found: re.Match[str], place: Place) -> None:
        self._current = self._nobody
        if found["name"] == UNASSIGNED:
            return
        number, problem, length = found["id"], "", 0
        help_text = ""
        try:
            length = int(found["length"], 0)
        except ValueError:
            problem = f"'{found['length']}' is not a number of bytes"
        if length > MAX_MESSAGE_BYTES:
            problem = f"message '{found['name']}' is longer than {MAX_MESSAGE_BYTES} bytes"
            length, help_text = 0, "CAN FD has 64"
        identifier = int(number) if len(number) <= 20 else 1 << 40
        shown = f"0x{identifier:X}" if len(number) <= 20 else f"{number[:20]}…"
        unmarked = 0x7FF < identifier <= 0x1FFFFFFF
        if unmarked:
            identifier |= 0x80000000
        elif identifier >= 1 << 32 or (identifier & 0x7FFFFFFF) >> (29 if identifier & 0x80000000 else 11):
            problem = problem or f"the id {shown} of message '{found['name']}' needs more than 29 bits"
        message = SourceMessage(found["name"], place, identifier, length, _nodes(found["sender"]))
        if problem:
            message.problem = CompileError(place, problem, help_text)
        self.source.messages.append(message)
        if unmarked:
            text = f"the id {shown} of message '{message.name}' needs more than 11 bits, so it is taken as one of 29"
            message.notes.append((place, text))
        written = int(number) if len(number) <= 20 else -1
        self._messages.setdefault(written, []).append(message)
        self._numbers[id(message)] = written
        self._current = message

    def _take_signal(self, found: re.Match[str], place: Place) -> None:
        message = self._current
        if message is None:
            raise _BadNumberError(f"signal '{found['name']}' belongs to no message that can be read")
        if len(message.signals) == MAX_SIGNALS:
            text = f"message '{message.name}' has more than {MAX_SIGNALS} signals"
            message.problem = message.problem or CompileError(place, text)
            return
        low, high = _decimal(found["minimum"]), _decimal(found["maximum"])
        start, length = _whole(found["start"]), _whole(found["length"])
        if max(start, length) > 8 * MAX_MESSAGE_BYTES or length == 0:
            raise _BadNumberError(
                f"signal '{message.name}.{found['name']}' is at {found['start'][:20]}|{found['length'][:20]}, and "
                f"{'has no bits' if length == 0 else f'no message has more than {8 * MAX_MESSAGE_BYTES} bits'}"
            )
        signal = SourceSignal(
            found["name"], place, start, length,
            little_endian=found["order"] == "1", is_signed=found["sign"] == "-",
            scale=_decimal(found["scale"]), offset=_decimal(found["offset"]),
            minimum=None if (found["minimum"], found["maximum"]) == ("0", "0") else low,
            maximum=None if (found["minimum"], found["maximum"]) == ("0", "0") else high,
            unit=unquoted(found["unit"]), receivers=_nodes(found["receivers"]),
        )  # fmt: skip
        self._take_marker(signal, found["mux"])
        message.signals.append(signal)
        self._signals.setdefault((self._numbers[id(message)], signal.name), []).append(signal)

    @staticmethod
    def _take_marker(signal: SourceSignal, marker: str | None) -> None:
        form = re.fullmatch(r"(?:m(\d{1,20}))?(M)?", marker or "")
        if form is None:
            raise _BadNumberError(f"'{marker}' behind signal '{signal.name}' is neither M nor m and a number")
        signal.is_multiplexer = form[2] is not None
        if form[1] is not None:
            signal.marker = ((int(form[1]), int(form[1])),)

    # What is said of them

    def _messages_of(self, number: str | None) -> list[SourceMessage]:
        return self._messages.get(int(number), []) if number is not None and len(number) <= 20 else []

    def _signals_of(self, number: str | None, name: str) -> list[SourceSignal]:
        """The signals of that name of a message, however often they are there."""
        return self._signals.get((int(number), name), []) if number is not None and len(number) <= 20 else []

    def _take_comment(self, found: re.Match[str], _place: Place) -> None:
        text = unquoted(found["text"])
        for message in self._messages_of(found["message"]):
            message.comment = text
        for signal in self._signals_of(found["signal_of"], found["signal"]):
            signal.comment = text

    @staticmethod
    def _pairs(text: str) -> dict[int, str]:
        return {_whole(number): unquoted(name) for number, name in PAIR.findall(text)}

    def _take_table(self, found: re.Match[str], _place: Place) -> None:
        self._tables[found["name"]] = self._pairs(found["pairs"])

    def _take_values(self, found: re.Match[str], _place: Place) -> None:
        table = found["table"]
        values = self._tables.get(table, {}) if table is not None else self._pairs(found["pairs"])
        for signal in self._signals_of(found["message"], found["signal"]) if values else ():
            signal.choices = values

    def _take_float(self, found: re.Match[str], _place: Place) -> None:
        kind = int(found["type"][:4])
        for signal in self._signals_of(found["message"], found["signal"]):
            signal.is_float = kind in FLOAT_BITS
            if kind > max(FLOAT_BITS):
                raise _BadNumberError(f"SIG_VALTYPE_ of '{signal.name}' is {kind}, and 0, 1 and 2 are known")

    def _take_branches(self, found: re.Match[str], place: Place) -> None:
        ranges = [(_whole(first), _whole(last)) for first, last in RANGE.findall(found["ranges"])]
        for message in self._messages_of(found["message"]):
            reverse = (f"{first}-{last}" for first, last in ranges if first > last)
            message.reversed_ranges += [ReversedRange(place, found["signal"], text) for text in reverse]
            branches = merge((first, last) for first, last in ranges if first <= last)
            self._multiplexers[self._numbers[id(message)], found["signal"]] = (found["mux"], branches)

    def _take_senders(self, found: re.Match[str], _place: Place) -> None:
        for message in self._messages_of(found["message"]):
            message.senders += [name for name in _nodes(found["nodes"]) if name not in message.senders]

    # Attributes

    def _take_definition(self, found: re.Match[str], _place: Place) -> None:
        if found["type"] == "ENUM":
            self._definitions[unquoted(found["name"])] = [unquoted(text) for text in TEXT.findall(found["values"])]

    def _value(self, name: str, text: str) -> str:
        """An ENUM's value by its name, whether it is written as a name or as a number."""
        names = self._definitions.get(name) or (list(_FORMATS) if name == "VFrameFormat" else None)
        value = unquoted(text)
        if names is None or text.startswith('"') or not re.fullmatch(r"\d{1,9}", value):
            return value
        return names[int(value)] if int(value) < len(names) else value

    def _take_default(self, found: re.Match[str], place: Place) -> None:
        name = unquoted(found["name"])
        self.source.defaults[name] = Given(self._value(name, found["value"]), place)

    def _take_attribute(self, found: re.Match[str], place: Place) -> None:
        name = unquoted(found["name"])
        given = Given(self._value(name, found["value"]), place)
        if not (found["message"] or found["signal_of"] or found["other"]):
            self.source.attributes[name] = given
        for message in self._messages_of(found["message"]):
            message.attributes[name] = given
        for signal in self._signals_of(found["signal_of"], found["signal"]):
            signal.attributes[name] = given

    # The whole

    def _finish(self) -> None:
        standard = self.source.defaults.get("VFrameFormat")
        protocol = self.source.attributes.get("ProtocolType", self.source.defaults.get("ProtocolType"))
        is_j1939 = protocol is not None and protocol.value.upper() == "J1939"
        for message in self.source.messages:
            given = message.attributes.get("VFrameFormat", standard)
            message.is_fd = given is not None and given.value.endswith("CAN_FD")
            message.is_j1939 = message.is_extended and (given.value == "J1939PG" if given is not None else is_j1939)
            self._resolve(message)
            _name_long(message)

    def _resolve(self, message: SourceMessage) -> None:
        """Which multiplexer selects a signal, and with which values."""
        owners = [signal for signal in message.signals if signal.is_multiplexer]
        for signal in message.signals:
            said = self._multiplexers.get((self._numbers[id(message)], signal.name))
            if said is not None:  # whatever its mark says: some tools write M alone
                signal.multiplexer = said[0]
                signal.branches = merge([*said[1], *(signal.marker if len(owners) == 1 else ())])
            elif signal.marker and len(owners) == 1 and owners[0] is not signal:
                signal.multiplexer, signal.branches = owners[0].name, signal.marker


def _long(owner: SourceMessage | SourceSignal, attribute: str) -> str:
    """Names of more than 32 characters are in attributes."""
    given = owner.attributes.get(attribute)
    return given.value if given is not None and re.fullmatch(r"\w+", given.value) else owner.name


def _name_long(message: SourceMessage) -> None:
    message.name = _long(message, "SystemMessageLongSymbol")
    names = {signal.name: _long(signal, "SystemSignalLongSymbol") for signal in message.signals}
    for signal in message.signals:
        signal.name = names[signal.name]
        if signal.multiplexer is not None:
            signal.multiplexer = names.get(signal.multiplexer, signal.multiplexer)


_HANDLERS: dict[str, Callable[[DbcParser, re.Match[str], Place], None]] = {
    "BU_": DbcParser._take_nodes,
    "BO_": DbcParser._take_message,
    "SG_": DbcParser._take_signal,
    "CM_": DbcParser._take_comment,
    "VAL_": DbcParser._take_values,
    "VAL_TABLE_": DbcParser._take_table,
    "BA_DEF_": DbcParser._take_definition,
    "BA_DEF_DEF_": DbcParser._take_default,
    "BA_": DbcParser._take_attribute,
    "SIG_VALTYPE_": DbcParser._take_float,
    "SG_MUL_VAL_": DbcParser._take_branches,
    "BO_TX_BU_": DbcParser._take_senders,
    "NS_": DbcParser._skip,
    "VERSION": DbcParser._skip,
    "BS_": DbcParser._skip,
}
