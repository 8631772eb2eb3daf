# SPDX-License-Identifier: MIT
"""The newest value of every signal that the controller receives and sends, decoded through the DBC beside the model."""

from __future__ import annotations

from dataclasses import dataclass

from canopy.bus.decode import IdTable, UndecodableError, decimals, physical, raw_values
from canopy.compiler.bus_model import Bus, Message, Signal
from canopy.compiler.bus_reader import E2E_SIGNALS, read_messages
from canopy.compiler.dbc_file import hash_of, read_bus_files
from canopy.compiler.errors import CompileError
from canopy.model import Model, ModelError


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

    message: Message
    signals: tuple[Signal, ...]
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
        bus = load_bus(model)
        by_name = {message.name: message for message in bus.messages}
        watched = [by_name[name] for name in dict.fromkeys(model.receive + model.send)]
        self._ids = IdTable(tuple(watched))
        self._watched = {message.name: _watch(message, message.name in model.send) for message in watched}

    def feed(self, identifier: int, data: bytes, now: float, *, extended: bool | None = None) -> bool:
        """Takes one data frame that was seen at `now` [s]; True when it was a message of the table.

        Without `extended` an id of more than 11 bits is an extended one, and a smaller one is tried as both.
        """
        kinds = (identifier > 0x7FF, True) if extended is None else (extended,)
        found = next((message for kind in kinds if (message := self._ids.find(identifier, kind)) is not None), None)
        if found is None:
            return False
        watched = self._watched[found.name]
        try:
            raw = raw_values(found, data)
        except UndecodableError:  # another length, or an unknown multiplexer value
            self.refused += 1
            return False
        watched.values = {
            signal.name: physical(signal, raw[signal.name]) for signal in watched.signals if signal.name in raw
        }
        watched.at = now
        return True

    def readings(self, now: float) -> list[Reading]:
        """All signals but those of the end-to-end protection, at the time `now` [s]."""
        return [_read(watched, signal, now) for watched in self._watched.values() for signal in watched.signals]

    def value(self, message: str, signal: str) -> float | str | None:
        """The newest value of one signal; None when it was not seen yet or is not in the table."""
        watched = self._watched.get(message)
        return None if watched is None or watched.values is None else watched.values.get(signal)


def load_bus(model: Model) -> Bus:
    """The controller's messages, by the bus description beside its model, overlay included.

    Raises:
        ModelError: It cannot be read, is another one than the model was made with, or lacks a message.
    """
    try:
        if model.dbc_hash not in (None, hash_of(read_bus_files(model.dbc))):
            raise ModelError(
                f"{model.dbc}: it, or its overlay, is not what {model.path.name} was written with: build again"
            )
        return read_messages(model.dbc, only=tuple({*model.receive, *model.send}))
    except CompileError as error:
        raise ModelError(f"{error.place}: {error.message}") from error


def _watch(message: Message, sent: bool) -> _Watched:
    protected = message.data_id is not None
    signals = tuple(s for s in message.signals if not (protected and s.name in E2E_SIGNALS))
    return _Watched(message, signals, sent, message.timeout_us / 1e6 if message.timeout_us else None)


def _read(watched: _Watched, signal: Signal, now: float) -> Reading:
    seen = watched.values is not None
    age = now - watched.at if seen else None
    return Reading(
        message=watched.message.name,
        signal=signal.name,
        sent=watched.sent,
        value=watched.values.get(signal.name) if watched.values is not None else None,
        unit=signal.unit,
        decimals=decimals(signal),
        age=age,
        stale=age is not None and watched.timeout is not None and age > watched.timeout,
    )
