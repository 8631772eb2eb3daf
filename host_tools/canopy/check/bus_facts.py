# SPDX-License-Identifier: MIT
"""What rules ask about the DBC: the checked node's messages, as the compiler sees them and as the file writes them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from canopy.compiler.bus_model import Bus, Message, Signal
from canopy.compiler.dbc_file import attribute
from canopy.compiler.dbc_text import ReversedRange, dbc_id
from canopy.compiler.errors import Place
from canopy.compiler.limits import DATA_ID, TIME_MS


class BusFacts:
    """The bus of one node, for a controller that ticks every `period_ms`."""

    def __init__(self, bus: Bus, period_ms: int) -> None:
        self.bus = bus
        self.period_ms = period_ms
        self._text = bus.source.text
        self._written: dict[str, Any] = {message.name: message for message in bus.source.database.messages}

    def signals(self) -> Iterator[tuple[Message, Signal, Any]]:
        """(message, signal, cantools' signal) of all that the node receives and sends."""
        for message in self.bus.messages:
            for signal in message.signals:
                yield message, signal, self._written[message.name].get_signal_by_name(signal.name)

    def place(self, message: Message, signal: Signal | None = None) -> Place:
        """The line of a message, or of one of its signals."""
        written = self._written[message.name]
        return self._text.message(written) if signal is None else self._text.signal(written, signal)

    def attribute_place(self, name: str, message: Message) -> Place:
        """The line that gives a message an attribute."""
        return self._text.attribute(name, self._written[message.name])

    def timeout_ms(self, message: Message) -> int:
        """GenMsgTimeoutTime as it is written; 0: not at all."""
        return attribute(self.bus.source, "GenMsgTimeoutTime", TIME_MS, self._written[message.name]) or 0

    def data_ids(self) -> Iterator[tuple[int, str, Place]]:
        """(E2EDataId, name, place) of every protected message of the bus, whoever sends it."""
        for name, message in self._written.items():
            data_id = attribute(self.bus.source, "E2EDataId", DATA_ID, message)
            if data_id is not None and data_id >= 0:
                yield data_id, name, self._text.attribute("E2EDataId", message)

    def reversed_ranges(self) -> Iterator[tuple[str, ReversedRange]]:
        """Ranges of multiplexers' values, of the node's messages, whose ends are swapped; with the message's name."""
        names = {dbc_id(self._written[message.name]): message.name for message in self.bus.messages}
        for found in self._text.reversed_ranges:
            if found.message_id in names:
                yield names[found.message_id], found

    def comments(self) -> Iterator[tuple[list[Place], str]]:
        """The comments of the node's messages and signals, and the places that they speak for."""
        for message in self.bus.messages:
            own = [self.place(message), *(self.attribute_place(n, message) for n in ("GenMsgTimeoutTime", "E2EDataId"))]
            yield own, message.comment
            for signal in message.signals:
                yield [self.place(message, signal)], signal.comment
