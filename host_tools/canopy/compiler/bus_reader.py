# SPDX-License-Identifier: MIT
"""A DBC as one of its nodes sees it: what it receives, what it sends, and the trace messages of Canopy; or all of it.

Attributes that are read (docs/dbc.md): GenMsgCycleTime, GenMsgTimeoutTime, E2EDataId of messages, GenSigInactiveValue
of signals.
"""

from __future__ import annotations

import dataclasses
import logging
import re
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import cantools
import cantools.database.can
from cantools.database.errors import Error as DatabaseError

from canopy.compiler.bus_model import (
    FD_LENGTHS,
    Bus,
    Message,
    Ranges,
    Selector,
    Signal,
    cut,
    float_bits,
    float_value,
    merge,
)
from canopy.compiler.bus_names import name_messages
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.names import snake
from canopy.compiler.trace_layout import TRACE_LAYOUT, check_trace, trace_kind

__all__ = ["TRACE_LAYOUT", "Bus", "Message", "Signal", "read_bus", "read_messages"]

E2E_SIGNALS = {"E2E_CRC": (0, 8), "E2E_Counter": (8, 4)}


def _given(database: Any, owner: Any, name: str) -> Any:
    """An attribute's value: given on the object, else the DBC's default for it, else None."""
    given = owner.dbc.attributes.get(name) if owner.dbc is not None else None
    if given is not None:
        return given.value
    definition = database.dbc.attribute_definitions.get(name)
    return definition.default_value if definition is not None else None


def _number(database: Any, place: Place, owner: Any, name: str) -> Decimal | None:
    """An attribute that is a number."""
    value = _given(database, owner, name)
    try:
        return None if value is None or value == "" else Decimal(str(value))
    except InvalidOperation:
        raise CompileError(place, f"attribute {name} of '{owner.name}' is {value!r}, and must be a number") from None


def _attribute(database: Any, place: Place, owner: Any, name: str, default: int) -> int:
    """An attribute that is a whole number."""
    value = _number(database, place, owner, name)
    return default if value is None else int(value)


def _raw(physical: Any, scale: Decimal, offset: Decimal) -> Decimal:
    return (Decimal(str(physical)) - offset) / scale


def _ids(signal: Any) -> Ranges:
    return merge((int(value), int(value)) for value in signal.multiplexer_ids)


def _selectors(place: Place, where: str, message: Any, signal: Any) -> tuple[Selector, ...]:
    """What has to hold for the signal to be in a frame."""
    result: list[Selector] = []
    seen = {signal.name}
    while signal.multiplexer_ids:
        owners = [other for other in message.signals if other.name == signal.multiplexer_signal]
        if not owners or owners[0].name in seen:
            raise CompileError(
                place,
                f"{where} is multiplexed, but it is not clear by which multiplexer",
                f"add SG_MUL_VAL_ {_dbc_id(message)} {signal.name} MULTIPLEXER RANGES; to the DBC",
            )
        result.insert(0, Selector(owners[0].name, _ids(signal)))
        signal = owners[0]
        seen.add(signal.name)
    return tuple(result)


def _selects(place: Place, where: str, message: Any, signal: Any) -> Ranges:
    """The values that a multiplexer may have: those of its branches, and those that its value table names."""
    branches = {
        other.name: _ids(other)
        for other in message.signals
        if other.multiplexer_ids and other.multiplexer_signal == signal.name
    }
    if not branches:
        return ()
    if signal.is_float:
        raise CompileError(place, f"{where} is a multiplexer and a float", "make it an unsigned integer")
    bits = signal.length - 1 if signal.is_signed else signal.length
    for name, values in branches.items():
        if values[-1][1] >= 2**bits:
            raise CompileError(
                place,
                f"'{message.name}.{name}' is in branch {values[-1][1]}, a value that {where} of {signal.length} bits"
                f"{', signed,' if signal.is_signed else ''} cannot have",
                "make the multiplexer unsigned (@1+) and wide enough",
            )
    named = [(int(value), int(value)) for value in (signal.choices or {})]
    low = -(2 ** (signal.length - 1)) if signal.is_signed else 0
    return cut(merge([*(r for values in branches.values() for r in values), *named]), low, 2**bits - 1)


def _range(place: Place, where: str, signal: Any, limits: tuple[int, int]) -> tuple[int, int]:
    """[minimum, maximum] of the DBC in raw units, each rounded to the nearest; all of the bits when it says none."""
    scale, offset = Decimal(str(signal.scale)), Decimal(str(signal.offset))
    if signal.minimum is None or signal.maximum is None or not signal.minimum < signal.maximum:
        return limits
    ends = sorted(_raw(end, scale, offset) for end in (signal.minimum, signal.maximum))
    if signal.is_float:
        return float_bits(float(ends[0]), signal.length), float_bits(float(ends[1]), signal.length)
    low, high = (int(end.to_integral_value()) for end in ends)
    if low > limits[1] or high < limits[0]:
        raise CompileError(
            place,
            f"no value of {where} is in its range [{signal.minimum}, {signal.maximum}]: its {signal.length} bits hold "
            f"{limits[0]}..{limits[1]} (raw), that is {limits[0] * scale + offset}..{limits[1] * scale + offset}",
            "correct the range, or write [0|0] for none",
        )
    return max(low, limits[0]), min(high, limits[1])


def _check_size(place: Place, where: str, signal: Any) -> None:
    if signal.is_float and signal.length not in (32, 64):
        raise CompileError(place, f"{where} is a float of {signal.length} bits", "SIG_VALTYPE_ goes with 32 or 64 bits")
    if signal.length > 64:
        raise CompileError(place, f"{where} has {signal.length} bits; at most 64 are possible", "split the signal")
    if signal.scale == 0:
        raise CompileError(place, f"{where} has the scale 0, so all its values are the same", "set its scale, or 1")


def _read_signal(database: Any, place: Place, message: Any, signal: Any) -> Signal:
    where = f"signal '{message.name}.{signal.name}'"
    _check_size(place, where, signal)
    if signal.is_float:
        limits = float_bits(float("-inf"), signal.length), float_bits(float("inf"), signal.length)
    elif signal.is_signed:
        limits = -(2 ** (signal.length - 1)), 2 ** (signal.length - 1) - 1
    else:
        limits = 0, 2**signal.length - 1
    low, high = _range(place, where, signal, limits)
    result = Signal(
        name=signal.name,
        c_name=snake(signal.name),
        start=signal.start,
        length=signal.length,
        little_endian=signal.byte_order == "little_endian",
        signed=signal.is_signed and not signal.is_float,
        is_float=signal.is_float,
        scale=Decimal(str(signal.scale)),
        offset=Decimal(str(signal.offset)),
        low=low,
        high=high,
        safe=0,
        unit=signal.unit or "",
        comment=str(signal.comment or ""),
        choices=tuple(sorted((int(value), str(text)) for value, text in (signal.choices or {}).items())),
        selectors=_selectors(place, where, message, signal),
        selects=_selects(place, where, message, signal),
    )
    return Signal(**{**result.__dict__, "safe": _safe(database, place, result, signal)})


def _safe(database: Any, place: Place, signal: Signal, given: Any) -> int:
    """GenSigInactiveValue; where there is none, of all that may be sent, what is nearest to 0."""
    value = _number(database, place, given, "GenSigInactiveValue")
    if signal.is_float:
        bits = float_bits(float(value or 0), signal.length)
        return bits if value is not None else _nearest_allowed(signal, bits)
    return int(value) if value is not None else _nearest_allowed(signal, 0)


def _nearest_allowed(signal: Signal, raw: int) -> int:
    if signal.is_float:
        low, high, value = (float_value(bits, signal.length) for bits in (signal.low, signal.high, raw))
        return float_bits(max(low, min(high, value)), signal.length)
    ends = (max(low, min(high, raw)) for low, high in signal.sendable or signal.accepted)
    return min(ends, key=lambda end: abs(end - raw))


def _check_e2e(place: Place, message: Any, data_id: int) -> None:
    if data_id > 0xFFFF:
        raise CompileError(place, f"the E2EDataId {data_id} of message '{message.name}' is more than 65535")
    for name, (start, length) in E2E_SIGNALS.items():
        signal = next((s for s in message.signals if s.name == name), None)
        if signal is None or (signal.start, signal.length, signal.byte_order) != (start, length, "little_endian"):
            raise CompileError(
                place,
                f"message '{message.name}' has an E2EDataId, so it needs the signal {name} at {start}|{length}@1+",
                "E2E Profile 11 has its CRC in byte 0 and its counter in the low half of byte 1",
            )


def _dbc_id(message: Any) -> int:
    """The id as the DBC writes it."""
    return int(message.frame_id | (0x80000000 if message.is_extended_frame else 0))


def _wire_length(message: Any) -> int:
    """A CAN FD frame has one of few lengths."""
    length = int(message.length)
    return min((known for known in FD_LENGTHS if known >= length), default=length) if message.is_fd else length


def _read_message(database: Any, place: Place, message: Any, *, hide_e2e: bool = True) -> Message:
    data_id = _attribute(database, place, message, "E2EDataId", -1)
    protected = data_id >= 0
    if protected and hide_e2e:
        _check_e2e(place, message, data_id)
    cycle = _attribute(database, place, message, "GenMsgCycleTime", 0)
    timeout = _attribute(database, place, message, "GenMsgTimeoutTime", 0) or 5 * cycle
    seen = [signal for signal in message.signals if not (protected and hide_e2e and signal.name in E2E_SIGNALS)]
    signals = [_read_signal(database, place, message, signal) for signal in seen]
    return Message(
        name=message.name,
        c_name=snake(message.name),
        id=message.frame_id,
        extended=message.is_extended_frame,
        fd=message.is_fd,
        length=_wire_length(message),
        cycle_ms=cycle,
        timeout_ms=timeout,
        data_id=data_id if protected else None,
        # A multiplexer before the signals that it selects.
        signals=tuple(sorted(signals, key=lambda signal: len(signal.selectors))),
        comment=str(message.comment or ""),
    )


def _check_frame(place: Place, message: Message) -> None:
    """Can it be one frame?"""
    most = 64 if message.fd else 8
    if message.length > most:
        raise CompileError(
            place,
            f"message '{message.name}' has {message.length} bytes, and a{' CAN FD' if message.fd else ''} frame at "
            f"most {most}",
            "" if message.fd else "for CAN FD give it the attribute VFrameFormat StandardCAN_FD or ExtendedCAN_FD",
        )


def _check_outputs(place: Place, database: Any, messages: tuple[Message, ...], period_ms: int) -> None:
    for message in messages:
        if message.cycle_ms == 0 or message.cycle_ms % period_ms:
            raise CompileError(
                place,
                f"message '{message.name}' is sent every {message.cycle_ms} ms, which is no multiple of the period",
                f"set GenMsgCycleTime to a multiple of {period_ms} (ms), or change the period",
            )
        owner = database.get_message_by_name(message.name)
        for signal in message.signals:
            if _number(database, place, owner.get_signal_by_name(signal.name), "GenSigInactiveValue") is None:
                raise CompileError(
                    place,
                    f"output '{message.name}.{signal.name}' has no safe value",
                    f'add BA_ "GenSigInactiveValue" SG_ {_dbc_id(owner)} {signal.name} VALUE; to the DBC',
                )
            _check_safe(place, message, signal)


def _is_safe(signal: Signal) -> bool:
    """Is the safe value one that may be sent?"""
    if signal.is_float:
        low, high, safe = (float_value(bits, signal.length) for bits in (signal.low, signal.high, signal.safe))
        return low <= safe <= high
    return any(low <= signal.safe <= high for low, high in signal.accepted)


def _check_safe(place: Place, message: Message, signal: Signal) -> None:
    if _is_safe(signal):
        return
    if signal.is_float:
        safe, *ends = (f"{float_value(bits, signal.length):g}" for bits in (signal.safe, signal.low, signal.high))
        allowed = "..".join(ends)
    else:
        safe = str(signal.safe)
        allowed = ", ".join(f"{low}..{high}" if low < high else f"{low}" for low, high in signal.accepted)
    raise CompileError(
        place, f"the safe value {safe} of output '{message.name}.{signal.name}' is outside its range: {allowed} (raw)"
    )


def _with_good_safe_values(message: Message) -> Message:
    """Where nobody has asked for safe values, a default of the DBC may not fit: then what is nearest to it does."""
    signals = tuple(
        signal if _is_safe(signal) else dataclasses.replace(signal, safe=_nearest_allowed(signal, signal.safe))
        for signal in message.signals
    )
    return dataclasses.replace(message, signals=signals)


MAX_BYTES = 16 * 1024 * 1024
MAX_MESSAGE_BYTES = 1785  # of J1939's transport protocol
_MESSAGE_LENGTH = re.compile(r"\s*BO_\s+\d+\s+(\w+)\s*:\s*(\d+)")


def _load(path: Path) -> Any:
    place = Place(str(path))
    try:
        if path.stat().st_size > MAX_BYTES:
            raise CompileError(place, f"the file has {path.stat().st_size} bytes; at most {MAX_BYTES} are read")
        _check_lengths(path)
        logging.getLogger("cantools").setLevel(logging.ERROR)  # what it warns of is refused below
        database = cantools.database.load_file(str(path), database_format="dbc", strict=True)
    except OSError as error:
        raise CompileError(place, f"cannot be read: {error.strerror}") from error
    except (DatabaseError, ValueError, KeyError, ArithmeticError) as error:
        raise CompileError(place, f"not a DBC that can be read: {error}") from error
    if not isinstance(database, cantools.database.can.Database):
        raise CompileError(place, "not a CAN database")
    _check_unique(place, database)
    return database


def _check_lengths(path: Path) -> None:
    """Refuses messages longer than any protocol's: cantools takes memory and time for each bit of them."""
    for number, line in enumerate(path.read_text(encoding="cp1252", errors="replace").splitlines(), 1):
        found = _MESSAGE_LENGTH.match(line)
        if found is not None and (len(found[2]) > 4 or int(found[2]) > MAX_MESSAGE_BYTES):
            raise CompileError(
                Place(str(path), number),
                f"message '{found[1]}' is longer than {MAX_MESSAGE_BYTES} bytes",
                "CAN FD has 64",
            )


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


def _by_id(database: Any) -> list[Any]:
    return sorted(database.messages, key=lambda message: (message.is_extended_frame, message.frame_id))


def _check_node(place: Place, database: Any, node: str) -> None:
    nodes = [known.name for known in database.nodes]
    if node not in nodes:
        raise CompileError(place, f"no node '{node}'", nearest(node, nodes))


def _make_bus(
    path: Path,
    database: Any,
    node: str,
    receive: list[Message],
    send: list[Message],
    trace: dict[str, Message],
    name: str | None = None,
) -> Bus:
    """The bus, with C names, each its own."""
    place = Place(str(path))
    known = {message.name: message for message in (*receive, *send)}
    named = {message.name: message for message in name_messages(tuple(known.values()))}
    return Bus(
        path=path,
        name=name or snake(path.stem),
        node=node,
        receive=tuple(named[message.name] for message in receive),
        send=tuple(named[message.name] for message in send),
        trace=trace,
        load=tuple(
            (_wire_length(m), m.is_extended_frame, m.is_fd, _attribute(database, place, m, "GenMsgCycleTime", 0))
            for m in database.messages
        ),
    )


def read_bus(path: Path, node: str, period_ms: int, name: str | None = None) -> Bus:
    """The bus of a DBC as `node` sees it, for a controller that ticks every `period_ms`.

    `name` is what its C names begin with: the application's, for its tables hold counts of its ticks. Else the file's.

    Raises:
        CompileError: the file cannot be read, has no such node, or has something that cannot be compiled.
    """
    place = Place(str(path))
    database = _load(path)
    _check_node(place, database, node)
    trace: dict[str, Message] = {}
    receive: list[Message] = []
    send: list[Message] = []
    for message in _by_id(database):
        sent = node in message.senders
        kind = trace_kind(message.name) if sent else None
        if kind is not None:
            check_trace(place, message, kind)
            if kind in trace:
                raise CompileError(
                    place,
                    f"node '{node}' sends both '{trace[kind].name}' and '{message.name}', and one {kind} is enough",
                    "give each node that runs a tree its own",
                )
            trace[kind] = _read_message(database, place, message)
        elif sent:
            send.append(_read_message(database, place, message))
        elif any(node in signal.receivers for signal in message.signals):
            receive.append(_read_message(database, place, message))
    for message in receive + send:
        _check_frame(place, message)
    bus = _make_bus(path, database, node, receive, send, trace, name)
    _check_outputs(place, database, bus.send, period_ms)
    return bus


def read_messages(path: Path, node: str = "", only: tuple[str, ...] = ()) -> Bus:
    """The messages of a DBC for a codec alone: all, or what `node` receives and sends, or those named in `only`.

    Signals of the end-to-end protection are signals as all others here; cycle times and safe values are not asked for.

    Raises:
        CompileError: the file cannot be read, has no such node or message, or has something that cannot be compiled.
    """
    place = Place(str(path))
    database = _load(path)
    if node:
        _check_node(place, database, node)
    names = [message.name for message in database.messages]
    for name in only:
        if name not in names:
            raise CompileError(place, f"no message '{name}'", nearest(name, names))
    receive: list[Message] = []
    send: list[Message] = []
    for message in _by_id(database):
        sent = not node or node in message.senders
        received = not node or any(node in signal.receivers for signal in message.signals)
        if (sent or received) and (not only or message.name in only):
            read = _with_good_safe_values(_read_message(database, place, message, hide_e2e=False))
            if received:
                receive.append(read)
            if sent:
                send.append(read)
    return _make_bus(path, database, node, receive, send, {})
