# SPDX-License-Identifier: MIT
"""The robot: commands in, freshness, steps of the plant, sensors out. Knows neither the bus nor the clock.

A command is obeyed from the frame that brought it until its message's timeout has passed; then, and before the first
one, the robot acts on the safe value (Stop). Times are seconds of any monotonic clock, handed in.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction

import can

from canopy_sim.messages import REFUSALS, CommandMessage, FrameRefusedError, RobotMessages
from canopy_sim.plant import POSTURE_STEP_MS, POWER_STEP_MS, Plant, PostureMode, PowerMode

POWER_EVERY = POWER_STEP_MS // POSTURE_STEP_MS
"""Steps of the posture part in one step of the power part, in the robot's time."""


LARGEST_VALUE = 1e6
"""No quantity of a DeskCommand comes near it; what is below fits into the plant's integers, which then look closer."""


class CommandKind(IntEnum):
    """What a person at a desk can do to the robot; the numbers are those of robot_command_t."""

    SET_STATE = 0
    PUSH_OVER = 1
    STOP_SENDING = 2
    RESUME_SENDING = 3


@dataclass(frozen=True)
class DeskCommand:
    """One robot_command_t. Values: battery [%], the others [m]; NaN: leave as it is."""

    kind: CommandKind
    battery: float = math.nan
    charger_distance: float = math.nan
    head_x: float = math.nan
    head_height: float = math.nan


@dataclass(frozen=True)
class RobotState:
    """What the robot shows to people: battery [%], lengths [m]."""

    step: int
    battery: float
    charger_distance: float
    head_x: float
    head_height: float
    charging: bool
    power_mode: PowerMode
    posture_mode: PostureMode
    stopped: bool
    sending: bool


class _Command:
    """The last command of one message, and whether it still holds."""

    def __init__(self, message: CommandMessage) -> None:
        self._message = message
        self._accepted = message.safe_mode
        self._deadline = math.inf
        self._new = False
        self.valid = False
        self.timeouts = 0

    @property
    def mode(self) -> int:
        """What is to be done now."""
        return self._accepted if self.valid else self._message.safe_mode

    def accept(self, mode: int, now: float) -> None:
        self._accepted = mode
        self._deadline = math.inf if self._message.timeout is None else now + self._message.timeout
        self._new = self.valid = True

    def expire(self, now: float) -> None:
        if self.valid and now >= self._deadline:
            self.valid = False
            self.timeouts += 1

    def begin_lock_step(self, now: float) -> None:
        """What came for this step holds for this step, however long this process was held up in between."""
        if self._new:
            self.valid = True
        else:
            self.expire(now)
        self._new = False


class Robot:
    """One NAO on the bus. Counters only grow."""

    def __init__(self, messages: RobotMessages, plant: Plant) -> None:
        self._messages = messages
        self._plant = plant
        self._power = _Command(messages.power_command)
        self._posture = _Command(messages.posture_command)
        self.sending = True
        """Sensor frames are to be sent."""
        self.steps = 0
        self.minimum_battery = plant.battery
        """Least charge seen [0.1 %]."""
        self.phases: list[tuple[str, str, int]] = []
        """Modes of both parts, and for how many steps in a row."""
        self.accepted = 0
        self.refused: Counter[str] = Counter(dict.fromkeys(REFUSALS, 0))
        self.ignored = 0
        """Frames of the DBC and of the trace that the robot has no use for."""
        self.unknown = 0
        """Frames with other ids."""
        self.error_frames = 0

    def receive(self, frame: can.Message, now: float) -> bool:
        """Takes one frame from the bus; whatever is wrong with it changes a counter only.

        Returns:
            True when it was an accepted CanopyTick: the controller's commands of this tick are complete.
        """
        if frame.is_error_frame:
            self.error_frames += 1
            return False
        try:
            return self._obey(frame, now)
        except FrameRefusedError as refusal:
            self.refused[refusal.reason] += 1
            return False

    def _obey(self, frame: can.Message, now: float) -> bool:
        messages = self._messages
        if frame.arbitration_id == messages.power_command.arbitration_id:
            self._power.accept(messages.power_command.unpack(frame)["Mode"], now)
        elif frame.arbitration_id == messages.posture_command.arbitration_id:
            self._posture.accept(messages.posture_command.unpack(frame)["Mode"], now)
        elif frame.arbitration_id == messages.tick.arbitration_id:
            messages.tick.check(frame)
        else:
            known = frame.arbitration_id in messages.known_ids
            self.ignored += known
            self.unknown += not known
            return False
        self.accepted += 1
        return frame.arbitration_id == messages.tick.arbitration_id

    def expire(self, now: float) -> None:
        """Lets commands go whose timeout has passed."""
        self._power.expire(now)
        self._posture.expire(now)

    def lock_step(self, now: float) -> None:
        """One step of both parts, with the commands that came since the last one."""
        self._power.begin_lock_step(now)
        self._posture.begin_lock_step(now)
        self._step(with_power=True)

    def real_time_step(self, now: float) -> None:
        """One step of the posture part, and one of the power part every POWER_EVERY."""
        self.expire(now)
        self._step(with_power=(self.steps + 1) % POWER_EVERY == 0)

    def _step(self, with_power: bool) -> None:
        power, posture = PowerMode(self._power.mode), PostureMode(self._posture.mode)
        if with_power:
            self._plant.step_power(power)
        self._plant.step_posture(posture)
        self.steps += 1
        self.minimum_battery = min(self.minimum_battery, self._plant.battery)
        count = 1
        if self.phases and self.phases[-1][:2] == (power.name, posture.name):
            count += self.phases.pop()[2]
        self.phases.append((power.name, posture.name, count))

    def battery_frame(self) -> can.Message:
        """The next frame of Battery."""
        return self._messages.battery.frame(
            {
                "Charging": int(self._plant.charging),
                "Level": Fraction(self._plant.battery, 10),
                "ChargerDistance": Fraction(self._plant.distance_mm, 1000),
            }
        )

    def posture_frame(self) -> can.Message:
        """The next frame of Posture."""
        return self._messages.posture.frame(
            {
                "HeadX": Fraction(self._plant.head_x_mm, 1000),
                "HeadHeight": Fraction(self._plant.head_height_mm, 1000),
            }
        )

    def execute(self, command: DeskCommand) -> None:
        """Does what a person at a desk wants.

        Raises:
            ValueError: A value is out of range; nothing was changed.
        """
        if command.kind is CommandKind.SET_STATE:
            self._set_state(command)
        elif command.kind is CommandKind.PUSH_OVER:
            self._plant.push_over()
        else:
            self.sending = command.kind is CommandKind.RESUME_SENDING

    def _set_state(self, command: DeskCommand) -> None:
        plant = self._plant
        distance = _units(command.charger_distance, 1e9, plant.distance_nm)
        battery = _units(command.battery, 10, plant.battery)
        head_x = _units(command.head_x, 1e3, plant.head_x_mm)
        head_height = _units(command.head_height, 1e3, plant.head_height_mm)
        before = plant.head_x_mm, plant.head_height_mm
        plant.set_posture(head_x, head_height)
        if (distance, battery) != (plant.distance_nm, plant.battery):
            try:
                plant.set_power(distance, battery)
            except ValueError:
                plant.set_posture(*before)
                raise
        self.minimum_battery = min(self.minimum_battery, plant.battery)

    @property
    def timeouts(self) -> int:
        """How often a command has become too old."""
        return self._power.timeouts + self._posture.timeouts

    @property
    def state(self) -> RobotState:
        """The state now."""
        return RobotState(
            step=self.steps,
            battery=self._plant.battery / 10,
            charger_distance=self._plant.distance_nm / 1e9,
            head_x=self._plant.head_x_mm / 1e3,
            head_height=self._plant.head_height_mm / 1e3,
            charging=self._plant.charging,
            power_mode=PowerMode(self._power.mode),
            posture_mode=PostureMode(self._posture.mode),
            stopped=not (self._power.valid or self._posture.valid),
            sending=self.sending,
        )


def _units(value: float, per_unit: float, otherwise: int) -> int:
    """A number in the plant's units, to the nearest; NaN gives `otherwise`.

    Raises:
        ValueError: The number is infinite, or too large for the plant's integers.
    """
    if math.isnan(value):
        return otherwise
    if abs(value) > LARGEST_VALUE:
        raise ValueError(f"{value} is out of range")
    return round(value * per_unit)
