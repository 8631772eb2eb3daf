# SPDX-License-Identifier: MIT
"""The robot: commands in, freshness, steps of the plant, sensors out. Knows neither the bus nor the clock.

A command is obeyed from the frame that brought it until its message's timeout has passed; then, and before the first
one, the robot acts on the safe values (Stop). Times are seconds of any monotonic clock, handed in.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import can

from canopy_sim.deeds import Deed, Kind, do
from canopy_sim.events import Event, Watcher
from canopy_sim.frames import REFUSALS, CommandMessage, FrameRefusedError
from canopy_sim.messages import RobotMessages
from canopy_sim.plant import POSTURE_STEP_MS, POWER_STEP_MS, Command, Plant, PostureMode, PowerMode

POWER_EVERY = POWER_STEP_MS // POSTURE_STEP_MS
"""Steps of the posture part in one step of the power part, in the robot's time."""

PHASES_MAX = 10_000
"""Of those the last ones are kept: a run of days must not fill the memory."""


@dataclass(frozen=True)
class RobotState:
    """What the robot shows to people: battery [%], lengths [m]. More of it is in robot_state_t."""

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
        self._accepted = message.safe
        self._deadline = math.inf
        self._new = False
        self.valid = False
        self.timeouts = 0

    @property
    def values(self) -> dict[str, int]:
        """What is to be done now."""
        return self._accepted if self.valid else self._message.safe

    def accept(self, values: dict[str, int], now: float) -> None:
        self._accepted = values
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
    """One NAO on the bus: a small one (Examples 4 and 5) or a whole one, as the DBC has it. Counters only grow."""

    def __init__(self, messages: RobotMessages, plant: Plant) -> None:
        self._messages = messages
        self.plant = plant
        self._power = _Command(messages.power_command)
        self._posture = _Command(messages.posture_command)
        self._upper = None if messages.upper_command is None else _Command(messages.upper_command)
        self._commands = [self._power, self._posture, *([] if self._upper is None else [self._upper])]
        self._takers: dict[int, Callable[[can.Message, float], None]] = {
            one.arbitration_id: self._taker(one, command)
            for one, command in (
                (messages.power_command, self._power),
                (messages.posture_command, self._posture),
                (messages.upper_command, self._upper),
            )
            if one is not None and command is not None
        }
        self.watcher = Watcher(plant)
        self.sending = True
        """Sensor frames are to be sent."""
        self.steps = 0
        self.minimum_battery = plant.battery
        """Least charge seen [0.1 %]."""
        self.phases: list[tuple[str, str, int]] = []
        """Modes of power and legs, and for how many steps in a row; the last PHASES_MAX."""
        self.accepted = 0
        self.refused: Counter[str] = Counter(dict.fromkeys(REFUSALS, 0))
        self.ignored = 0
        """Frames of the DBC and of the trace that the robot has no use for."""
        self.unknown = 0
        """Frames with other ids."""
        self.error_frames = 0

    @staticmethod
    def _taker(message: CommandMessage, command: _Command) -> Callable[[can.Message, float], None]:
        return lambda frame, now: command.accept(message.unpack(frame), now)

    @property
    def is_whole(self) -> bool:
        """Not only Examples 4 and 5."""
        return self._messages.is_whole

    @property
    def step_ms(self) -> int:
        """Length of a step in the robot's time [ms]."""
        return self.plant.step_ms if self.is_whole else POSTURE_STEP_MS

    @property
    def time_ms(self) -> int:
        """The robot's clock [ms]; of a small robot that of its posture part."""
        return int(self.plant.raw.time_ms) if self.is_whole else self.steps * POSTURE_STEP_MS

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
        is_tick = False
        taker = self._takers.get(frame.arbitration_id)
        if taker is not None:
            taker(frame, now)
        elif frame.arbitration_id == self._messages.tick.arbitration_id:
            self._messages.tick.check(frame)
            is_tick = True
        else:
            known = frame.arbitration_id in self._messages.known_ids
            self.ignored += known
            self.unknown += not known
            return False
        self.accepted += 1
        return is_tick

    def expire(self, now: float) -> None:
        """Lets commands go whose timeout has passed."""
        for command in self._commands:
            command.expire(now)

    def lock_step(self, now: float) -> None:
        """One step with the commands that came since the last one; of a small robot, one of each part."""
        for command in self._commands:
            command.begin_lock_step(now)
        self._step(with_power=True)

    def real_time_step(self, now: float) -> None:
        """One step; of a small robot's power part, one every POWER_EVERY."""
        self.expire(now)
        self._step(with_power=(self.steps + 1) % POWER_EVERY == 0)

    @property
    def command(self) -> Command:
        """What the robot acts on now."""
        upper = {} if self._upper is None else self._upper.values
        return Command(
            power=self._power.values["Mode"],
            legs=self._posture.values["Mode"],
            arms=upper.get("Arms", 0),
            say=upper.get("Say", 0),
            arms_number=upper.get("ArmsNumber", 0),
            say_number=upper.get("SayNumber", 0),
            track_ball=upper.get("TrackBall", 0),
        )

    def _step(self, with_power: bool) -> None:
        command = self.command
        if self.is_whole:
            self.plant.step(command)
        else:
            if with_power:
                self.plant.step_power(command.power)
            self.plant.step_posture(command.legs)
        self.steps += 1
        self.minimum_battery = min(self.minimum_battery, self.plant.battery)
        self._note_phase(PowerMode(command.power).name, PostureMode(command.legs).name)
        if self.is_whole:
            self.watcher.look(command)

    def _note_phase(self, power: str, legs: str) -> None:
        count = 1
        if self.phases and self.phases[-1][:2] == (power, legs):
            count += self.phases.pop()[2]
        elif len(self.phases) >= PHASES_MAX:
            del self.phases[0]
        self.phases.append((power, legs, count))

    def frame(self, message: str) -> can.Message:
        """The next frame of one of the sensors."""
        sensor, outgoing = self._messages.sensors[message]
        return outgoing.frame(sensor.show(self.plant))

    def execute(self, deed: Deed) -> None:
        """Does what a person at a desk wants.

        Raises:
            ValueError: A value is out of range, or this robot has no such part; nothing was changed.
        """
        if deed.kind in (Kind.STOP_SENDING, Kind.RESUME_SENDING):
            self.sending = deed.kind is Kind.RESUME_SENDING
            return
        do(self.plant, deed, is_whole=self.is_whole)
        if deed.kind is Kind.RESET:
            self.minimum_battery = self.plant.battery
            self.phases.clear()
        self.minimum_battery = min(self.minimum_battery, self.plant.battery)

    def events(self) -> list[Event]:
        """What has happened since the last call, in words."""
        return self.watcher.take()

    @property
    def timeouts(self) -> int:
        """How often a command has become too old."""
        return sum(command.timeouts for command in self._commands)

    @property
    def state(self) -> RobotState:
        """The state now."""
        command = self.command
        return RobotState(
            step=self.steps,
            battery=self.plant.battery / 10,
            charger_distance=self.plant.distance_nm / 1e9,
            head_x=self.plant.head_x_mm / 1e3,
            head_height=self.plant.head_height_mm / 1e3,
            charging=self.plant.charging,
            power_mode=PowerMode(command.power),
            posture_mode=PostureMode(command.legs),
            stopped=not any(command.valid for command in self._commands),
            sending=self.sending,
        )
