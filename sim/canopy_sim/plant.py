# SPDX-License-Identifier: MIT
"""The robot's physics: the C library of sim/plant with types and names for Python.

The headers in sim/plant/include/canopy_sim are the manual. Units are theirs: whole numbers of nm, mm and 0.1 %.
"""

from __future__ import annotations

from enum import IntEnum

from canopy_sim._plant import ffi, lib

POWER_STEP_MS: int = lib.CANOPY_SIM_POWER_STEP_MS
"""Length of a step of the power part in the robot's time [ms]."""

POSTURE_STEP_MS: int = lib.CANOPY_SIM_POSTURE_STEP_MS
"""Length of a step of the posture part in the robot's time [ms]."""


class PowerMode(IntEnum):
    """What the power part is told to do. Names are those of the DBC's value table."""

    Stop = lib.CANOPY_SIM_POWER_STOP
    DoTask = lib.CANOPY_SIM_POWER_DO_TASK
    DriveToCharger = lib.CANOPY_SIM_POWER_DRIVE_TO_CHARGER
    Charge = lib.CANOPY_SIM_POWER_CHARGE


class PostureMode(IntEnum):
    """What the posture part is told to do. Names are those of the DBC's value table."""

    Stop = lib.CANOPY_SIM_POSTURE_STOP
    SitUp = lib.CANOPY_SIM_POSTURE_SIT_UP
    StandUp = lib.CANOPY_SIM_POSTURE_STAND_UP
    WalkHome = lib.CANOPY_SIM_POSTURE_WALK_HOME


class Plant:
    """One NAO. Begins where the paper's examples begin: power (80 m, 50 %), posture (0.5 m, 0 m)."""

    def __init__(self) -> None:
        self._nao = ffi.new("canopy_sim_nao_t *")
        self._power = ffi.addressof(self._nao, "power")
        self._posture = ffi.addressof(self._nao, "posture")
        lib.canopy_sim_nao_init(self._nao)

    def set_power(self, distance_nm: int, battery: int) -> None:
        """Sets the distance to the charger [nm] and the charge of the battery [0.1 %].

        Raises:
            ValueError: A value is out of range; nothing was changed.
        """
        if not lib.canopy_sim_power_set(self._power, distance_nm, battery):
            raise ValueError(
                f"distance {distance_nm / 1e9} m (-10..200) or battery {battery / 10} % (0..110) out of range"
            )

    def set_posture(self, head_x_mm: int, head_height_mm: int) -> None:
        """Sets the head's distance from home and its height [mm].

        Raises:
            ValueError: A value is out of range; nothing was changed.
        """
        if not lib.canopy_sim_posture_set(self._posture, head_x_mm, head_height_mm):
            raise ValueError(
                f"head at {head_x_mm / 1e3} m (-10..10), {head_height_mm / 1e3} m high (0..2) out of range"
            )

    def step_power(self, mode: PowerMode) -> None:
        """One step of 10 s of the power part."""
        lib.canopy_sim_power_step(self._power, mode)

    def step_posture(self, mode: PostureMode) -> None:
        """One step of 1 s of the posture part."""
        lib.canopy_sim_posture_step(self._posture, mode)

    def push_over(self) -> None:
        """Puts the head on the floor."""
        lib.canopy_sim_posture_push_over(self._posture)

    @property
    def distance_nm(self) -> int:
        """Distance to the charger [nm]; negative past it."""
        return int(self._power.distance_nm)

    @property
    def distance_mm(self) -> int:
        """What the distance sensor shows [mm]: rounded down."""
        return int(lib.canopy_sim_power_distance_mm(self._power))

    @property
    def battery(self) -> int:
        """Charge [0.1 %]."""
        return int(self._power.battery)

    @property
    def charging(self) -> bool:
        """The last step has charged the battery."""
        return bool(self._power.charging)

    @property
    def head_x_mm(self) -> int:
        """Distance of the head from home [mm]; negative past it."""
        return int(self._posture.head_x_mm)

    @property
    def head_height_mm(self) -> int:
        """Height of the head [mm]."""
        return int(self._posture.head_height_mm)
