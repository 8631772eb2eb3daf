# SPDX-License-Identifier: MIT
"""The newest value of every signal that the controller receives and sends, decoded through the DBC beside the model."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from decimal import Decimal

from cantools.database.can import Database
from cantools.database.can import Message as DbcMessage
from cantools.database.can import Signal as DbcSignal
from cantools.database.errors import DecodeError

from canopy.compiler.dbc_file import check_timing, parse_dbc
from canopy.compiler.errors import CompileError
from canopy.files import FileError, read_bytes
from canopy.model import Model, ModelError

_CYCLES_TO_TIMEOUT = 5  # a message without GenMsgTimeoutTime is stale after so many of its cycles


@dataclass(frozen=True)
class Reading:
    """One signal's newest value."""

    message: str
    signal: str
    sent: bool
    """By the controller; False: received by it."""
    value: float | str | None
    """In the signal's unit, or the name of its DBC choice; None: not seen yet."""
    unit: str
    decimals: int
    age: float | None
    """Since it was seen [s]; None: not seen yet."""
    stale: bool
    """Older than its message's timeout."""

    @property
    def text(self) -> str:
        """For people: the value with its unit, or an ellipsis where none has been seen."""
        if self.value is None:
            return "…"
        text = self.value if isinstance(self.value, str) else f"{self.value:.{self.decimals}f}"
        return f"{text} {self.unit}".rstrip()


@dataclass
class _Watched:
    """One message, and what was last seen of it."""

    message: DbcMessage
    signals: tuple[DbcSignal, ...]
    sent: bool
    timeout: float | None
    values: dict[str, float | str] | None = None
    at: float = 0.0


class SignalTable:
    """Feed it the bus's data frames; ask it for readings. Frames that cannot be decoded are counted in `refused`."""

    def __init__(self, model: Model) -> None:
        """Reads the DBC.

        Raises:
            ModelError: The DBC cannot be read, or has no message of a name that the model gives.
        """
        self.refused = 0
        self._watched: dict[int, _Watched] = {}
        database = load_database(model)
        for name in model.receive + model.send:
            try:
                message = database.get_message_by_name(name)
            except KeyError:
                raise ModelError(f"{model.path}: bus: {model.dbc.name} has no message {name}") from None
            self._watched[message.frame_id] = _watch(message, name in model.send)

    def feed(self, identifier: int, data: bytes, now: float) -> bool:
        """Takes one data frame that was seen at `now` [s]; True when it was a message of the table."""
        watched = self._watched.get(identifier)
        if watched is None:
            return False
        if len(data) != watched.message.length:
            self.refused += 1
            return False
        try:
            decoded = watched.message.decode_simple(data)
        except DecodeError:  # e.g. an unknown multiplexer value
            self.refused += 1
            return False
        watched.values = {
            signal.name: _as_written(signal, decoded[signal.name])
            for signal in watched.signals
            if signal.name in decoded
        }
        watched.at = now
        return True

    def readings(self, now: float) -> list[Reading]:
        """All signals but those of the end-to-end protection, at the time `now` [s]."""
        return [_read(watched, signal, now) for watched in self._watched.values() for signal in watched.signals]

    def value(self, message: str, signal: str) -> float | str | None:
        """The newest value of one signal; None when it was not seen yet or is not in the table."""
        for watched in self._watched.values():
            if watched.message.name == message and watched.values is not None:
                return watched.values.get(signal)
        return None


def load_database(model: Model) -> Database:
    """The DBC beside a model.

    Raises:
        ModelError: It cannot be read.
    """
    used = {*model.receive, *model.send}
    try:
        data = read_bytes(model.dbc)
    except FileError as error:
        raise ModelError(f"{model.dbc}: {error.problem}") from error
    if model.dbc_hash not in (None, hashlib.sha256(data).hexdigest()[:16]):
        raise ModelError(f"{model.dbc}: is not the DBC that {model.path.name} was written with: build again")
    try:
        dbc = parse_dbc(model.dbc, data, strict=False)
        for message in dbc.database.messages:
            if message.name in used:
                check_timing(dbc, message)
    except CompileError as error:
        raise ModelError(f"{error.place}: {error.message}") from error
    database: Database = dbc.database
    return database


def _watch(message: DbcMessage, sent: bool) -> _Watched:
    protected = message_attribute(message, "E2EDataId", -1) >= 0
    signals = tuple(s for s in message.signals if not (protected and s.name.startswith("E2E_")))
    timeout_ms = message_attribute(message, "GenMsgTimeoutTime", 0) or _CYCLES_TO_TIMEOUT * (message.cycle_time or 0)
    return _Watched(message, signals, sent, timeout_ms / 1000 if timeout_ms else None)


def message_attribute(message: DbcMessage, name: str, default: int) -> int:
    """The value of a message's attribute, or the default where neither it nor the DBC gives one."""
    attributes = message.dbc.attributes if message.dbc is not None else {}
    return int(attributes[name].value) if attributes and name in attributes else default


def _read(watched: _Watched, signal: DbcSignal, now: float) -> Reading:
    seen = watched.values is not None
    age = now - watched.at if seen else None
    return Reading(
        message=watched.message.name,
        signal=signal.name,
        sent=watched.sent,
        value=watched.values.get(signal.name) if watched.values is not None else None,
        unit=signal.unit or "",
        decimals=_decimals(signal),
        age=age,
        stale=age is not None and watched.timeout is not None and age > watched.timeout,
    )


def _as_written(signal: DbcSignal, value: object) -> float | str:
    """The value as one would write it: 49.3, not 49.300000000000004."""
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return value if signal.is_float else round(value, _decimals(signal))
    return str(value)


def _decimals(signal: DbcSignal) -> int:
    exponents = (Decimal(str(number)).normalize().as_tuple().exponent for number in (signal.scale, signal.offset))
    return max(0, *(-exponent for exponent in exponents if isinstance(exponent, int)))
