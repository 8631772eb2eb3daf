# SPDX-License-Identifier: MIT
"""A DBC as one of its nodes sees it: what it receives, what it sends, and the trace messages of Canopy.

Attributes that are read (docs/dbc.md): GenMsgCycleTime, GenMsgTimeoutTime, E2EDataId of messages, GenSigInactiveValue of
signals.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import cantools
import cantools.database.can

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.names import snake

E2E_SIGNALS = {"E2E_CRC": (0, 8), "E2E_Counter": (8, 4)}

# Layout of the trace's messages: signal -> (start bit, length), all little-endian and unsigned. The runtime's trace.c
# writes these bits; the DBC must say the same, so that other tools read them right.
TRACE_LAYOUT: dict[str, dict[str, tuple[int, int]]] = {
    "CanopyTick": {
        "Sequence": (0, 8),
        "Tick": (8, 32),
        "RootStatus": (40, 4),
        "Tree": (44, 4),
        "Changes": (48, 8),
        "Overruns": (56, 8),
    },
    "CanopyChange": {
        "Sequence": (0, 8),
        "NodeA": (8, 16),
        "NodeB": (24, 16),
        "StatusA": (40, 4),
        "StatusB": (44, 4),
        "Tree": (48, 4),
    },
    "CanopySnapshot": {
        "Sequence": (0, 8),
        "First": (8, 16),
        **{f"Status{place}": (24 + 4 * place, 4) for place in range(10)},
    },
    "CanopyHealth": {"RxRejected": (0, 16), "RxUnknown": (16, 16), "TxDropped": (32, 16), "Faults": (48, 16)},
}


@dataclass(frozen=True)
class Signal:
    """A signal, in raw units: physical value = raw * scale + offset. `low` and `high` are the raw range allowed."""

    name: str
    start: int
    length: int
    little_endian: bool
    signed: bool
    scale: Decimal
    offset: Decimal
    low: int
    high: int
    safe: int
    unit: str
    comment: str
    choices: tuple[tuple[int, str], ...]

    @property
    def c_name(self) -> str:
        """The member's name in the image."""
        return snake(self.name)

    @property
    def is_bool(self) -> bool:
        """One bit without a value table is a bool."""
        return self.length == 1 and not self.signed and not self.choices and self.scale == 1 and self.offset == 0

    @property
    def c_type(self) -> str:
        """The smallest C type that holds every raw value of the signal's bits."""
        if self.is_bool:
            return "bool"
        bits = next(size for size in (8, 16, 32, 64) if self.length <= size)
        return f"{'' if self.signed else 'u'}int{bits}_t"

    @property
    def limits(self) -> tuple[int, int]:
        """Smallest and largest raw value that the signal's bits can hold."""
        if self.signed:
            return -(2 ** (self.length - 1)), 2 ** (self.length - 1) - 1
        return 0, 2**self.length - 1


@dataclass(frozen=True)
class Message:
    """A message. `signals` are those that the application sees, without the E2E header. Times in ms; 0: none."""

    name: str
    id: int
    extended: bool
    fd: bool
    length: int
    cycle_ms: int
    timeout_ms: int
    data_id: int | None
    signals: tuple[Signal, ...]
    comment: str

    @property
    def c_name(self) -> str:
        """Stem of the message's C names."""
        return snake(self.name)


@dataclass(frozen=True)
class Bus:
    """The bus as `node` sees it. `load` lists (frame length, extended, fd, cycle ms) of every cyclic message on it."""

    path: Path
    name: str
    node: str
    receive: tuple[Message, ...]
    send: tuple[Message, ...]
    trace: dict[str, Message]
    load: tuple[tuple[int, bool, bool, int], ...]


def _attribute(database: Any, owner: Any, name: str, default: int | None) -> int | None:
    """An integer attribute: given on the object, else the DBC's default for it, else `default`."""
    given = owner.dbc.attributes.get(name) if owner.dbc is not None else None
    if given is not None:
        return int(given.value)
    definition = database.dbc.attribute_definitions.get(name)
    if definition is not None and definition.default_value is not None:
        return int(definition.default_value)
    return default


def _raw(physical: Any, scale: Decimal, offset: Decimal) -> int:
    return int(((Decimal(str(physical)) - offset) / scale).to_integral_value())


def _read_signal(database: Any, place: Place, message: Any, signal: Any) -> Signal:
    where = f"signal '{message.name}.{signal.name}'"
    if signal.is_float:
        raise CompileError(place, f"{where} is a float; floats are not supported", "use a scaled integer")
    if signal.is_multiplexer or signal.multiplexer_ids:
        raise CompileError(place, f"{where} is multiplexed; multiplexing is not supported", "use separate messages")
    scale, offset = Decimal(str(signal.scale)), Decimal(str(signal.offset))
    choices = tuple(sorted((int(value), str(text)) for value, text in (signal.choices or {}).items()))
    result = Signal(
        name=signal.name,
        start=signal.start,
        length=signal.length,
        little_endian=signal.byte_order == "little_endian",
        signed=signal.is_signed,
        scale=scale,
        offset=offset,
        low=0,
        high=0,
        safe=_attribute(database, signal, "GenSigInactiveValue", None) or 0,
        unit=signal.unit or "",
        comment=str(signal.comment or ""),
        choices=choices,
    )
    low, high = result.limits
    if signal.minimum is not None and signal.maximum is not None and signal.minimum < signal.maximum:
        ends = sorted((_raw(signal.minimum, scale, offset), _raw(signal.maximum, scale, offset)))
        low, high = max(low, ends[0]), min(high, ends[1])
    return Signal(**{**result.__dict__, "low": low, "high": high})


def _check_e2e(place: Place, message: Any) -> None:
    for name, (start, length) in E2E_SIGNALS.items():
        signal = next((s for s in message.signals if s.name == name), None)
        if signal is None or (signal.start, signal.length, signal.byte_order) != (start, length, "little_endian"):
            raise CompileError(
                place,
                f"message '{message.name}' has an E2EDataId, so it needs the signal {name} at {start}|{length}@1+",
                "E2E Profile 11 has its CRC in byte 0 and its counter in the low half of byte 1",
            )


def _read_message(database: Any, place: Place, message: Any) -> Message:
    data_id = _attribute(database, message, "E2EDataId", -1)
    protected = data_id is not None and data_id >= 0
    if protected:
        _check_e2e(place, message)
    cycle = _attribute(database, message, "GenMsgCycleTime", 0) or 0
    timeout = _attribute(database, message, "GenMsgTimeoutTime", 0) or 5 * cycle
    seen = [signal for signal in message.signals if not (protected and signal.name in E2E_SIGNALS)]
    return Message(
        name=message.name,
        id=message.frame_id,
        extended=message.is_extended_frame,
        fd=message.is_fd,
        length=message.length,
        cycle_ms=cycle,
        timeout_ms=timeout,
        data_id=data_id if protected else None,
        signals=tuple(_read_signal(database, place, message, signal) for signal in seen),
        comment=str(message.comment or ""),
    )


def _check_outputs(place: Place, database: Any, messages: tuple[Message, ...], period_ms: int) -> None:
    for message in messages:
        if message.cycle_ms == 0 or message.cycle_ms % period_ms:
            raise CompileError(
                place,
                f"message '{message.name}' is sent every {message.cycle_ms} ms, which is no multiple of the period",
                f"set GenMsgCycleTime to a multiple of {period_ms} (ms), or change the period",
            )
        for signal in message.signals:
            owner = database.get_message_by_name(message.name).get_signal_by_name(signal.name)
            if _attribute(database, owner, "GenSigInactiveValue", None) is None:
                raise CompileError(
                    place,
                    f"output '{message.name}.{signal.name}' has no safe value",
                    f"add BA_ \"GenSigInactiveValue\" SG_ {message.id} {signal.name} VALUE; to the DBC",
                )
            if not signal.low <= signal.safe <= signal.high:
                raise CompileError(
                    place,
                    f"the safe value {signal.safe} of output '{message.name}.{signal.name}' is outside its range "
                    f"[{signal.low}, {signal.high}] (raw)",
                )


def _check_trace(place: Place, message: Any) -> None:
    layout = {s.name: (s.start, s.length) for s in message.signals if s.byte_order == "little_endian"}
    wanted = TRACE_LAYOUT[message.name]
    if message.length != 8 or layout != wanted or any(s.is_signed for s in message.signals):
        rows = ", ".join(f"{name} {start}|{length}@1+" for name, (start, length) in wanted.items())
        raise CompileError(place, f"message '{message.name}' must have 8 bytes and these signals: {rows}")


def _check_names(place: Place, messages: tuple[Message, ...]) -> None:
    for names in ([m.c_name for m in messages], *([s.c_name for s in m.signals] for m in messages)):
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise CompileError(place, f"two names become the same C name: {', '.join(sorted(twice))}")


def read_bus(path: Path, node: str, period_ms: int) -> Bus:
    """The bus of a DBC as `node` sees it, for a controller that ticks every `period_ms`.

    Raises:
        CompileError: the file cannot be read, has no such node, or has something that cannot be compiled.
    """
    place = Place(str(path))
    try:
        database = cantools.database.load_file(str(path), database_format="dbc", strict=True)
    except OSError as error:
        raise CompileError(place, f"cannot be read: {error.strerror}") from error
    except (cantools.database.Error, ValueError, KeyError) as error:
        raise CompileError(place, f"not a DBC that can be read: {error}") from error
    if not isinstance(database, cantools.database.can.Database):
        raise CompileError(place, "not a CAN database")
    nodes = [known.name for known in database.nodes]
    if node not in nodes:
        raise CompileError(place, f"no node '{node}'", nearest(node, nodes))
    trace: dict[str, Message] = {}
    receive: list[Message] = []
    send: list[Message] = []
    for message in sorted(database.messages, key=lambda m: (m.is_extended_frame, m.frame_id)):
        sent = node in message.senders
        if message.name in TRACE_LAYOUT and sent:
            _check_trace(place, message)
            trace[message.name] = _read_message(database, place, message)
        elif sent:
            send.append(_read_message(database, place, message))
        elif any(node in signal.receivers for signal in message.signals):
            receive.append(_read_message(database, place, message))
    bus = Bus(
        path=path,
        name=snake(path.stem),
        node=node,
        receive=tuple(receive),
        send=tuple(send),
        trace=trace,
        load=tuple(
            (m.length, m.is_extended_frame, m.is_fd, _attribute(database, m, "GenMsgCycleTime", 0) or 0)
            for m in database.messages
        ),
    )
    _check_outputs(place, database, bus.send, period_ms)
    _check_names(place, bus.receive + bus.send)
    return bus
