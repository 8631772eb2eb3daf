# SPDX-License-Identifier: MIT
"""The Big BT and its robot in this process: the loop, the bus's codec and the plant run in C, Python looks and tells.

mission = Mission(Path("build/host/examples/nao/generated/nao_big/nao_big.model.json"), Profile.nao, seed=7)
mission.plant.say(Wish.BallGame)
mission.run(6000)                                  # a minute
mission.application.status("Throw Ball")
"""

from __future__ import annotations

import ctypes
from enum import IntFlag
from pathlib import Path

from canopy.inprocess import Application
from canopy_sim.plant import Plant, Profile


class People(IntFlag):
    """What people do to the robot by chance (examples/nao/big_world.h)."""

    say = 1
    toes = 2
    push = 4
    drop = 8
    drain = 16
    plug = 32


class Mission:
    """One controller with one robot; several may run at once. For one thread at a time.

    Attributes:
        application: The controller: inputs come from the robot; outputs, entries and statuses may be read.
        plant: The robot: may be looked at, and done things to, between two runs.
    """

    def __init__(self, model: Path, profile: Profile = Profile.nao, seed: int = 1) -> None:
        """Starts a mission as canopy_sim_robot_init() says.

        Raises:
            InProcessError: The application is not there, or has no robot of big.dbc in its library.
        """
        self.application = Application(model)
        function = self.application.library.function
        self._begin = function("big_library_begin", None, ctypes.c_int, ctypes.c_uint32)
        self._people = function("big_library_people", None, ctypes.c_uint32, ctypes.c_uint32)
        self._least = function("big_library_least_battery", ctypes.c_int32, ctypes.c_bool)
        address = int(function("big_library_robot", ctypes.c_void_p)())
        self._begin(int(profile), seed)
        self.plant = Plant(address=address)

    def begin(self, profile: Profile, seed: int) -> None:
        """A new robot, in the place of this one; the controller goes on."""
        self._begin(int(profile), seed)

    def let_people(self, deeds: People, every: int) -> None:
        """From now on people do one of these things every so many steps in the mean; People(0): nobody is there."""
        self._people(int(deeds), every)

    def run(self, ticks: int) -> None:
        """So many ticks of the controller, each with a step of the robot."""
        self.application.run(ticks)

    def least_battery(self, *, again: bool = False) -> float:
        """Least charge since the start [%], or since the last call with `again`."""
        return int(self._least(again)) / 10

    def close_look(self) -> dict[str, str]:
        """What the robot was told in the last tick, by signal."""
        told: dict[str, str] = {}
        for message in ("PowerCommand", "PostureCommand", "UpperCommand"):
            told |= {f"{message}.{key}": str(value) for key, value in self.application.outputs(message).items()}
        return told
