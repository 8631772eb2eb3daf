# SPDX-License-Identifier: MIT
"""A run that refutes a claim as a record: what `PROGRAM --replay FILE` takes, so that the real program shows it.

One tick a step of the model. In each tick all messages come that a variable's signal is in, protected where the DBC
says so; signals that the model does not know are 0, or the nearest value that is accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import floor

from canopy.compiler.bus_model import Bus, Message, Signal
from canopy.compiler.errors import CompileError
from canopy.verify.checks import signal_of
from canopy.verify.linear import State
from canopy.verify.model import Plant
from canopy.verify.unroll import Visit


def messages_of(plant: Plant, bus: Bus) -> list[Message]:
    """The received messages that variables are sensed by.

    Raises:
        CompileError: A variable has no signal that the node receives, so that no frame can say where the plant is.
    """
    for variable in plant.variables:
        message = variable.signal.partition(".")[0]
        if message not in bus.received or signal_of(bus, variable.signal) is None:
            raise CompileError(
                variable.place,
                f"variable '{variable.name}' has no signal that '{bus.node}' receives, so a run cannot be recorded",
                'give it: signal = "Message.Signal"',
            )
    names = {variable.signal.partition(".")[0] for variable in plant.variables}
    return [message for message in bus.receive if message.name in names]


def raw_values(plant: Plant, bus: Bus, state: State) -> tuple[dict[str, int], bool]:
    """The nearest raw value of each signal by Message.Signal, and whether all of them are exact."""
    values, exact = {}, True
    for variable, value in zip(plant.variables, state, strict=True):
        signal = signal_of(bus, variable.signal)
        assert signal is not None, "messages_of() has looked"
        steps = (value - Fraction(signal.offset)) / Fraction(signal.scale)
        values[variable.signal] = _accepted(signal, floor(steps + Fraction(1, 2)))
        exact = exact and values[variable.signal] == steps
    return values, exact


def _accepted(signal: Signal, raw: int) -> int:
    """The nearest value that is taken from the bus."""
    ends = (max(low, min(high, raw)) for low, high in signal.accepted)
    return min(ends, key=lambda value: abs(value - raw))


def record(visits: Sequence[Visit], plant: Plant, bus: Bus, period_ms: int) -> tuple[bytes, int]:
    """The record, and in how many of its ticks some value had to be rounded to a step of its signal.

    Raises:
        CompileError: As messages_of(); or python-can is not installed.
    """
    try:
        from canopy.replay.program import BEGIN, frame_item, tick_item
    except ImportError:
        raise CompileError(
            plant.variables[0].place, "a record needs a Python package", "pip install 'canopy-bt[can]'"
        ) from None
    messages = messages_of(plant, bus)
    content = bytearray(BEGIN)
    rounded = 0
    for tick, visit in enumerate(visits):
        values, exact = raw_values(plant, bus, visit.state)
        rounded += not exact
        content += tick_item((tick + 1) * 1000 * period_ms)
        for message in messages:
            content += frame_item(0, _datagram(bus, message, values, tick))
    return bytes(content), rounded


def _datagram(bus: Bus, message: Message, values: dict[str, int], tick: int) -> bytes:
    """A frame of a message."""
    import can

    from canopy.replay.e2e import COUNTERS, crc
    from canopy.unixbus import encode

    raw = {signal.name: values.get(f"{message.name}.{signal.name}", _accepted(signal, 0)) for signal in message.signals}
    owner = bus.source.database.get_message_by_name(message.name)
    every = {signal.name: raw.get(signal.name, 0) for signal in owner.signals}
    data = bytearray(owner.encode(every, scaling=False, strict=False).ljust(message.length, b"\0"))
    if message.data_id is not None:
        data[1] = data[1] & 0xF0 | tick % COUNTERS
        data[0] = crc(message.data_id, bytes(data))
    frame = can.Message(
        arbitration_id=message.id, is_extended_id=message.extended, is_fd=message.fd, data=data, check=True
    )
    return encode(frame)
