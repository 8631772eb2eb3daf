# SPDX-License-Identifier: MIT
"""The robot's side of the DBC: which messages it sends and obeys.

A small robot has Examples 4 and 5 (nao.dbc), a whole one everything (big.dbc).
"""

from __future__ import annotations

from pathlib import Path

from cantools.database.can import Database

from canopy.compiler.dbc_file import load_dbc
from canopy.compiler.errors import CompileError
from canopy_sim.frames import CommandMessage, DescriptionError, Incoming, Outgoing
from canopy_sim.plant import ArmsMode, PostureMode, PowerMode, Words
from canopy_sim.sensors import SENSORS, Sensor

__all__ = ["DescriptionError", "RobotMessages", "load_messages"]

UPPER = {"TrackBall": None, "Arms": ArmsMode, "ArmsNumber": None, "Say": Words, "SayNumber": None}


class RobotMessages:
    """All messages of the robot."""

    def __init__(self, database: Database) -> None:
        """A DescriptionError says what the DBC lacks."""
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
        self.tick = Incoming(database, "CanopyTick", set())
        self.known_ids = {message.frame_id for message in database.messages}
        """Ids of the whole DBC."""


def load_messages(dbc: Path) -> RobotMessages:
    """Reads the DBC.

    Raises:
        DescriptionError: The file cannot be read, is no DBC, or not one of this robot.
    """
    try:
        database: Database = load_dbc(dbc).database
    except CompileError as error:
        raise DescriptionError(f"{error.place}: {error.message}") from error
    try:
        return RobotMessages(database)
    except DescriptionError as error:
        raise DescriptionError(f"{dbc}: {error}") from None
