# SPDX-License-Identifier: MIT
"""One of Examples 4 and 5 with its robot in this process: nao_power, nao_home (canopy_sim.mission has the Big BT)."""

from __future__ import annotations

import ctypes
from pathlib import Path

from canopy.inprocess import Application
from canopy_sim._plant import ffi, lib


class SmallMission:
    """A controller of nao.dbc with its robot. For one thread at a time.

    Attributes:
        application: The controller; its inputs come from the robot.
    """

    def __init__(self, model: Path) -> None:
        """Starts where the paper's examples begin.

        Raises:
            InProcessError: The application is not there, or has no robot of nao.dbc in its library.
        """
        self.application = Application(model)
        function = self.application.library.function
        self._nao = ffi.cast("canopy_sim_nao_t *", int(function("nao_library_robot", ctypes.c_void_p)()))
        self._least = function("nao_library_least_battery", ctypes.c_int32, ctypes.c_bool)

    def set_power(self, distance_nm: int, battery: int) -> None:
        """Distance to the charger [nm], charge [0.1 %]. Raises ValueError: out of range."""
        if not lib.canopy_sim_power_set(ffi.addressof(self._nao, "power"), distance_nm, battery):
            raise ValueError(f"distance {distance_nm} nm or battery {battery / 10} % is out of range")

    def set_posture(self, head_x_mm: int, head_height_mm: int) -> None:
        """The head's distance from home and its height [mm]. Raises ValueError: out of range."""
        if not lib.canopy_sim_posture_set(ffi.addressof(self._nao, "posture"), head_x_mm, head_height_mm):
            raise ValueError(f"head at {head_x_mm} mm, {head_height_mm} mm high is out of range")

    @property
    def power(self) -> tuple[int, int]:
        """Distance to the charger [nm], charge [0.1 %]."""
        return int(self._nao.power.distance_nm), int(self._nao.power.battery)

    @property
    def posture(self) -> tuple[int, int]:
        """The head's distance from home and its height [mm]."""
        return int(self._nao.posture.head_x_mm), int(self._nao.posture.head_height_mm)

    def least_battery(self, *, again: bool = False) -> int:
        """Least charge since the start [0.1 %], or since the last call with `again`."""
        return int(self._least(again))
