# SPDX-License-Identifier: MIT
"""A DBC as one of its nodes sees it: what it receives and what it sends; or all of it.

Attributes that are read (docs/dbc.md): GenMsgCycleTime, GenMsgTimeoutTime, E2EDataId of messages, GenSigInactiveValue
of signals.
"""

from __future__ import annotations

import dataclasses
from decimal import Decimal
from pathlib import Path
from typing import Any

from canopy.compiler.bus_model import FD_LENGTHS, Bus, Message, Signal, float_value
from canopy.compiler.bus_names import name_messages
from canopy.compiler.dbc_file import Dbc, attribute, check_node, load_dbc, number
from canopy.compiler.dbc_text import dbc_id
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.limits import DATA_ID, EVERY, TIME_MS, count, whole
from canopy.compiler.names import snake
from canopy.compiler.signal_reader import is_safe, nearest_allowed, read_signal
from canopy.compiler.trace_layout import MESSAGES as TRACE_MESSAGES

__all__ = ["Bus", "Message", "Signal", "read_bus", "read_messages"]

E2E_SIGNALS = {"E2E_CRC": (0, 8), "E2E_Counter": (8, 4)}


def _check_e2e(place: Place, message: Any) -> None:
    for name, (start, length) in E2E_SIGNALS.items():
        signal = next((s for s in message.signals if s.name == name), None)
        if signal is None or (signal.start, signal.length, signal.byte_order) != (start, length, "little_endian"):
            raise CompileError(
                place,
                f"message '{message.name}' has an E2EDataId, so it needs the signal {name} at {start}|{length}@1+",
                "E2E Profile 11 has its CRC in byte 0 and its counter in the low half of byte 1",
            )


def _wire_length(message: Any) -> int:
    """A CAN FD frame has one of few lengths."""
    length = int(message.length)
    return min((known for known in FD_LENGTHS if known >= length), default=length) if message.is_fd else length


def _cycle_ms(dbc: Dbc, message: Any, *, for_codec: bool) -> int:
    if for_codec:  # it only tells the user: there is no constant for what is no whole number
        value = number(dbc, "GenMsgCycleTime", message)
        if value is not None and value % 1:
            return 0
    return attribute(dbc, "GenMsgCycleTime", TIME_MS, message) or 0


def _read_message(dbc: Dbc, message: Any, *, for_codec: bool = False) -> Message:
    data_id = attribute(dbc, "E2EDataId", DATA_ID, message)
    hide_e2e = data_id is not None and data_id >= 0 and not for_codec
    if hide_e2e:
        _check_e2e(dbc.text.message(message), message)
    cycle = _cycle_ms(dbc, message, for_codec=for_codec)
    timeout = None if for_codec else attribute(dbc, "GenMsgTimeoutTime", TIME_MS, message)
    seen = [signal for signal in message.signals if not (hide_e2e and signal.name in E2E_SIGNALS)]
    signals = [read_signal(dbc, message, signal) for signal in seen]
    return Message(
        name=message.name,
        c_name=snake(message.name),
        id=message.frame_id,
        extended=message.is_extended_frame,
        fd=message.is_fd,
        length=_wire_length(message),
        cycle_ms=cycle,
        timeout_ms=timeout or 5 * cycle,
        data_id=data_id if data_id is not None and data_id >= 0 else None,
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


def _check_outputs(dbc: Dbc, messages: tuple[Message, ...], period_ms: int) -> None:
    for message in messages:
        owner = dbc.database.get_message_by_name(message.name)
        place = dbc.text.attribute("GenMsgCycleTime", owner)
        if message.cycle_ms == 0 or message.cycle_ms % period_ms:
            raise CompileError(
                place,
                f"message '{message.name}' is sent every {message.cycle_ms} ms, which is no multiple of the period",
                f"set GenMsgCycleTime to a multiple of {period_ms} (ms), or change the period",
            )
        _check_every(place, message, period_ms)
        for signal in message.signals:
            written = owner.get_signal_by_name(signal.name)
            if number(dbc, "GenSigInactiveValue", owner, written) is None:
                raise CompileError(
                    dbc.text.signal(owner, written),
                    f"output '{message.name}.{signal.name}' has no safe value",
                    f'add BA_ "GenSigInactiveValue" SG_ {dbc_id(owner)} {signal.name} VALUE; to the DBC',
                )
            _check_safe(dbc.text.attribute("GenSigInactiveValue", owner, written), message, signal)


def _check_every(place: Place, message: Message, period_ms: int) -> None:
    """A longer one would become another number of ticks in C, 0 among them."""
    whole(
        max(1, message.cycle_ms // period_ms),
        EVERY,
        f"GenMsgCycleTime of message '{message.name}', {message.cycle_ms} ms in ticks of {period_ms} ms,",
        place,
        f"at most {EVERY.high * period_ms} ms with this period",
    )


def _check_no_trace(dbc: Dbc, message: Any, node: str) -> None:
    """Until version 2 of the trace its messages stood in the DBC."""
    if message.name.partition("_")[0] in (*TRACE_MESSAGES, "CanopyArrivals"):
        raise CompileError(
            dbc.text.message(message),
            f"node '{node}' sends '{message.name}', and the trace's messages are made by the compiler",
            "take the Canopy messages out of the DBC, and give --trace 0x600 (in CMake: TRACE 0x600), or another id "
            "that begins eight free ones",
        )


def _check_safe(place: Place, message: Message, signal: Signal) -> None:
    if is_safe(signal):
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
        signal if is_safe(signal) else dataclasses.replace(signal, safe=nearest_allowed(signal, signal.safe))
        for signal in message.signals
    )
    return dataclasses.replace(message, signals=signals)


def _load(dbc: Dbc) -> tuple[tuple[int, bool, bool, float], ...]:
    """The cyclic messages of every node, for the bus load. Of these a fraction of a millisecond does no harm."""
    result = []
    for message in dbc.database.messages:
        cycle = number(dbc, "GenMsgCycleTime", message) or Decimal(0)
        if cycle % 1 == 0 or not 0 < cycle < TIME_MS.high:
            cycle = Decimal(attribute(dbc, "GenMsgCycleTime", TIME_MS, message) or 0)
        result.append((_wire_length(message), message.is_extended_frame, message.is_fd, float(cycle)))
    return tuple(result)


def _by_id(database: Any) -> list[Any]:
    return sorted(database.messages, key=lambda message: (message.is_extended_frame, message.frame_id))


def _make_bus(
    path: Path,
    dbc: Dbc,
    node: str,
    receive: list[Message],
    send: list[Message],
    name: str | None = None,
) -> Bus:
    """The bus, with C names, each its own."""
    for what, messages in (("receives", receive), ("sends", send)):
        count(messages, f"messages that node '{node}' {what}", Place(str(path)))
    known = {message.name: message for message in (*receive, *send)}
    named = {message.name: message for message in name_messages(tuple(known.values()))}
    return Bus(
        path=path,
        name=name or snake(path.stem),
        node=node,
        receive=tuple(named[message.name] for message in receive),
        send=tuple(named[message.name] for message in send),
        source=dbc,
    )


def read_bus(path: Path, node: str, period_ms: int, name: str | None = None) -> Bus:
    """The bus of a DBC as `node` sees it, for a controller that ticks every `period_ms`.

    `name` is what its C names begin with: the application's, for its tables hold counts of its ticks. Else the file's.

    Raises:
        CompileError: the file cannot be read, has no such node, or has something that cannot be compiled.
    """
    place = Place(str(path))
    dbc = load_dbc(path)
    check_node(place, dbc.database, node)
    receive: list[Message] = []
    send: list[Message] = []
    for message in _by_id(dbc.database):
        if node in message.senders:
            _check_no_trace(dbc, message, node)
            send.append(_read_message(dbc, message))
        elif any(node in signal.receivers for signal in message.signals):
            receive.append(_read_message(dbc, message))
    for message in receive + send:
        _check_frame(dbc.text.message(dbc.database.get_message_by_name(message.name)), message)
    buffers = sum(2 * message.length for message in send)  # places in them: canopy_tx_message_t.place
    count(buffers, f"bytes of two buffers for each message that node '{node}' sends", place)
    bus = dataclasses.replace(_make_bus(path, dbc, node, receive, send, name), load=_load(dbc))
    _check_outputs(dbc, bus.send, period_ms)
    return bus


def read_messages(path: Path, node: str = "", only: tuple[str, ...] = ()) -> Bus:
    """The messages of a DBC for a codec alone: all, or what `node` receives and sends, or those named in `only`.

    Signals of the end-to-end protection are signals as all others here; cycle times and safe values are not asked for.

    Raises:
        CompileError: the file cannot be read, has no such node or message, or has something that cannot be compiled.
    """
    place = Place(str(path))
    dbc = load_dbc(path)
    if node:
        check_node(place, dbc.database, node)
    names = [message.name for message in dbc.database.messages]
    for name in only:
        if name not in names:
            raise CompileError(place, f"no message '{name}'", nearest(name, names))
    receive: list[Message] = []
    send: list[Message] = []
    for message in _by_id(dbc.database):
        sent = not node or node in message.senders
        received = not node or any(node in signal.receivers for signal in message.signals)
        if (sent or received) and (not only or message.name in only):
            read = _with_good_safe_values(_read_message(dbc, message, for_codec=True))
            if received:
                receive.append(read)
            if sent:
                send.append(read)
    return _make_bus(path, dbc, node, receive, send)
