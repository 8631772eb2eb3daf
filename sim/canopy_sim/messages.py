# SPDX-License-Identifier: MIT
"""The robot's side of the DBC: which messages it sends and obeys.

A small robot has Examples 4 and 5 (nao.dbc), a whole one everything (big.dbc).
"""

from __future__ import annotations

from pathlib import Path

import can
from cantools.database.can import Database

from canopy.compiler.dbc_file import load_dbc
from canopy.compiler.errors import CompileError
from canopy.live.trace_model import MESSAGES, VERSION
from canopy_sim.frames import CommandMessage, DescriptionError, FrameRefusedError, Outgoing
from canopy_sim.plant import ArmsMode, PostureMode, PowerMode, Words
from canopy_sim.sensors import SENSORS, Sensor

__all__ = ["DescriptionError", "RobotMessages", "load_messages"]

LARGEST_STANDARD_ID = 0x7FF
DEFAULT_TRACE = 0x600
"""Of the examples."""

UPPER = {"TrackBall": None, "Arms": ArmsMode, "ArmsNumber": None, "Say": Words, "SayNumber": None}


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
        names = {message.name for message in database.messages}
        self.is_whole = "UpperCommand" in names
        """The DBC has what the whole robot needs, not only Examples 4 and 5."""
        self.sensors: dict[str, tuple[Sensor, Outgoing]] = {}
        for sensor in SENSORS:
            if sensor.is_needed or self.is_whole:
                outgoing = Outgoing(database, sensor.message, sensor.needed(self.is_whole))
                if outgoing.cycle <= 0:
                    raise DescriptionError(f"message {sensor.message} needs a GenMsgCycleTime: it is sent cyclically")
                self.sensors[sensor.message] = (sensor, outgoing)
        self.battery = self.sensors["Battery"][1]
        self.posture = self.sensors["Posture"][1]
        self.simulation_step = Outgoing(database, "SimulationStep", {"Step"})
        self.power_command = CommandMessage(database, "PowerCommand", {"Mode": PowerMode})
        self.posture_command = CommandMessage(database, "PostureCommand", {"Mode": PostureMode})
        self.upper_command = CommandMessage(database, "UpperCommand", UPPER) if self.is_whole else None
        self.tick = HeartBeat(trace)
        self.known_ids = {message.frame_id for message in database.messages} | self.tick.trace_ids
        """Ids of the whole DBC, and of the trace."""


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
