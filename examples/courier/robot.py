#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plays the courier's robot on its bus: wheels, localizer, planner with its map, and the operator.

Usage: robot.py BUS        for example unixbus:bus0 or socketcan:can0

Two things go wrong on the way. The planner's map shows an obstacle that is not there, until the map is cleared. And a
door sill holds the wheels, until the robot has backed off and takes a new run.
When the robot is at its goal, it stays on the bus for a second, so that the controller sees it.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import can
import cantools
from cantools.database.can import Database

from canopy.canbus import open_bus

STEP_S = 0.05
GOAL = (3000, 2000)
WALL_X, WALL_TOP = 1500, 1200  # from the south up to here; the way around it is over its top
ROUND_THE_WALL = (WALL_X, WALL_TOP + 200)
SILL_X = 600
RUN_UP_MM = 100  # so far back the robot must go to get over the sill
NEAR_MM = 50
STAY_S = 1.0


class Robot:
    """The world, in steps of STEP_S. `sent` are the messages that the controller hears after a step."""

    def __init__(self) -> None:
        self.x = self.y = 0.0
        self.order = 1
        self.ghost = True
        self.sill = True
        self.clear_number = 0
        self.reply: dict[str, Any] = {"Number": 0, "Result": "None", "ViaX": 0, "ViaY": 0}

    @property
    def has_arrived(self) -> bool:
        """Is the robot where the operator wants it?"""
        return max(abs(self.x - GOAL[0]), abs(self.y - GOAL[1])) <= NEAR_MM

    def command(self, name: str, values: dict[str, Any]) -> None:
        """Obeys a message of the controller."""
        if name == "Drive":
            self._drive(values["SpeedX"] * STEP_S, values["SpeedY"] * STEP_S)
        elif name == "PlanRequest" and values["Number"] not in (0, self.reply["Number"]):
            self._plan(values)
        elif name == "MapCommand" and values["ClearNumber"] not in (0, self.clear_number):
            self.clear_number = values["ClearNumber"]
            self.ghost = False

    def _drive(self, dx: float, dy: float) -> None:
        if self.sill and self.x < SILL_X - RUN_UP_MM and dx < 0:
            self.sill = False
        if self.sill and self.x + dx > SILL_X:
            return
        self.x += dx
        self.y += dy

    def _plan(self, values: dict[str, Any]) -> None:
        goal = (values["X"], values["Y"])
        is_behind_wall = self.x < WALL_X < goal[0] and self.y <= WALL_TOP
        via = ROUND_THE_WALL if is_behind_wall else goal
        result = "Blocked" if self.ghost else "Planned"
        self.reply = {"Number": values["Number"], "Result": result, "ViaX": via[0], "ViaY": via[1]}

    @property
    def sent(self) -> dict[str, dict[str, Any]]:
        """What the other boards say."""
        return {
            "Pose": {"X": round(self.x), "Y": round(self.y)},
            "Order": {"Number": self.order, "X": GOAL[0], "Y": GOAL[1]},
            "PlanReply": self.reply,
            "MapStatus": {"ClearNumber": self.clear_number},
        }


def play(bus_name: str, robot: Robot) -> None:
    """Plays the robot until it has arrived.

    Raises:
        CanBusError: The bus cannot be opened.
    """
    database = cantools.database.load_file(Path(__file__).parent / "courier.dbc")
    assert isinstance(database, Database)
    commands = {database.get_message_by_name(name).frame_id: name for name in ("Drive", "PlanRequest", "MapCommand")}
    with open_bus(bus_name) as bus:
        due = time.monotonic()
        steps_left = round(STAY_S / STEP_S)
        while steps_left:
            steps_left -= robot.has_arrived
            for name, values in robot.sent.items():
                identifier = database.get_message_by_name(name).frame_id
                data = database.encode_message(name, values)
                bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
            due += STEP_S
            while (left := due - time.monotonic()) > 0:
                frame = bus.recv(left)
                if frame is not None and frame.arbitration_id in commands:
                    values = database.decode_message(frame.arbitration_id, frame.data)
                    robot.command(commands[frame.arbitration_id], dict(values))


if __name__ == "__main__":
    play(sys.argv[1], Robot())
