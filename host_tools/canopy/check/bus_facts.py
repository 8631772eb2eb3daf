# SPDX-License-Identifier: MIT
"""What rules ask about the DBC: the checked node's messages, as the compiler sees them and as the file writes them."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.bus.source import ReversedRange, SourceSignal
from canopy.compiler.bus_model import Bus, Message, Signal
from canopy.compiler.dbc_file import attribute, attribute_place, number
from canopy.compiler.errors import Place
from canopy.compiler.limits import DATA_ID


class BusFacts:
    """The bus of one node, for a controller that ticks every `period_ms`."""

    def __init__(self, bus: Bus, period_ms: int) -> None:
        self.bus = bus
        self.period_ms = period_ms
        self._dbc = bus.source

    def signals(self) -> Iterator[tuple[Message, Signal, SourceSignal]]:
        """(message, signal, the signal as it is written) of all that the node receives and sends."""
        for message in self.bus.messages:
            for signal in message.signals:
                yield message, signal, self._dbc.message(message.name).signal(signal.name)

    def place(self, message: Message, signal: Signal | None = None) -> Place:
        """The line of a message, or of one of its signals."""
        written = self._dbc.message(message.name)
        return written.place if signal is None else written.signal(signal.name).place

    def attribute_place(self, name: str, message: Message) -> Place:
        """The line that gives a message an attribute."""
        return attribute_place(self._dbc, name, self._dbc.message(message.name))

    def timeout_ms(self, message: Message) -> int:
        """GenMsgTimeoutTime as it is written, rounded down; 0: not at all."""
        value = number(self._dbc, "GenMsgTimeoutTime", self._dbc.message(message.name))
        return int(value or 0)

    def data_ids(self) -> Iterator[tuple[int, str, Place]]:
        """(E2EDataId, name, place) of every protected message of the bus, whoever sends it."""
        for message in self._dbc.messages:
            data_id = attribute(self._dbc, "E2EDataId", DATA_ID, message)
            if data_id is not None and data_id >= 0:
                yield data_id, message.name, attribute_place(self._dbc, "E2EDataId", message)

    def reversed_ranges(self) -> Iterator[tuple[str, ReversedRange]]:
        """Ranges of multiplexers' values, of the node's messages, whose ends are swapped; with the message's name."""
        for message in self.bus.messages:
            for found in self._dbc.message(message.name).reversed_ranges:
                yield message.name, found

    def comments(self) -> Iterator[tuple[list[Place], str]]:
        """The comments of the node's messages and signals, and the places that they speak for."""
        for message in self.bus.messages:
            own = [self.place(message), *(self.attribute_place(n, message) for n in ("GenMsgTimeoutTime", "E2EDataId"))]
            yield own, message.comment
            for signal in message.signals:
                yield [self.place(message, signal)], signal.comment
