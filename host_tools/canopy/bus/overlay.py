# SPDX-License-Identifier: MIT
"""What an application adds to the maker's file: the overlay NAME.overlay.toml beside NAME.dbc (docs/dbc.md).

It is read wherever the file is read, so no tool can see one without the other.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.bus import j1939
from canopy.bus.source import Given, Source, SourceMessage, SourceSignal
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.limits import COUNT, Limits, whole
from canopy.verify.toml_file import TomlFile

SUFFIX = ".overlay.toml"
TO_FILL_IN = "?"
"""What `canopy dbc overlay` writes where somebody has to decide."""
ANY = "any"
PROTOCOLS = ("can", "j1939")
SEND_KINDS = ("cyclic", "on_change", "on_request")

_ADDRESS = {
    "source": (j1939.SOURCE, Limits(0, 255)),
    "destination": (j1939.DESTINATION, Limits(0, 255)),
    "priority": (j1939.PRIORITY, Limits(0, 7)),
}
_NUMBERS = {
    "cycle_ms": "GenMsgCycleTime",
    "timeout_ms": "GenMsgTimeoutTime",
    "e2e_data_id": "E2EDataId",
    "min_distance_ms": "CanopyMinDistance",
    "offset_ms": "CanopyOffset",
}
"""Key of a message -> the attribute that it gives."""


def overlay_path(path: Path) -> Path:
    """Where the overlay of a file is, if there is one."""
    return path.with_name(path.stem + SUFFIX)


def heading(message: str, signal: str = "") -> str:
    """The table of the overlay in which something is said of a message or signal."""
    quoted = [
        name if name.isascii() and name.replace("_", "a").isalnum() else f'"{name}"' for name in (message, signal)
    ]
    return f"[message.{quoted[0]}.signal.{quoted[1]}]" if signal else f"[message.{quoted[0]}]"


def to_write(path: Path, line: str, message: str, signal: str = "") -> str:
    """A help text: which line is missing, and where."""
    return f"to fix: write in {overlay_path(path).name}: {heading(message, signal)} {line}"


def decimal_text(value: Fraction) -> str:
    """A number that has an end as a decimal one, exactly."""
    with localcontext() as context:
        context.prec = 400
        return format(Decimal(value.numerator) / Decimal(value.denominator), "f")


class Overlay:
    """One overlay, applied to its file."""

    def __init__(self, path: Path, source: Source) -> None:
        """Reads `path` and changes `source`.

        Raises:
            CompileError: the overlay cannot be read, or says something that cannot be.
        """
        self._file = TomlFile(path)
        self._source = source
        content = self._table(self._file.content, ())
        self._known(content, ("protocol", "message"), ())
        protocol = content.get("protocol", "can")
        if protocol not in PROTOCOLS:
            raise self._error(f"the protocol is {protocol!r}", ("protocol",), f"known are {', '.join(PROTOCOLS)}")
        if protocol == "j1939":
            for message in source.messages:
                message.is_j1939 = message.is_extended
        for name, table in self._table(content.get("message", {}), ("message",)).items():
            self._take_message(name, self._table(table, ("message", name)))

    def _place(self, keys: tuple[str, ...]) -> Place:
        return self._file.place(*keys)

    def _error(self, text: str, keys: tuple[str, ...], help_text: str = "") -> CompileError:
        return CompileError(self._place(keys), text, help_text)

    def _table(self, value: Any, keys: tuple[str, ...]) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self._error(f"'{'.'.join(keys)}' is not a table", keys, f"write [{'.'.join(keys)}]")
        return value

    def _known(self, table: dict[str, Any], known: tuple[str, ...], keys: tuple[str, ...]) -> None:
        for key, value in table.items():
            here = (*keys, key)
            if key not in known:
                raise self._error(f"unknown key '{key}' in the overlay", here, nearest(key, known))
            if value == TO_FILL_IN:
                raise self._error(f"{'.'.join(here)} is still to be filled in", here, 'write a value in place of "?"')

    def _nodes(self, value: Any, keys: tuple[str, ...]) -> list[str]:
        if not isinstance(value, list) or not all(isinstance(name, str) and name for name in value):
            raise self._error(f"{'.'.join(keys)} must be a list of nodes", keys, 'for example ["Controller"]')
        self._source.nodes += [name for name in value if name not in self._source.nodes]
        return list(value)

    def _flag(self, value: Any, keys: tuple[str, ...]) -> bool:
        if not isinstance(value, bool):
            raise self._error(f"{'.'.join(keys)} must be true or false", keys)
        return value

    def _number(self, value: Any, keys: tuple[str, ...]) -> Fraction:
        if isinstance(value, bool) or not isinstance(value, (int, Fraction)):
            raise self._error(f"{'.'.join(keys)} must be a number", keys)
        return Fraction(value)

    def _take_message(self, name: str, table: dict[str, Any]) -> None:
        found = [message for message in self._source.messages if message.name == name]
        keys = ("message", name)
        if not found:
            known = nearest(name, (message.name for message in self._source.messages))
            raise self._error(f"no message '{name}'", keys, known)
        self._known(table, (*_NUMBERS, *_MESSAGE_KEYS, "signal"), keys)
        for message in found:
            for key, attribute in _NUMBERS.items():
                if key in table:
                    value = self._number(table[key], (*keys, key))
                    message.attributes[attribute] = Given(decimal_text(value), self._place((*keys, key)))
            for key, take in _MESSAGE_KEYS.items():
                if key in table:
                    take(self, message, table[key], (*keys, key))
            for signal, below in self._table(table.get("signal", {}), (*keys, "signal")).items():
                self._take_signal(message, signal, self._table(below, (*keys, "signal", signal)))

    # Of messages

    def _take_length(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        message.length = whole(self._number(value, keys), COUNT, ".".join(keys), self._place(keys))

    def _take_longer(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        message.may_be_longer = self._flag(value, keys)

    def _take_leave_out(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        message.is_left_out = self._flag(value, keys)

    def _take_senders(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        message.senders = self._nodes(value, keys)

    def _take_receivers(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        message.added_receivers = self._nodes(value, keys)
        for signal in message.signals:
            signal.receivers = list(message.added_receivers)

    def _take_send(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        if value not in SEND_KINDS:
            raise self._error(f"{'.'.join(keys)} is {value!r}", keys, f"known are {', '.join(SEND_KINDS)}")
        message.attributes["CanopySend"] = Given(str(value), self._place(keys))

    def _take_address(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        field, limits = _ADDRESS[keys[-1]]
        number = None if value == ANY else whole(self._number(value, keys), limits, ".".join(keys), self._place(keys))
        message.address.fields[field] = number
        message.address.place = self._place(keys)

    def _take_sources(self, message: SourceMessage, value: Any, keys: tuple[str, ...]) -> None:
        message.address.place = self._place(keys)
        for name, number in self._table(value, keys).items():
            here = (*keys, name)
            if not name.isidentifier():
                raise self._error(f"'{name}' cannot be the end of a message's name", here, "letters, digits and _")
            limits = _ADDRESS["source"][1]
            message.address.sources[name] = whole(self._number(number, here), limits, ".".join(here), self._place(here))

    # Of signals

    def _take_signal(self, message: SourceMessage, name: str, table: dict[str, Any]) -> None:
        keys = ("message", message.name, "signal", name)
        found = [signal for signal in message.signals if signal.name == name]
        if not found:
            raise self._error(
                f"message '{message.name}' has no signal '{name}'",
                keys,
                nearest(name, (signal.name for signal in message.signals)),
            )
        self._known(table, ("signed", "range", "safe", "leave_out"), keys)
        for signal in found:
            if "signed" in table:
                signal.is_signed = self._flag(table["signed"], (*keys, "signed"))
            if "range" in table:
                self._take_range(signal, table["range"], (*keys, "range"))
            if "safe" in table:
                raw = self._raw(message, signal, table["safe"], (*keys, "safe"))
                signal.attributes["GenSigInactiveValue"] = Given(raw, self._place((*keys, "safe")))
            if self._flag(table.get("leave_out", False), (*keys, "leave_out")):
                message.signals.remove(signal)

    def _take_range(self, signal: SourceSignal, value: Any, keys: tuple[str, ...]) -> None:
        if value == ANY:
            signal.minimum = signal.maximum = None
            return
        if not isinstance(value, list) or len(value) != 2:
            raise self._error(f'{".".join(keys)} must be two numbers, or "any"', keys, "for example [0, 100]")
        low, high = (self._number(end, keys) for end in value)
        if low >= high:
            raise self._error(f"{'.'.join(keys)}: the first end must be below the second", keys)
        signal.minimum, signal.maximum = Decimal(decimal_text(low)), Decimal(decimal_text(high))

    def _raw(self, message: SourceMessage, signal: SourceSignal, value: Any, keys: tuple[str, ...]) -> str:
        """The raw value of a physical one, or of the name of one."""
        if isinstance(value, bool):
            value = int(value)
        if isinstance(value, str):
            named = [number for number, text in signal.choices.items() if text == value]
            if not named:
                where = f"the table of '{message.name}.{signal.name}' has no value {value!r}"
                raise self._error(where, keys, nearest(value, signal.choices.values()))
            return str(named[0])
        physical = self._number(value, keys)
        raw = (physical - Fraction(signal.offset)) / Fraction(signal.scale or 1)
        if not signal.is_float and raw.denominator != 1:
            below = raw.numerator // raw.denominator
            near = ((number * Fraction(signal.scale) + Fraction(signal.offset)) for number in (below, below + 1))
            raise self._error(
                f"{'.'.join(keys)} is {decimal_text(physical)}, which '{message.name}.{signal.name}' cannot be",
                keys,
                f"the nearest are {' and '.join(map(decimal_text, near))}",
            )
        return str(float(raw)) if signal.is_float else str(raw.numerator)


_Take = Callable[[Overlay, SourceMessage, Any, tuple[str, ...]], None]
_MESSAGE_KEYS: dict[str, _Take] = {
    "length": Overlay._take_length,
    "longer": Overlay._take_longer,
    "leave_out": Overlay._take_leave_out,
    "senders": Overlay._take_senders,
    "receivers": Overlay._take_receivers,
    "send": Overlay._take_send,
    "source": Overlay._take_address,
    "destination": Overlay._take_address,
    "priority": Overlay._take_address,
    "sources": Overlay._take_sources,
}


def apply_overlay(path: Path, source: Source) -> Path | None:
    """Applies the overlay of the file `path`, if there is one; returns where it is.

    Raises:
        CompileError: see Overlay.
    """
    beside = overlay_path(path)
    if not beside.exists():
        return None
    Overlay(beside, source)
    return beside
