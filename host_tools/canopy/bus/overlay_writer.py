# SPDX-License-Identifier: MIT
"""An overlay with everything that a file lacks for one node: each line with what one must know to fill it in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from canopy.bus.j1939 import NULL_ADDRESS, SOURCE
from canopy.bus.overlay import TO_FILL_IN, decimal_text, heading
from canopy.bus.source import SourceMessage, SourceSignal
from canopy.compiler.bus_reader import E2E_SIGNALS, read_sent
from canopy.compiler.dbc_file import Dbc, number
from canopy.compiler.errors import CompileError
from canopy.escape.visible import brief

_TABLE_SHOWN = 8
_QUESTION = f'"{TO_FILL_IN}"'


class Values:
    """What stands behind each `=`: a question. Subclasses answer it."""

    def cycle_ms(self, _message: SourceMessage) -> str:
        """Of an output."""
        return _QUESTION

    def timeout_ms(self, _message: SourceMessage) -> str:
        """Of an input."""
        return _QUESTION

    def source(self, _message: SourceMessage) -> str:
        """Of an output of J1939."""
        return _QUESTION

    def safe(self, _dbc: Dbc, _message: SourceMessage, _signal: SourceSignal) -> str:
        """Of a signal of an output, physical."""
        return _QUESTION


class StartValues(Values):
    """Safe values are what the file gives as GenSigStartValue, where it does."""

    def safe(self, dbc: Dbc, message: SourceMessage, signal: SourceSignal) -> str:
        """Of a signal of an output, physical."""
        raw = number(dbc, "GenSigStartValue", message, signal)
        return super().safe(dbc, message, signal) if raw is None else physical_text(signal, raw)


@dataclass(frozen=True)
class Wanted:
    """Which messages the application has, in the node's name. `receive` and `send` name some beyond the file's."""

    node: str
    receive: tuple[str, ...] = ()
    send: tuple[str, ...] = ()
    values: Values = field(default_factory=Values)


def physical_text(signal: SourceSignal, raw: Fraction) -> str:
    """The physical value of a raw one, as TOML writes it."""
    return decimal_text(raw * Fraction(signal.scale) + Fraction(signal.offset))


def _written(message: SourceMessage) -> str:
    """Its name in the file."""
    return message.origin or message.name


def _comment(text: str) -> str:
    """A text for behind a #: on one line."""
    return brief(" ".join(text.split()))


def _of_message(message: SourceMessage, verb: str) -> Iterator[str]:
    other = ", ".join(message.senders) if verb == "received" else ", ".join(sorted(message.receivers))
    parts = [f"0x{message.frame_id:X}, {message.length} bytes, {verb}", message.comment]
    if other:
        parts[0] += f" {'from' if verb == 'received' else 'to'} {other}"
    yield f"# {_comment(': '.join(part for part in parts if part))}"


def _of_signal(signal: SourceSignal) -> str:
    unit = signal.unit or ("" if signal.choices else "no unit")
    bounds = f"{signal.minimum}..{signal.maximum}" if signal.minimum is not None else ""
    table = [f'"{text}"' for _, text in sorted(signal.choices.items())]
    more = ", …" if len(table) > _TABLE_SHOWN else ""
    names = f"one of {', '.join(table[:_TABLE_SHOWN])}{more}" if table else ""
    return _comment("; ".join(part for part in (unit, bounds, names, signal.comment) if part))


def _quoted(names: Iterable[str]) -> str:
    return "[" + ", ".join('"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"' for name in names) + "]"


def _lacks_time(dbc: Dbc, message: SourceMessage, *names: str) -> bool:
    found = [message.attributes[name].place.file for name in names if name in message.attributes]
    return not any(number(dbc, name, message) for name in names) and str(dbc.overlay) not in found


def _output(dbc: Dbc, message: SourceMessage, wanted: Wanted) -> Iterator[str]:
    yield from _of_message(message, "sent")
    yield heading(_written(message))
    if message.is_j1939 and not message.mask & SOURCE and message.frame_id & SOURCE == NULL_ADDRESS:
        yield f"source = {wanted.values.source(message)} # our address"
        message.mask |= SOURCE
    try:
        read_sent(dbc, message)
    except CompileError as error:
        yield f"leave_out = true # {_comment(error.message)}"
        return
    if wanted.node not in message.senders:
        yield f"senders = {_quoted([wanted.node])}"
    cycle = number(dbc, "GenMsgCycleTime", message)
    if not cycle or cycle.denominator != 1:
        yield f"cycle_ms = {wanted.values.cycle_ms(message)} # sent so often; a multiple of the period"
    data_id = number(dbc, "E2EDataId", message)
    hidden = E2E_SIGNALS if data_id is not None and data_id >= 0 else {}
    for signal in message.signals:
        if signal.name not in hidden and number(dbc, "GenSigInactiveValue", message, signal) is None:
            yield heading(_written(message), signal.name)
            yield f"safe = {wanted.values.safe(dbc, message, signal)} # {_of_signal(signal)}"


def _input(dbc: Dbc, message: SourceMessage, wanted: Wanted) -> Iterator[str]:
    yield from _of_message(message, "received")
    yield heading(_written(message))
    if wanted.node not in message.receivers:
        yield f"receivers = {_quoted([*sorted(message.receivers), wanted.node])}"
    if _lacks_time(dbc, message, "GenMsgCycleTime", "GenMsgTimeoutTime"):
        yield f"timeout_ms = {wanted.values.timeout_ms(message)} # fresh for so long after a frame; 0: for ever"


def overlay_text(dbc: Dbc, wanted: Wanted) -> str:
    """The overlay for one node.

    Raises:
        CompileError: a message of `wanted` is not in the file.
    """
    for name in (*wanted.receive, *wanted.send):
        dbc.message(name)
    parts: list[list[str]] = []
    seen: set[str] = set()
    for message in dbc.source.messages:
        if message.origin in seen:
            continue
        seen |= {message.origin} - {""}
        sent = message.name in wanted.send or wanted.node in message.senders
        received = message.name in wanted.receive or wanted.node in message.receivers
        if sent:
            parts.append(list(_output(dbc, message, wanted)))
        elif received and message.problem is None:
            parts.append(list(_input(dbc, message, wanted)))
    told = [lines for lines in parts if len(lines) > 2]  # a table with something in it
    head = [f"# What {brief(dbc.path.name)} lacks for the node {brief(wanted.node)}; docs/dbc.md has every key."]
    if not parts:
        head.append("# The node sends and receives nothing: name its messages with --send and --receive.")
    elif not told:
        head.append("# Nothing is missing.")
    return "\n\n".join("\n".join(lines) for lines in [head, *told]) + "\n"
