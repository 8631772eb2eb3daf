# SPDX-License-Identifier: MIT
"""The robot's side of the DBC: which messages it sends and obeys, packed and checked.

Attributes read from the DBC: GenMsgCycleTime, GenMsgTimeoutTime [ms] (0: five cycles; no cycle either: never),
E2EDataId (-1: not protected), GenSigInactiveValue (safe value of a command).
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import can
from cantools.database.can import Database, Message, Signal

from canopy.compiler.dbc_file import load_dbc
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.limits import DATA_ID, RAW, TIME_MS, whole
from canopy.live.trace_model import MESSAGES, VERSION
from canopy_sim.e2e import Checker, Protector
from canopy_sim.plant import PostureMode, PowerMode

REFUSALS = ("flags", "length", "crc", "repeated", "sequence", "range", "version")
"""Why a frame is refused, in the order of the checks."""

E2E_SIGNALS = {"E2E_CRC", "E2E_Counter"}
TIMEOUT_IN_CYCLES = 5
LARGEST_STANDARD_ID = 0x7FF
DEFAULT_TRACE = 0x600
"""Of the examples."""


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


def _attribute(database: Database, owner: Message | Signal, name: str, otherwise: int) -> int:
    """An integer attribute of a message or signal, else its default in the DBC, else `otherwise`."""
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


class _FrameLayout:
    """What both directions need of a message."""

    def __init__(self, database: Database, name: str, signals: set[str]) -> None:
        try:
            self._message = database.get_message_by_name(name)
        except KeyError:
            raise DescriptionError(f"no message {name}") from None
        self.name = name
        self.arbitration_id: int = self._message.frame_id
        self.cycle = _attribute(database, self._message, "GenMsgCycleTime", 0) / 1e3
        """Cycle time [s]; 0: not cyclic."""
        data_id = _attribute(database, self._message, "E2EDataId", -1)
        self._data_id = None if data_id < 0 else data_id
        wanted = signals | (E2E_SIGNALS if self._data_id is not None else set())
        missing = sorted(wanted - {signal.name for signal in self._message.signals})
        if missing:
            raise DescriptionError(f"message {name} has no signal {', '.join(missing)}")


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
        raw = {signal.name: self._raw(signal, Fraction(values.get(signal.name, 0))) for signal in self._message.signals}
        data = bytearray(self._message.encode(raw, scaling=False, strict=False))
        if self._protector is not None:
            self._protector.protect(data)
        return can.Message(
            arbitration_id=self.arbitration_id,
            is_extended_id=self._message.is_extended_frame,
            is_fd=self._message.is_fd,
            data=data,
        )

    @staticmethod
    def _raw(signal: Signal, value: Fraction) -> int:
        if signal.minimum is not None:
            value = max(value, _exact(signal.minimum))
        if signal.maximum is not None:
            value = min(value, _exact(signal.maximum))
        return int((value - _exact(signal.offset)) // _exact(signal.scale))


class Incoming(_FrameLayout):
    """A message that the robot obeys."""

    def __init__(self, database: Database, name: str, signals: set[str]) -> None:
        """`signals` are those that the robot reads; a DescriptionError says what the DBC lacks."""
        super().__init__(database, name, signals)
        self._checker = None if self._data_id is None else Checker(self._data_id)
        timeout = _attribute(database, self._message, "GenMsgTimeoutTime", 0) / 1e3
        self.timeout: float | None = timeout or TIMEOUT_IN_CYCLES * self.cycle or None
        """How long an accepted frame stays fresh [s]; None: for ever."""

    def unpack(self, frame: can.Message) -> dict[str, int]:
        """Checks a frame: flags, length, CRC, counter, ranges; then gives its raw values by signal.

        Raises:
            FrameRefusedError: The frame is not to be used.
        """
        message = self._message
        if (frame.is_extended_id, frame.is_fd) != (message.is_extended_frame, message.is_fd) or frame.is_remote_frame:
            raise FrameRefusedError("flags")
        if frame.dlc != message.length:
            raise FrameRefusedError("length")
        if self._checker is not None:
            reason = self._checker.check(bytes(frame.data))
            if reason is not None:
                raise FrameRefusedError(reason)
        raw: Mapping[str, Any] = message.decode_simple(bytes(frame.data), decode_choices=False, scaling=False)
        for signal in message.signals:
            value = Fraction(raw[signal.name]) * _exact(signal.scale) + _exact(signal.offset)
            below = signal.minimum is not None and value < _exact(signal.minimum)
            if below or (signal.maximum is not None and value > _exact(signal.maximum)):
                raise FrameRefusedError("range")
        return {name: int(value) for name, value in raw.items()}


class CommandMessage(Incoming):
    """A command with the one signal Mode, whose value table names the plant's modes."""

    def __init__(self, database: Database, name: str, modes: type[PowerMode] | type[PostureMode]) -> None:
        """`modes` are the plant's; a DescriptionError says where the DBC's table and safe value do not fit them."""
        super().__init__(database, name, {"Mode"})
        signal = self._message.get_signal_by_name("Mode")
        described = {str(text): int(value) for value, text in (signal.choices or {}).items()}
        wanted = {mode.name: mode.value for mode in modes}
        if described != wanted:
            raise DescriptionError(f"values of {name}.Mode are {described}, the robot's are {wanted}")
        safe = _attribute(database, signal, "GenSigInactiveValue", 0)
        if safe not in wanted.values():
            raise DescriptionError(f"GenSigInactiveValue of {name}.Mode is {safe}, which is no mode")
        self.safe_mode = safe


class HeartBeat:
    """CanopyTick of the controller, which is in no DBC: it says that the tick's commands are complete."""

    LENGTH = 8

    def __init__(self, base: int) -> None:
        """`base`: arbitration id of the trace's first message."""
        self.arbitration_id = base
        self.trace_ids = frozenset(range(base, base + len(MESSAGES)))
        self._is_extended = base > LARGEST_STANDARD_ID

    def check(self, frame: can.Message) -> None:
        """Checks a frame with its id: flags, length, version.

        Raises:
            FrameRefusedError: It is none.
        """
        if frame.is_extended_id != self._is_extended or frame.is_fd or frame.is_remote_frame:
            raise FrameRefusedError("flags")
        if frame.dlc != self.LENGTH:
            raise FrameRefusedError("length")
        if frame.data[1] >> 4 != VERSION:
            raise FrameRefusedError("version")


class RobotMessages:
    """All messages of the robot."""

    def __init__(self, database: Database, trace: int) -> None:
        """A DescriptionError says what the DBC lacks. `trace`: the controller's first trace id."""
        self.battery = Outgoing(database, "Battery", {"Charging", "Level", "ChargerDistance"})
        self.posture = Outgoing(database, "Posture", {"HeadX", "HeadHeight"})
        self.simulation_step = Outgoing(database, "SimulationStep", {"Step"})
        self.power_command = CommandMessage(database, "PowerCommand", PowerMode)
        self.posture_command = CommandMessage(database, "PostureCommand", PostureMode)
        self.tick = HeartBeat(trace)
        self.known_ids = {message.frame_id for message in database.messages} | self.tick.trace_ids
        """Ids of the whole DBC, and of the trace."""
        for sensor in (self.battery, self.posture):
            if sensor.cycle <= 0:
                raise DescriptionError(f"message {sensor.name} needs a GenMsgCycleTime: it is sent cyclically")


def load_messages(dbc: Path, trace: int = DEFAULT_TRACE) -> RobotMessages:
    """Reads the DBC. `trace`: arbitration id of the first message of the controller's trace.

    Raises:
        DescriptionError: The file cannot be read, is no DBC, or not one of this robot.
    """
    try:
        database: Database = load_dbc(dbc).database
    except CompileError as error:
        raise DescriptionError(f"{error.place}: {error.message}") from error
    try:
        return RobotMessages(database, trace)
    except DescriptionError as error:
        raise DescriptionError(f"{dbc}: {error}") from None
