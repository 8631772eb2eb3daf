# SPDX-License-Identifier: MIT
"""What each of the robot's sensors shows: message by message, signal by signal, in physical units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from canopy_sim.plant import Plant

Shown = Mapping[str, Fraction | int]

JOINTS = ("Head", "LeftArm", "RightArm", "LeftLeg", "RightLeg")
TOES = ("ToeLeftOuter", "ToeLeftInner", "ToeRightInner", "ToeRightOuter")
ODOMETER_WRAPS = 65536
"""[mm]"""


@dataclass(frozen=True)
class Sensor:
    """A message of the robot, and what it shows."""

    message: str
    show: Callable[[Plant], Shown]
    signals: frozenset[str]
    """Those that the message must have."""
    whole: frozenset[str] = frozenset()
    """Those that it may lack in a small robot's DBC."""
    is_needed: bool = False
    """A small robot has it, too."""

    def needed(self, is_whole: bool) -> set[str]:
        """The signals that this DBC must have. What show() gives besides goes nowhere."""
        return set(self.signals | self.whole if is_whole else self.signals)


def _battery(plant: Plant) -> Shown:
    return {
        "Charging": int(plant.charging),
        "Plugged": int(plant.plugged),
        "Level": Fraction(plant.battery, 10),
        "ChargerDistance": Fraction(plant.distance_mm, 1000),
    }


def _cells(plant: Plant) -> Shown:
    return {
        "Current": Fraction(plant.raw.current_ma, 1000),
        "Temperature": Fraction(plant.raw.battery_mdeg, 1000),
    }


def _posture(plant: Plant) -> Shown:
    return {
        "HeadX": Fraction(plant.head_x_mm, 1000),
        "HeadHeight": Fraction(plant.head_height_mm, 1000),
        "Name": int(plant.raw.pose),
    }


def _touch(plant: Plant) -> Shown:
    toes = int(plant.raw.toes)
    return {
        **{name: toes >> bit & 1 for bit, name in enumerate(TOES)},
        "ChestButton": int(plant.raw.chest_button),
        "Odometer": Fraction(int(plant.raw.odometer_um) // 1000 % ODOMETER_WRAPS, 1000),
    }


def _voice(plant: Plant) -> Shown:
    return {"Count": int(plant.raw.wishes), "Suggestion": int(plant.raw.wish)}


def _ball(plant: Plant) -> Shown:
    return {
        "Tracked": int(plant.raw.tracked),
        "Hand": int(plant.raw.hand),
        "Distance": Fraction(int(plant.raw.ball_um), 1_000_000),
    }


def _acts(plant: Plant) -> Shown:
    speech, arms = plant.raw.speech, plant.raw.arms
    return {
        "SpeechState": int(speech.state),
        "ArmsState": int(arms.state),
        "Said": int(speech.what),
        "SayNumber": int(speech.number),
        "Arms": int(arms.what),
        "ArmsNumber": int(arms.number),
    }


def _joints(plant: Plant) -> Shown:
    return {name: Fraction(plant.raw.joint_mdeg[index], 1000) for index, name in enumerate(JOINTS)}


SENSORS = (
    Sensor(
        "Battery",
        _battery,
        frozenset({"Charging", "Level", "ChargerDistance"}),
        frozenset({"Plugged"}),
        is_needed=True,
    ),
    Sensor("Cells", _cells, frozenset({"Current", "Temperature"})),
    Sensor("Posture", _posture, frozenset({"HeadX", "HeadHeight"}), frozenset({"Name"}), is_needed=True),
    Sensor("Touch", _touch, frozenset({*TOES, "ChestButton", "Odometer"})),
    Sensor("Voice", _voice, frozenset({"Count", "Suggestion"})),
    Sensor("Ball", _ball, frozenset({"Tracked", "Hand", "Distance"})),
    Sensor("Acts", _acts, frozenset({"SpeechState", "ArmsState", "Said", "SayNumber", "Arms", "ArmsNumber"})),
    Sensor("Joints", _joints, frozenset(JOINTS)),
)
