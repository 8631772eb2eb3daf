# SPDX-License-Identifier: MIT
"""A bus description as its file says it, whatever its kind: messages, signals, nodes, attributes, and their lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal

from canopy.compiler.bus_model import Ranges
from canopy.compiler.errors import CompileError, Place

MAX_MESSAGE_BYTES = 1785
"""Of J1939's transport protocol."""
MAX_SIGNALS = 2_048
"""Of a message: each pair of them is compared."""


@dataclass(frozen=True)
class Given:
    """The value of an attribute as it is written, and where."""

    value: str
    place: Place


Attributes = dict[str, Given]


@dataclass
class SourceSignal:
    """A signal. Numbers are exact, as the file writes them; `start` as in a DBC."""

    name: str
    place: Place
    start: int
    length: int
    little_endian: bool
    is_signed: bool
    scale: Decimal
    offset: Decimal
    minimum: Decimal | None
    maximum: Decimal | None
    """None where the file says [0|0]: there is no range."""
    unit: str = ""
    comment: str = ""
    receivers: list[str] = field(default_factory=list)
    is_float: bool = False
    choices: dict[int, str] = field(default_factory=dict)
    is_multiplexer: bool = False
    marker: Ranges = ()
    """Multiplexed: the value behind the m of the DBC."""
    multiplexer: str | None = None
    branches: Ranges = ()
    """Multiplexed: the multiplexer's values in whose frames the signal is."""
    attributes: Attributes = field(default_factory=dict)

    @property
    def byte_order(self) -> str:
        """As cantools calls it."""
        return "little_endian" if self.little_endian else "big_endian"


@dataclass(frozen=True)
class ReversedRange:
    """A range of a multiplexer's values whose first is larger than its last: it is taken for none."""

    place: Place
    signal: str
    text: str


@dataclass
class Address:
    """What the overlay says of a J1939 id. `fields`: which bits of the id, and their value; None: any."""

    fields: dict[int, int | None] = field(default_factory=dict)
    sources: dict[str, int] = field(default_factory=dict)
    """Name -> address: a message for each."""
    place: Place | None = None


@dataclass
class SourceMessage:
    """A message; `id` is the number that its file writes, so bit 31 is set for 29 bits in a DBC."""

    name: str
    place: Place
    id: int
    length: int
    senders: list[str] = field(default_factory=list)
    signals: list[SourceSignal] = field(default_factory=list)
    comment: str = ""
    is_fd: bool = False
    is_j1939: bool = False
    reversed_ranges: list[ReversedRange] = field(default_factory=list)
    origin: str = ""
    """The message's name in the file, where there are several of it here, one for each source."""
    mask: int = 0
    """The bits of `frame_id` that count when a frame is received."""
    address: Address = field(default_factory=Address)
    attributes: Attributes = field(default_factory=dict)
    problem: CompileError | None = None
    """Why there can be no code for it."""
    notes: list[tuple[Place, str]] = field(default_factory=list)
    """What is taken in another way than the file says it: a name that is there twice, an id without its mark."""
    dropped: dict[str, CompileError] = field(default_factory=dict)
    """Signals of which there can be no code, by name. Without them the message can be received, and not sent."""
    lost_receivers: set[str] = field(default_factory=set)
    """Of signals that are dropped."""
    has_lost_signals: bool = False
    """There are signals that cannot even be read: nobody knows who receives them."""
    is_left_out: bool = False
    """By the overlay: nobody wants it."""
    may_be_longer: bool = False
    """By the overlay: frames of more bytes are taken, too."""
    added_receivers: list[str] = field(default_factory=list)
    """By the overlay, in place of those of the signals."""

    @property
    def is_extended(self) -> bool:
        """Has it an id of 29 bits?"""
        return bool(self.id & 0x80000000)

    @property
    def frame_id(self) -> int:
        """The arbitration id."""
        return self.id & 0x7FFFFFFF

    @property
    def receivers(self) -> frozenset[str]:
        """The nodes that receive one of its signals."""
        of_signals = (node for signal in self.signals for node in signal.receivers)
        return frozenset([*self.added_receivers, *self.lost_receivers, *of_signals])

    def signal(self, name: str) -> SourceSignal:
        """The signal of that name. Raises KeyError where there is none."""
        for signal in self.signals:
            if signal.name == name:
                return signal
        raise KeyError(name)

    def drop(self, signal: SourceSignal, reason: CompileError) -> None:
        """Leaves out a signal; the message, too, if it is a multiplexer or the last one."""
        self.dropped[signal.name] = reason
        self.lost_receivers |= set(signal.receivers)
        self.signals.remove(signal)
        if signal.is_multiplexer or not self.signals:
            self.problem = self.problem or reason


@dataclass
class Source:
    """A file. `defaults` are the attributes of all objects that have none of their own."""

    nodes: list[str] = field(default_factory=list)
    messages: list[SourceMessage] = field(default_factory=list)
    defaults: Attributes = field(default_factory=dict)
    attributes: Attributes = field(default_factory=dict)
    """Of the file as a whole."""
    problems: list[CompileError] = field(default_factory=list)
    """Statements that cannot be read, and belong to no message that can."""

    def message(self, name: str) -> SourceMessage:
        """The message of that name. Raises KeyError where there is none."""
        for message in self.messages:
            if message.name == name:
                return message
        raise KeyError(name)
