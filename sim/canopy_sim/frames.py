# SPDX-License-Identifier: MIT
"""Frames of the DBC as the robot sends and takes them: packed, protected, checked.

Attributes read from the DBC: GenMsgCycleTime, GenMsgTimeoutTime [ms] (0: five cycles; no cycle either: never),
E2EDataId (-1: not protected), GenSigInactiveValue (safe value of a command).

Scales are worked out once, when the DBC is read: a frame is made in whole numbers, without a look at a decimal.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import can
from cantools.database.can import Database, Message, Signal

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.limits import DATA_ID, RAW, TIME_MS, whole
from canopy_sim.e2e import Checker, Protector

REFUSALS = ("flags", "length", "crc", "repeated", "sequence", "range", "version")
"""Why a frame is refused, in the order of the checks."""

E2E_SIGNALS = {"E2E_CRC", "E2E_Counter"}
TIMEOUT_IN_CYCLES = 5


class DescriptionError(Exception):
    """The DBC is not one of this robot; the text names the place and what is missing."""


class FrameRefusedError(Exception):
    """A received frame is not used; `reason` is one of REFUSALS."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


_LIMITS = {
    "GenMsgCycleTime": TIME_MS,
    "GenMsgTimeoutTime": TIME_MS,
    "E2EDataId": DATA_ID,
    "GenSigInactiveValue": RAW,
}


def attribute(database: Database, owner: Message | Signal, name: str, otherwise: int) -> int:
    """An integer attribute of a message or signal, else its default in the DBC, else `otherwise`.

    Raises:
        DescriptionError: It is not a whole number, or not one that the runtime can have.
    """
    value = None
    if owner.dbc is not None and name in owner.dbc.attributes:
        value = owner.dbc.attributes[name].value
    elif database.dbc is not None and name in database.dbc.attribute_definitions:
        value = database.dbc.attribute_definitions[name].default_value
    if value is None:
        return otherwise
    try:
        return whole(value, _LIMITS[name], f"{name} of {owner.name}", Place(""))
    except CompileError as error:
        raise DescriptionError(error.message) from None


def _exact(number: float | None) -> Fraction:
    """The decimal number as the DBC writes it: 0.1 is a tenth."""
    return Fraction(str(number))


class _Field:
    """One signal in whole numbers: where its bits are, and how a physical value becomes a raw one."""

    def __init__(self, signal: Signal) -> None:
        self.name = signal.name
        self.start = signal.start
        self.mask = 2**signal.length - 1
        self.sign = 2 ** (signal.length - 1) if signal.is_signed else 0
        self._scale = _exact(signal.scale)
        self._offset = _exact(signal.offset)
        least, most = (-self.sign, self.sign - 1) if signal.is_signed else (0, self.mask)
        """Raw values that the bits hold; of those, the ones that the DBC allows."""
        self.low = least if signal.minimum is None else max(least, self._raw(_exact(signal.minimum), up=True))
        self.high = most if signal.maximum is None else min(most, self._raw(_exact(signal.maximum), up=False))

    def _raw(self, value: Fraction, *, up: bool) -> int:
        raw = (value - self._offset) / self._scale
        return -(-raw.numerator // raw.denominator) if up else raw.numerator // raw.denominator

    def raw(self, value: Fraction | int) -> int:
        """Rounded down to the signal's step, and stopped at the ends of its range."""
        scale, offset = self._scale, self._offset
        numerator = value.numerator * offset.denominator - offset.numerator * value.denominator
        step = numerator * scale.denominator // (value.denominator * offset.denominator * scale.numerator)
        return min(max(step, self.low), self.high)


def _fields(message: Message) -> list[_Field]:
    """The message's signals.

    Raises:
        DescriptionError: One is of a kind that the robot does not send or take.
    """
    for signal in message.signals:
        if signal.byte_order != "little_endian" or signal.is_float or signal.multiplexer_ids or signal.is_multiplexer:
            raise DescriptionError(f"{message.name}.{signal.name} must be a plain whole number, Intel byte order")
        if _exact(signal.scale) <= 0:
            raise DescriptionError(f"{message.name}.{signal.name} must have a scale above 0")
    return [_Field(signal) for signal in message.signals]


class _FrameLayout:
    """What both directions need of a message."""

    def __init__(self, database: Database, name: str, signals: set[str]) -> None:
        try:
            self._message = database.get_message_by_name(name)
        except KeyError:
            raise DescriptionError(f"no message {name}") from None
        self.name = name
        self.arbitration_id: int = self._message.frame_id
        self.cycle = attribute(database, self._message, "GenMsgCycleTime", 0) / 1e3
        """Cycle time [s]; 0: not cyclic."""
        data_id = attribute(database, self._message, "E2EDataId", -1)
        self._data_id = None if data_id < 0 else data_id
        wanted = signals | (E2E_SIGNALS if self._data_id is not None else set())
        missing = sorted(wanted - {signal.name for signal in self._message.signals})
        if missing:
            raise DescriptionError(f"message {name} has no signal {', '.join(missing)}")
        self._fields = _fields(self._message)
        self._is_extended, self._is_fd = self._message.is_extended_frame, self._message.is_fd
        self._length: int = self._message.length


class Outgoing(_FrameLayout):
    """A message that the robot sends."""

    def __init__(self, database: Database, name: str, signals: set[str]) -> None:
        """`signals` are those that frame() will be given; a DescriptionError says what the DBC lacks."""
        super().__init__(database, name, signals)
        self._protector = None if self._data_id is None else Protector(self._data_id)

    def frame(self, values: Mapping[str, Fraction | int]) -> can.Message:
        """Packs a frame.

        Args:
            values: Physical value by signal. Rounded down to the signal's step, as the sensors do (a threshold that is
                a whole number of steps is then met exactly), and stopped at the ends of its range.
        """
        bits = 0
        for field in self._fields:
            bits |= (field.raw(values.get(field.name, 0)) & field.mask) << field.start
        data = bytearray(bits.to_bytes(self._length, "little"))
        if self._protector is not None:
            self._protector.protect(data)
        return can.Message(
            arbitration_id=self.arbitration_id, is_extended_id=self._is_extended, is_fd=self._is_fd, data=data
        )


class Incoming(_FrameLayout):
    """A message that the robot obeys."""

    def __init__(self, database: Database, name: str, signals: set[str]) -> None:
        """`signals` are those that the robot reads; a DescriptionError says what the DBC lacks."""
        super().__init__(database, name, signals)
        self._checker = None if self._data_id is None else Checker(self._data_id)
        timeout = attribute(database, self._message, "GenMsgTimeoutTime", 0) / 1e3
        self.timeout: float | None = timeout or TIMEOUT_IN_CYCLES * self.cycle or None
        """How long an accepted frame stays fresh [s]; None: for ever."""

    def unpack(self, frame: can.Message) -> dict[str, int]:
        """Checks a frame: flags, length, CRC, counter, ranges; then gives its raw values by signal.

        Raises:
            FrameRefusedError: The frame is not to be used.
        """
        if (frame.is_extended_id, frame.is_fd) != (self._is_extended, self._is_fd) or frame.is_remote_frame:
            raise FrameRefusedError("flags")
        if frame.dlc != self._length:
            raise FrameRefusedError("length")
        data = bytes(frame.data)
        if self._checker is not None:
            reason = self._checker.check(data)
            if reason is not None:
                raise FrameRefusedError(reason)
        bits = int.from_bytes(data, "little")
        raw: dict[str, int] = {}
        for field in self._fields:
            value = bits >> field.start & field.mask
            value -= 2 * (value & field.sign)
            if not field.low <= value <= field.high:
                raise FrameRefusedError("range")
            raw[field.name] = value
        return raw


class CommandMessage(Incoming):
    """A command: signals whose values are those of the plant, each with a safe one."""

    def __init__(self, database: Database, name: str, modes: Mapping[str, Any]) -> None:
        """Reads the message.

        Args:
            database: The DBC.
            name: The message's.
            modes: By signal: an IntEnum of the plant, whose names the signal's value table must have with the same
                numbers (the table may have fewer); None for a plain number.

        Raises:
            DescriptionError: Where the DBC's table and safe value do not fit them.
        """
        super().__init__(database, name, set(modes))
        self.safe: dict[str, int] = {}
        """Safe value by signal: what is obeyed while no command is fresh."""
        for signal_name, wanted in modes.items():
            signal = self._message.get_signal_by_name(signal_name)
            safe = attribute(database, signal, "GenSigInactiveValue", 0)
            if wanted is not None:
                _check_modes(f"{name}.{signal_name}", signal, safe, wanted)
            self.safe[signal_name] = safe


def _check_modes(where: str, signal: Signal, safe: int, wanted: Any) -> None:
    described = {str(text): int(value) for value, text in (signal.choices or {}).items()}
    known = {mode.name: mode.value for mode in wanted}
    if not described or not described.items() <= known.items():
        raise DescriptionError(f"values of {where} are {described}, the robot's are {known}")
    if safe not in described.values():
        raise DescriptionError(f"GenSigInactiveValue of {where} is {safe}, which is no mode")
