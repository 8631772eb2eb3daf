# SPDX-License-Identifier: MIT
"""A bus as one of its nodes sees it: what it receives and what it sends; or all of it.

Attributes that are read (docs/dbc.md), from the file or its overlay: GenMsgCycleTime, GenMsgTimeoutTime, E2EDataId of
messages, GenSigInactiveValue of signals.
"""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

from canopy.bus.doubts import Remark, doubts, impossible_range, left_out
from canopy.bus.j1939 import NULL_ADDRESS, SOURCE, TRANSPORT_BYTES
from canopy.bus.overlay import to_write
from canopy.bus.soundness import overlap
from canopy.bus.source import SourceMessage, SourceSignal
from canopy.compiler.bus_model import FD_LENGTHS, Bus, Message, Signal
from canopy.compiler.bus_names import name_messages
from canopy.compiler.bus_outputs import check_outputs
from canopy.compiler.dbc_file import Dbc, attribute, check_node, load_dbc, load_text, number
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.limits import DATA_ID, TIME_MS, count
from canopy.compiler.names import snake
from canopy.compiler.signal_reader import is_safe, nearest_allowed, read_signal, with_safe_value
from canopy.compiler.trace_layout import MESSAGES as TRACE_MESSAGES

__all__ = ["Bus", "Message", "Signal", "read_bus", "read_messages"]

E2E_SIGNALS = {"E2E_CRC": (0, 8), "E2E_Counter": (8, 4)}
CYCLES_TO_TIMEOUT = 5
"""A message without GenMsgTimeoutTime is stale after so many of its cycles."""


def _check_e2e(message: SourceMessage) -> None:
    if message.is_j1939 and message.length > TRANSPORT_BYTES:
        text = f"message '{message.name}' comes in several packets, and has an E2EDataId: only frames are protected"
        raise CompileError(message.place, text)
    for name, (start, length) in E2E_SIGNALS.items():
        signal = next((s for s in message.signals if s.name == name), None)
        if signal is None or (signal.start, signal.length, signal.little_endian) != (start, length, True):
            raise CompileError(
                message.place,
                f"message '{message.name}' has an E2EDataId, so it needs the signal {name} at {start}|{length}@1+",
                "E2E Profile 11 has its CRC in byte 0 and its counter in the low half of byte 1",
            )


def _wire_length(message: SourceMessage) -> int:
    """A CAN FD frame has one of few lengths."""
    length = message.length
    return min((known for known in FD_LENGTHS if known >= length), default=length) if message.is_fd else length


def _time_us(dbc: Dbc, name: str, message: SourceMessage) -> int:
    """A time in ms, which need not be a whole number of them, rounded up to us."""
    value = number(dbc, name, message) or Fraction(0)
    if value.denominator == 1 or not 0 < value < TIME_MS.high:
        return 1000 * (attribute(dbc, name, TIME_MS, message) or 0)
    return int(-(-1000 * value // 1))


def _read_message(dbc: Dbc, message: SourceMessage, *, for_codec: bool = False) -> Message:
    """The message. What is wrong with its layout is noted in it, too: then it is left out."""
    data_id = attribute(dbc, "E2EDataId", DATA_ID, message)
    hide_e2e = data_id is not None and data_id >= 0 and not for_codec
    if hide_e2e:
        _check_e2e(message)
    cycle, timeout = (_time_us(dbc, name, message) for name in ("GenMsgCycleTime", "GenMsgTimeoutTime"))
    seen = [signal for signal in message.signals if not (hide_e2e and signal.name in E2E_SIGNALS)]
    signals = _read_signals(message, seen)
    length = _wire_length(message)
    return Message(
        name=message.name,
        c_name=snake(message.name),
        id=message.frame_id,
        extended=message.is_extended,
        fd=message.is_fd,
        length=length,
        cycle_us=cycle,
        timeout_us=timeout or CYCLES_TO_TIMEOUT * cycle,
        data_id=data_id if data_id is not None and data_id >= 0 else None,
        # A multiplexer before the signals that it selects.
        signals=tuple(
            sorted((with_safe_value(dbc, message, s) for s in signals), key=lambda signal: len(signal.selectors))
        ),
        comment=message.comment,
        mask=message.mask,
        j1939=message.is_j1939,
        longest=max(length, 64 if message.is_fd else 8) if message.may_be_longer else length,
        receive_only=_receive_only(dbc, message, signals),
    )


def _read_signals(message: SourceMessage, wanted: list[SourceSignal]) -> list[Signal]:
    """Those of which there can be code; the others are dropped from the message, with the reason."""
    result = []
    for signal in wanted:
        try:
            result.append(read_signal(message, signal))
        except CompileError as error:
            message.drop(signal, error)
            if message.problem is not None:
                raise message.problem from error
    return result


def _receive_only(dbc: Dbc, message: SourceMessage, signals: list[Signal]) -> CompileError | None:
    """Why nobody should send the message: it is not whole, or not clear."""
    for reason in message.dropped.values():
        return reason
    shared = overlap(message)
    if shared is not None:
        one, other = shared
        line = to_write(dbc.path, "leave_out = true", message.name, other)
        return CompileError(
            message.signal(other).place, f"signals '{one}' and '{other}' of message '{message.name}' overlap", line
        )
    ranges = (impossible_range(message.name, signal, message.signal(signal.name)) for signal in signals)
    return next((wrong for wrong in ranges if wrong is not None), None)


def _check_frame(place: Place, message: Message, *, sent: bool) -> None:
    """Can it be one frame, or several that are put together?"""
    most = 64 if message.fd else 8
    if message.length <= most or (message.is_transported and not sent):
        return
    if message.is_transported:
        text = (
            f"message '{message.name}' has {message.length} bytes: what comes in several packets can be received only"
        )
        raise CompileError(place, text, to_do_without(message.name))
    raise CompileError(
        place,
        f"message '{message.name}' has {message.length} bytes, and a{' CAN FD' if message.fd else ''} frame at "
        f"most {most}",
        "" if message.fd else "for CAN FD give it the attribute VFrameFormat StandardCAN_FD or ExtendedCAN_FD",
    )


def to_do_without(name: str) -> str:
    """A help text for a message that the application can do without."""
    return f"to do without it: write `leave_out = true` for '{name}' in the overlay"


def _check_no_trace(message: SourceMessage, node: str) -> None:
    """Until version 2 of the trace its messages stood in the DBC."""
    if message.name.partition("_")[0] in (*TRACE_MESSAGES, "CanopyArrivals"):
        raise CompileError(
            message.place,
            f"node '{node}' sends '{message.name}', and the trace's messages are made by the compiler",
            "take the Canopy messages out of the DBC, and give --trace 0x600 (in CMake: TRACE 0x600), or another id "
            "that begins eight free ones",
        )


def _with_good_safe_values(message: Message) -> Message:
    """Where nobody has asked for safe values, a default of the DBC may not fit: then what is nearest to it does."""
    signals = tuple(
        signal if is_safe(signal) else dataclasses.replace(signal, safe=nearest_allowed(signal, signal.safe))
        for signal in message.signals
    )
    return dataclasses.replace(message, signals=signals)


def _load(dbc: Dbc) -> tuple[tuple[int, bool, bool, float], ...]:
    """The cyclic messages of every node, for the bus load."""
    return tuple(
        (_wire_length(message), message.is_extended, message.is_fd, _time_us(dbc, "GenMsgCycleTime", message) / 1000)
        for message in dbc.messages
    )


def _by_id(dbc: Dbc) -> list[SourceMessage]:
    return sorted(dbc.source.messages, key=lambda message: (message.is_extended, message.frame_id))


def _in_order(messages: list[Message]) -> list[Message]:
    """As canopy_bus_t.rx wants them: by (extended, id); then those of which not all of the id counts.

    Of the latter those of which more bits count come first, for they are tried in this order.
    """
    masked = sorted((m for m in messages if not m.is_exact), key=lambda m: (-m.mask.bit_count(), m.id & m.mask))
    for place, message in enumerate(masked):
        masked[place] = dataclasses.replace(message, id=message.id & message.mask)
    return [*(m for m in messages if m.is_exact), *masked]


def _check_masks(dbc: Dbc, messages: list[Message]) -> None:
    """Two messages that the same frame would be, and of which neither is the narrower one."""
    masked = [message for message in messages if not message.is_exact]
    for place, message in enumerate(masked):
        for other in masked[:place]:
            if message.mask.bit_count() == other.mask.bit_count() and not (
                (message.id ^ other.id) & message.mask & other.mask
            ):
                raise CompileError(
                    dbc.message(message.name).place,
                    f"a frame can be both '{other.name}' and '{message.name}': they have one parameter group",
                    to_write(dbc.path, "source = ADDRESS", message.name),
                )


def _make_bus(
    dbc: Dbc,
    node: str,
    receive: list[Message],
    send: list[Message],
    remarks: list[Remark],
    name: str | None = None,
) -> Bus:
    """The bus, with C names, each its own."""
    path = dbc.path
    for what, messages in (("receives", receive), ("sends", send)):
        count(messages, f"messages that node '{node}' {what}", Place(str(path)))
    known = {message.name: message for message in (*receive, *send)}
    named = {message.name: message for message in name_messages(tuple(known.values()))}
    for message in known.values():
        written = dbc.message(message.name)
        remarks += [Remark(place, text) for place, text in written.notes]
        remarks += [left_out(problem, "; the message can be received only") for problem in written.dropped.values()]
        for signal in message.signals:
            remarks += doubts(message.name, signal, written.signal(signal.name))
    return Bus(
        path=path,
        name=name or snake(path.stem),
        node=node,
        receive=tuple(named[message.name] for message in receive),
        send=tuple(named[message.name] for message in send),
        source=dbc,
        remarks=tuple(remarks),
    )


def read_sent(dbc: Dbc, message: SourceMessage) -> Message:
    """An output. Here nothing is left out: others wait for it.

    Raises:
        CompileError: it cannot be sent.
    """
    if message.problem is not None:
        raise _with_way(message.problem, message)
    read = _read_message(dbc, message)
    if message.is_j1939 and not message.mask & SOURCE and message.frame_id & SOURCE == NULL_ADDRESS:
        text = f"message '{message.name}' is sent, and its id has no source address"
        raise CompileError(message.place, text, to_write(dbc.path, "source = ADDRESS", message.name))
    if read.receive_only is not None:
        reason = read.receive_only
        wrong = CompileError(reason.place, f"{reason.message}: '{message.name}' cannot be sent so", reason.help_text)
        raise _with_way(wrong, message)
    _check_frame(message.place, read, sent=True)
    return read


def _with_way(problem: CompileError, message: SourceMessage) -> CompileError:
    """The same with one more way out."""
    ways = [problem.help_text, to_do_without(message.name)]
    return CompileError(problem.place, problem.message, "; ".join(way for way in ways if way))


def _read_received(dbc: Dbc, message: SourceMessage, remarks: list[Remark]) -> list[Message]:
    """An input, or none where its layout cannot be taken: a leaf that reads it is told so."""
    read = None
    if message.problem is None:
        try:
            read = _read_message(dbc, message)
        except CompileError:
            if message.problem is None:
                raise
    if read is not None:
        try:
            _check_frame(message.place, read, sent=False)
        except CompileError as error:
            message.problem = error
    if message.problem is not None:
        remarks.append(left_out(message.problem))
        return []
    return [] if read is None else [read]


def read_bus(path: Path, node: str, period_ms: int, name: str | None = None) -> Bus:
    """The bus of a DBC as `node` sees it, for a controller that ticks every `period_ms`.

    `name` is what its C names begin with: the application's, for its tables hold counts of its ticks. Else the file's.

    Raises:
        CompileError: the file cannot be read, has no such node, or has something that the application needs and that
            cannot be compiled.
    """
    dbc = load_dbc(path)
    check_node(dbc, node)
    receive: list[Message] = []
    send: list[Message] = []
    remarks = [left_out(problem) for problem in dbc.source.problems]
    for message in _by_id(dbc):
        sent = node in message.senders
        if sent:
            _check_no_trace(message, node)
            send.append(read_sent(dbc, message))
        elif node in message.receivers or message.has_lost_signals:
            receive += _read_received(dbc, message, remarks)
    receive = _in_order(receive)
    _check_masks(dbc, receive)
    buffers = sum(2 * message.length for message in send)  # places in them: canopy_tx_message_t.place
    count(buffers, f"bytes of two buffers for each message that node '{node}' sends", Place(str(path)))
    packets = sum(message.length for message in receive if message.is_transported)  # canopy_transport_t.place
    count(packets, f"bytes of messages of several packets that node '{node}' receives", Place(str(path)))
    bus = dataclasses.replace(_make_bus(dbc, node, receive, send, remarks, name), load=_load(dbc))
    check_outputs(dbc, bus.send, period_ms)
    return bus


def read_messages(path: Path, node: str = "", only: tuple[str, ...] = ()) -> Bus:
    """The messages of a DBC for a codec alone: all, or what `node` receives and sends, or those named in `only`.

    Signals of the end-to-end protection are signals as all others here; cycle times and safe values are not asked for.
    What cannot be compiled is left out, unless `only` names it.

    Raises:
        CompileError: the file cannot be read, has no such node or message, or nothing of it can be compiled.
    """
    return _read_for_codecs(load_dbc(path), node, only)


def read_text(text: str) -> Bus:
    """The messages of a DBC that is a text of ours. Raises CompileError as read_messages() does."""
    return _read_for_codecs(load_text(text), "", ())


def _read_for_codecs(dbc: Dbc, node: str, only: tuple[str, ...]) -> Bus:
    if node:
        check_node(dbc, node)
    for name in only:
        dbc.message(name)
    receive: list[Message] = []
    send: list[Message] = []
    problems = [] if only else list(dbc.source.problems)
    remarks: list[Remark] = []
    for message in _by_id(dbc):
        sent = not node or node in message.senders
        received = not node or node in message.receivers
        if not (sent or received) or (only and message.name not in only):
            continue
        read = _read_for_codec(dbc, message, required=bool(only))
        if read is None:
            problems += [] if message.problem is None else [message.problem]
            continue
        if received:
            receive.append(read)
        reason = read.receive_only
        if sent and reason is not None:
            if message.dropped:
                continue  # there is a remark for each of its signals
            text = f"message '{read.name}' gets no encode function: {reason.message}"
            remarks.append(Remark(reason.place, text, reason.help_text))
        elif sent:
            send.append(read)
    if problems and not receive and not send:
        raise problems[0]
    return _make_bus(dbc, node, receive, send, [*map(left_out, problems), *remarks])


def _read_for_codec(dbc: Dbc, message: SourceMessage, *, required: bool) -> Message | None:
    """The message; None: it is left out, with the reason in it."""
    if message.problem is not None:
        return None
    try:
        return _with_good_safe_values(_read_message(dbc, message, for_codec=True))
    except CompileError as error:
        if required:
            raise
        message.problem = error
        return None
