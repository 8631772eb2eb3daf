# SPDX-License-Identifier: MIT
"""What a person at a desk can do to the robot: one deed for each command of robot_command_t."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from canopy_sim.plant import Plant, Profile, Wish

LARGEST_VALUE = 1e6
"""No quantity of a Deed comes near it; what is below fits into the plant's integers, which then look closer."""

WHOLE_MS_MAX = 3_600_000
SEED_MAX = 2**32 - 1


class Kind(IntEnum):
    """The numbers are those of robot_command_t."""

    SET_STATE = 0
    PUSH_OVER = 1
    STOP_SENDING = 2
    RESUME_SENDING = 3
    RESET = 4
    RUN = 5
    PAUSE = 6
    STEP = 7
    SPEED = 8
    SAY = 9
    PRESS_CHEST = 10
    PRESS_TOES = 11
    DRAIN = 12
    UNPLUG = 13
    PLUG = 14
    OVERHEAT = 15
    DROP_BALL = 16


CLOCK = {Kind.RUN, Kind.PAUSE, Kind.STEP, Kind.SPEED}
"""Those that the process does, not the robot."""

OF_WHOLE = {Kind.SAY, Kind.PRESS_CHEST, Kind.PRESS_TOES, Kind.OVERHEAT, Kind.DROP_BALL}
"""Those that a small robot has no part for."""


@dataclass(frozen=True)
class Deed:
    """One robot_command_t. Values: battery [%], lengths [m]; NaN: leave as it is."""

    kind: Kind
    battery: float = math.nan
    charger_distance: float = math.nan
    head_x: float = math.nan
    head_height: float = math.nan
    ball_distance: float = math.nan
    number: int = 0
    """SAY: the wish. PRESS_TOES: bits. STEP: how many steps. RESET: the profile."""
    milliseconds: int = 0
    """PRESS_TOES: for how long; 0: until the robot has backed off."""
    seed: int = 1
    """RESET."""
    speed: float = 1.0
    """SPEED: of the robot's clock, in real time."""


def do(plant: Plant, deed: Deed, *, is_whole: bool) -> None:
    """Does it.

    Raises:
        ValueError: A value is out of range, or the robot has no part for it; nothing was changed.
    """
    if deed.kind in OF_WHOLE and not is_whole:
        raise ValueError(f"{deed.kind.name}: this bus has the small robot of Examples 4 and 5; run it with big.dbc")
    if deed.kind is Kind.SET_STATE:
        _set_state(plant, deed)
    elif deed.kind is Kind.RESET:
        _reset(plant, deed)
    elif deed.kind is Kind.SAY:
        plant.say(Wish(deed.number))
    elif deed.kind is Kind.PRESS_TOES:
        _press_toes(plant, deed)
    elif deed.kind is Kind.DRAIN:
        plant.drain(units(deed.battery, 10, 50))
    else:
        {
            Kind.PUSH_OVER: plant.push_over,
            Kind.PRESS_CHEST: plant.press_chest,
            Kind.UNPLUG: lambda: plant.plug(False),
            Kind.PLUG: lambda: plant.plug(True),
            Kind.OVERHEAT: plant.overheat,
            Kind.DROP_BALL: plant.drop_ball,
        }[deed.kind]()


def _reset(plant: Plant, deed: Deed) -> None:
    if not 0 <= deed.seed <= SEED_MAX:
        raise ValueError(f"seed {deed.seed} is out of range")
    plant.reset(Profile(deed.number), deed.seed)
    _set_state(plant, deed)


def _press_toes(plant: Plant, deed: Deed) -> None:
    if not 0 <= deed.milliseconds <= WHOLE_MS_MAX or not 0 <= deed.number <= 0xF:
        raise ValueError(f"toes {deed.number} (0..15) for {deed.milliseconds} ms (0..{WHOLE_MS_MAX}) is out of range")
    plant.press_toes(deed.number or 0xF, deed.milliseconds)


def _set_state(plant: Plant, deed: Deed) -> None:
    distance = units(deed.charger_distance, 1e9, plant.distance_nm)
    battery = units(deed.battery, 10, plant.battery)
    head_x = units(deed.head_x, 1e3, plant.head_x_mm)
    head_height = units(deed.head_height, 1e3, plant.head_height_mm)
    ball = units(deed.ball_distance, 1e3, -1)
    if ball > 5000 or (ball < 0 and not math.isnan(deed.ball_distance)):
        raise ValueError(f"ball {deed.ball_distance} m away (0..5) out of range")
    before = plant.head_x_mm, plant.head_height_mm
    if (head_x, head_height) != before:
        plant.set_posture(head_x, head_height)
    if (distance, battery) != (plant.distance_nm, plant.battery):
        try:
            plant.set_power(distance, battery)
        except ValueError:
            if (head_x, head_height) != before:
                plant.set_posture(*before)
            raise
    if ball >= 0:
        plant.set_ball(ball)


def units(value: float, per_unit: float, otherwise: int) -> int:
    """A number in the plant's units, to the nearest; NaN gives `otherwise`.

    Raises:
        ValueError: The number is infinite, or too large for the plant's integers.
    """
    if math.isnan(value):
        return otherwise
    if abs(value) > LARGEST_VALUE:
        raise ValueError(f"{value} is out of range")
    return round(value * per_unit)
