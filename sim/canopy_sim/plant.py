# SPDX-License-Identifier: MIT
"""The robot's physics: the C library of sim/plant with types and names for Python.

The headers in sim/plant/include/canopy_sim are the manual. Units are theirs: whole numbers of nm, mm and 0.1 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from canopy_sim._plant import ffi, lib

POWER_STEP_MS: int = lib.CANOPY_SIM_POWER_STEP_MS
"""Length of a step of the power part in the robot's time, profile `paper` [ms]."""

POSTURE_STEP_MS: int = lib.CANOPY_SIM_POSTURE_STEP_MS
"""Length of a step of the posture part in the robot's time, profile `paper` [ms]."""


class Profile(IntEnum):
    """Whose numbers: the paper's equations, or a NAO's documented figures."""

    paper = lib.CANOPY_SIM_PROFILE_PAPER
    nao = lib.CANOPY_SIM_PROFILE_NAO


class PowerMode(IntEnum):
    """What the power part is told to do. Names are those of the DBC's value table."""

    Stop = lib.CANOPY_SIM_POWER_STOP
    DoTask = lib.CANOPY_SIM_POWER_DO_TASK
    DriveToCharger = lib.CANOPY_SIM_POWER_DRIVE_TO_CHARGER
    Charge = lib.CANOPY_SIM_POWER_CHARGE


class PostureMode(IntEnum):
    """What the legs are told to do. Names are those of the DBC's value table; a small robot's has the first four."""

    Stop = lib.CANOPY_SIM_LEGS_STOP
    SitUp = lib.CANOPY_SIM_LEGS_SIT_UP
    StandUp = lib.CANOPY_SIM_LEGS_STAND_UP
    WalkHome = lib.CANOPY_SIM_LEGS_WALK_HOME
    SitDown = lib.CANOPY_SIM_LEGS_SIT_DOWN
    LieDown = lib.CANOPY_SIM_LEGS_LIE_DOWN
    BackOff = lib.CANOPY_SIM_LEGS_BACK_OFF
    ApproachBall = lib.CANOPY_SIM_LEGS_APPROACH_BALL


class ArmsMode(IntEnum):
    """What the arms are told to do."""

    Stop = lib.CANOPY_SIM_ARMS_STOP
    Wave = lib.CANOPY_SIM_ARMS_WAVE
    Grasp = lib.CANOPY_SIM_ARMS_GRASP
    Throw = lib.CANOPY_SIM_ARMS_THROW


class Words(IntEnum):
    """What the robot can say."""

    Nothing = lib.CANOPY_SIM_SAY_NOTHING
    Ouch = lib.CANOPY_SIM_SAY_OUCH
    WhatToDo = lib.CANOPY_SIM_SAY_WHAT_TO_DO
    Goodbye = lib.CANOPY_SIM_SAY_GOODBYE


class Wish(IntEnum):
    """What people can wish of the robot."""

    Nothing = lib.CANOPY_SIM_WISH_NOTHING
    Sit = lib.CANOPY_SIM_WISH_SIT
    StandUp = lib.CANOPY_SIM_WISH_STAND_UP
    Sleep = lib.CANOPY_SIM_WISH_SLEEP
    SayGoodbye = lib.CANOPY_SIM_WISH_SAY_GOODBYE
    BallGame = lib.CANOPY_SIM_WISH_BALL_GAME


class Pose(IntEnum):
    """How the robot is."""

    Moving = lib.CANOPY_SIM_IS_MOVING
    Stand = lib.CANOPY_SIM_IS_STANDING
    Sit = lib.CANOPY_SIM_IS_SITTING
    LyingBack = lib.CANOPY_SIM_IS_ON_BACK
    LyingBelly = lib.CANOPY_SIM_IS_ON_BELLY


class Hand(IntEnum):
    """What the hand has of the ball."""

    Empty = lib.CANOPY_SIM_HAND_EMPTY
    Holds = lib.CANOPY_SIM_HAND_HOLDS
    Threw = lib.CANOPY_SIM_HAND_THREW


class ActState(IntEnum):
    """How far speech or the arms are with their order."""

    Idle = lib.CANOPY_SIM_ACT_IDLE
    Busy = lib.CANOPY_SIM_ACT_BUSY
    Done = lib.CANOPY_SIM_ACT_DONE


@dataclass(frozen=True)
class Command:
    """What the robot is told to do; numbers of orders are 0..255."""

    power: int = 0
    legs: int = 0
    arms: int = 0
    say: int = 0
    arms_number: int = 0
    say_number: int = 0
    track_ball: int = 0


class Plant:
    """One NAO. Begins where the paper's examples begin, or as canopy_sim_robot_init() says."""

    def __init__(self, profile: Profile = Profile.paper, seed: int = 1, *, address: int | None = None) -> None:
        """Makes a robot.

        Args:
            profile: Whose numbers.
            seed: Of its chances, 0..2^32 - 1.
            address: Of a canopy_sim_robot_t in this process, which is then shown and not made; it must stay.
        """
        self._robot = ffi.new("canopy_sim_robot_t *") if address is None else ffi.cast("canopy_sim_robot_t *", address)
        self._command = ffi.new("canopy_sim_command_t *")
        self._power = ffi.addressof(self._robot, "nao", "power")
        self._posture = ffi.addressof(self._robot, "nao", "posture")
        if address is None:
            self.reset(profile, seed)

    def reset(self, profile: Profile, seed: int) -> None:
        """A new robot in the place of this one."""
        lib.canopy_sim_robot_init(self._robot, profile, seed)

    def set_power(self, distance_nm: int, battery: int) -> None:
        """Sets the distance to the charger [nm] and the charge of the battery [0.1 %].

        Raises:
            ValueError: A value is out of range; nothing was changed.
        """
        if not lib.canopy_sim_robot_set_power(self._robot, distance_nm, battery):
            raise ValueError(
                f"distance {distance_nm / 1e9} m (-10..200) or battery {battery / 10} % (0..110) out of range"
            )

    def set_posture(self, head_x_mm: int, head_height_mm: int) -> None:
        """Sets the head's distance from home and its height [mm].

        Raises:
            ValueError: A value is out of range; nothing was changed.
        """
        if not lib.canopy_sim_robot_set_posture(self._robot, head_x_mm, head_height_mm):
            raise ValueError(
                f"head at {head_x_mm / 1e3} m (-10..10), {head_height_mm / 1e3} m high (0..2) out of range"
            )

    def set_ball(self, distance_mm: int) -> None:
        """Puts the ball on the floor, so far away [mm].

        Raises:
            ValueError: Out of range; nothing was changed.
        """
        if not lib.canopy_sim_robot_set_ball(self._robot, distance_mm):
            raise ValueError(f"ball {distance_mm / 1e3} m away (0..5) out of range")

    def step(self, command: Command) -> None:
        """One step of the whole robot, as long as its profile says."""
        told = self._command
        told.power, told.legs, told.arms, told.say = command.power, command.legs, command.arms, command.say
        told.arms_number, told.say_number = command.arms_number, command.say_number
        told.track_ball = bool(command.track_ball)
        lib.canopy_sim_robot_step(self._robot, told)

    def step_power(self, mode: int) -> None:
        """One step of 10 s of the paper's power part alone."""
        lib.canopy_sim_power_step(self._power, mode)

    def step_posture(self, mode: int) -> None:
        """One step of 1 s of the paper's posture part alone."""
        lib.canopy_sim_posture_step(self._posture, mode)

    def push_over(self) -> None:
        """Somebody pushes the robot over."""
        lib.canopy_sim_robot_push_over(self._robot)

    def say(self, wish: Wish) -> None:
        """Somebody says what the robot should do. Raises ValueError for Nothing."""
        if not lib.canopy_sim_robot_say(self._robot, wish):
            raise ValueError("a wish for nothing is none")

    def press_chest(self) -> None:
        """Somebody presses the button on the chest: the wish after the last one."""
        lib.canopy_sim_robot_press_chest(self._robot)

    def press_toes(self, toes: int, ms: int) -> None:
        """Toe bumpers, bits 0..3, are pressed: for `ms`, or with 0 until the robot has backed off."""
        lib.canopy_sim_robot_press_toes(self._robot, toes & 0xF, ms)

    def drain(self, battery: int) -> None:
        """The battery has only so much charge left [0.1 %]. Raises ValueError: not within 0..1000."""
        if not lib.canopy_sim_robot_drain(self._robot, battery):
            raise ValueError(f"battery {battery / 10} % (0..100) out of range")

    def plug(self, is_plugged: bool) -> None:
        """Somebody puts the charger's plug in, or pulls it."""
        lib.canopy_sim_robot_plug(self._robot, is_plugged)

    def overheat(self) -> None:
        """The legs are as hot as 85 °C."""
        lib.canopy_sim_robot_overheat(self._robot)

    def drop_ball(self) -> None:
        """Whatever is in the hand falls."""
        lib.canopy_sim_robot_drop_ball(self._robot)

    @property
    def raw(self) -> Any:
        """The canopy_sim_robot_t; to be read only."""
        return self._robot

    @property
    def profile(self) -> Profile:
        """Whose numbers."""
        return Profile(self._robot.profile)

    @property
    def step_ms(self) -> int:
        """Length of a step of the whole robot in its time [ms]."""
        return int(self._robot.figures.step_ms)

    @property
    def plugged(self) -> bool:
        """At the charger, and the charger has mains."""
        return bool(lib.canopy_sim_robot_is_plugged(self._robot))

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
