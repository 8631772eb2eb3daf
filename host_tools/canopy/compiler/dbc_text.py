# SPDX-License-Identifier: MIT
"""The text of a DBC, before cantools computes with it: where things stand in it, and numbers that would take for ever.

cantools gives no places, and makes a list of each bit of a message and of each value of a multiplexer's range.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.numbers import DIGITS_MAX

MAX_MESSAGE_BYTES = 1785  # of J1939's transport protocol
MAX_BITS = 8 * MAX_MESSAGE_BYTES
MAX_SIGNALS = 2_048  # of a message: cantools compares each pair of them
MAX_BRANCH_VALUES = 1 << 20  # of all multiplexers of a file

# Texts come first in it: nothing inside of them is a statement.
_STATEMENT = re.compile(
    r"""
      \bBO_\s+(?P<id>\d+)\s+(?P<message>\w+)\s*:\s*(?P<bytes>\w+)
    | \bSG_\s+(?P<signal>\w+)(?:\s+\w+)?\s*:\s*(?P<start>\d+)\s*\|\s*(?P<bits>\d+)
    | \bSG_MUL_VAL_\s+(?P<branch_of>\d+)\s+(?P<branch>\w+)\s+\w+\s+(?P<ranges>[\d\s,-]+)
    | \bBA_\s+"(?P<attribute>[^"]*)"\s+(?:BO_\s+(?P<on_message>\d+)|SG_\s+(?P<on_signal_of>\d+)\s+(?P<on_signal>\w+))
    | \bBA_DEF_DEF_\s+"(?P<default>[^"]*)"
    | "(?:\\.|[^"\\])*"
    """,
    re.VERBOSE,
)
_RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")
# A number of many digits, or with an exponent of four or more.
_LONG = re.compile(rf"(?<![\w.])[+-]?(?:\d[\d.]{{{DIGITS_MAX},}}|\d[\d.]*[eE][+-]?\d{{4,}})")
_TEXT = re.compile(r'"((?:\\.|[^"\\])*)"')


@dataclass(frozen=True)
class ReversedRange:
    """A range of a multiplexer's values whose first is larger than its last: cantools takes it for none."""

    place: Place
    message_id: int
    signal: str
    text: str


class DbcText:
    """Where the statements of a DBC stand. An id is the one that the DBC writes: bit 31 is set for 29 bits."""

    def __init__(self, file: str, text: str) -> None:
        """Looks for what is too large to be read.

        Raises:
            CompileError: a number, a message or a range is.
        """
        self.file = file
        self.reversed_ranges: list[ReversedRange] = []
        self._ends = [match.start() for match in re.finditer("\n", text)]
        self._messages: dict[int, int] = {}
        self._signals: dict[tuple[int, str], int] = {}
        self._attributes: dict[tuple[str, int, str], int] = {}
        self._defaults: dict[str, int] = {}
        self._check_digits(text)
        self._read(text)

    def _place(self, offset: int | None) -> Place:
        return Place(self.file) if offset is None else Place(self.file, bisect_right(self._ends, offset - 1) + 1)

    def _check_digits(self, text: str) -> None:
        """Ten digits of exponent are enough to keep any program busy for ever."""
        found = list(_LONG.finditer(text))
        if not found:
            return
        inside = {}  # place in the text -> the whole quoted text, for those that have such a number
        quoted = iter(_TEXT.finditer(text))
        quote = next(quoted, None)
        for number in found:
            while quote is not None and quote.end() <= number.start():
                quote = next(quoted, None)
            if quote is not None and quote.start() < number.start():
                inside[number.start()] = quote[1].strip()
        for number in found:
            if inside.get(number.start(), number[0]) == number[0]:  # in other texts it is no number
                raise CompileError(
                    self._place(number.start()),
                    f"the number {number[0][:20]}{'…' if len(number[0]) > 20 else ''} is too long to be read",
                    f"at most {DIGITS_MAX} digits, and 3 of exponent",
                )

    def _read(self, text: str) -> None:
        message, name, values, signals = -1, "", 0, 0
        for found in _STATEMENT.finditer(text):
            at = found.start()
            if found["message"] is not None:
                message, name, signals = int(found["id"]), found["message"], 0
                self._messages.setdefault(message, at)
                self._check_bytes(found["bytes"], name, at)
            elif found["signal"] is not None:
                self._signals.setdefault((message, found["signal"]), at)
                signals += 1
                if signals > MAX_SIGNALS:
                    raise CompileError(self._place(at), f"message '{name}' has more than {MAX_SIGNALS} signals")
                if max(int(found["start"]), int(found["bits"])) > MAX_BITS:
                    raise CompileError(
                        self._place(at),
                        f"signal '{name}.{found['signal']}' is at {found['start']}|{found['bits']}, and no message has "
                        f"more than {MAX_BITS} bits",
                    )
            elif found["ranges"] is not None:
                values += self._branch_values(found)
                if values > MAX_BRANCH_VALUES:
                    raise CompileError(
                        self._place(at),
                        f"signal '{found['branch']}': multiplexers of this file have more than {MAX_BRANCH_VALUES} "
                        "values",
                        "name fewer of them in SG_MUL_VAL_",
                    )
            elif found["attribute"] is not None:
                owner = int(found["on_message"] or found["on_signal_of"])
                self._attributes[found["attribute"], owner, found["on_signal"] or ""] = at
            elif found["default"] is not None:
                self._defaults[found["default"]] = at

    def _check_bytes(self, written: str, name: str, at: int) -> None:
        try:
            length = int(written, 0)
        except ValueError:
            return  # cantools says what is wrong with it
        if length > MAX_MESSAGE_BYTES:
            raise CompileError(
                self._place(at), f"message '{name}' is longer than {MAX_MESSAGE_BYTES} bytes", "CAN FD has 64"
            )

    def _branch_values(self, found: re.Match[str]) -> int:
        total = 0
        for written in _RANGE.finditer(found["ranges"]):
            first, last = int(written[1]), int(written[2])
            total += max(0, last - first + 1)
            if first > last:
                place = self._place(found.start())
                self.reversed_ranges.append(
                    ReversedRange(place, int(found["branch_of"]), found["branch"], f"{first}-{last}")
                )
        return total

    def message(self, message: Any) -> Place:
        """The line of a message of cantools'."""
        return self._place(self._messages.get(dbc_id(message)))

    def signal(self, message: Any, signal: Any) -> Place:
        """The line of one of its signals."""
        return self._place(self._signals.get((dbc_id(message), signal.name), self._messages.get(dbc_id(message))))

    def attribute(self, name: str, message: Any, signal: Any = None) -> Place:
        """The line that gives a message or signal the attribute, be it by default; else that of the object."""
        owner = signal.name if signal is not None else ""
        given = self._attributes.get((name, dbc_id(message), owner), self._defaults.get(name))
        if given is not None:
            return self._place(given)
        return self.message(message) if signal is None else self.signal(message, signal)


def dbc_id(message: Any) -> int:
    """The id as the DBC writes it."""
    return int(message.frame_id | (0x80000000 if message.is_extended_frame else 0))
