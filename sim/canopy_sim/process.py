# SPDX-License-Identifier: MIT
"""The robot as a process on a CAN bus: one thread, one loop, two ways to run it.

Lock-step: the robot sends its sensors and SimulationStep(k), waits for the controller's CanopyTick, makes one step of
the plant with the commands that came before it, and goes on with k + 1, as fast as both programs can; the plant makes
as many steps as the controller makes ticks. Real time: frames at their cycle times, steps of the plant on the robot's
clock, which runs `factor` times as fast as the wall's.

Everything cyclic has absolute deadlines, so lateness does not add up; what comes more than a period late is skipped and
counted as a slip, never sent in a burst.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import can

from canopy_sim.lcm_side import LcmSide
from canopy_sim.messages import RobotMessages
from canopy_sim.plant import POSTURE_STEP_MS
from canopy_sim.robot import Robot

LONGEST_WAIT = 0.05
"""Most time in one wait for a frame [s]: how soon a signal or an LCM command is seen on a silent bus."""

LCM_PERIOD = 0.01
"""Least time between two looks at LCM [s]."""

STATE_PERIOD = 0.05
"""Real time: cycle of the published state [s]."""

REPEAT_AFTER = 0.25
"""Lock-step: without an answer for this long, sensors and SimulationStep are sent again [s]."""

RENUMBER_AFTER = 8
"""Lock-step: repeats of one step without an answer, after which the step gets a new number.

A controller answers a number once. When that answer was lost, or the simulator was started again at the number that it
had left off at, no repeat would ever be answered.
"""


class BusGoneError(Exception):
    """The bus has failed in a way that waiting does not mend."""


@dataclass
class _Timer:
    """Something cyclic: `action` at its first due time, and every period from then on."""

    period: float
    action: Callable[[float], None]
    due: float
    slips: int = 0

    def run(self, now: float) -> None:
        self.action(now)
        self.due += self.period
        if self.due < now - self.period:
            missed = int((now - self.due) // self.period)
            self.due += missed * self.period
            self.slips += missed


@dataclass
class Simulation:
    """One robot on one bus. Counters only grow.

    Args:
        bus: An open bus.
        messages: Those the robot was made with.
        robot: The robot.
        lcm_side: None: without LCM.
        steps: End after so many steps of the plant; None: only stop() ends it.
    """

    bus: can.BusABC
    messages: RobotMessages
    robot: Robot
    lcm_side: LcmSide | None = None
    steps: int | None = None
    sent: int = 0
    dropped: int = 0
    """Frames that found the bus's transmit buffer full, or the bus away, or that the system could not send."""
    received: int = 0
    slips: int = 0
    """Real time: cycles skipped because the process came more than a period late."""
    repeats: int = 0
    """Lock-step: how often a step was sent again because nobody answered."""
    _stop: bool = field(default=False, init=False)
    _next_poll: float = field(default=0.0, init=False)

    def stop(self) -> None:
        """Ends the loop within LONGEST_WAIT; may be called from a signal handler."""
        self._stop = True

    @property
    def _ended(self) -> bool:
        return self._stop or (self.steps is not None and self.robot.steps >= self.steps)

    def run_lock_step(self) -> None:
        """Runs until stop(), or the last step.

        Raises:
            BusGoneError: The bus does not work any more.
        """
        number = 0
        silent = 0
        while not self._ended:
            self._send_lock_step(number)
            self._publish()
            if self._await_tick(time.monotonic() + REPEAT_AFTER):
                self.robot.lock_step(time.monotonic())
                number += 1
                silent = 0
            elif not self._ended:
                self.repeats += 1
                silent += 1
                number += silent % RENUMBER_AFTER == 0
        self._publish()

    def _send_lock_step(self, number: int) -> None:
        if self.robot.sending:
            self._send(self.robot.battery_frame())
            self._send(self.robot.posture_frame())
        self._send(self.messages.simulation_step.frame({"Step": number % 2**32}))

    def _await_tick(self, deadline: float) -> bool:
        """Waits for CanopyTick until the deadline [s, monotonic]; False: it did not come."""
        while not self._stop:
            now = time.monotonic()
            self._poll_lcm(now)
            frame = self._receive(min(max(deadline - now, 0.0), LONGEST_WAIT))
            now = time.monotonic()
            if frame is not None and self.robot.receive(frame, now):
                return True
            self.robot.expire(now)
            if now >= deadline:  # on a bus full of other frames too
                break
        return False

    def run_real_time(self, factor: float) -> None:
        """Runs until stop(), or the last step.

        Args:
            factor: How much faster than the wall's the robot's clock runs.

        Raises:
            BusGoneError: The bus does not work any more.
        """
        start = time.monotonic()
        step_period = POSTURE_STEP_MS / 1e3 / factor
        timers = [
            _Timer(step_period, self.robot.real_time_step, start + step_period),
            _Timer(self.messages.battery.cycle, lambda _: self._send_sensor(self.robot.battery_frame), start),
            _Timer(self.messages.posture.cycle, lambda _: self._send_sensor(self.robot.posture_frame), start),
            _Timer(STATE_PERIOD, lambda _: self._publish(), start),
        ]
        while not self._ended:
            now = time.monotonic()
            self._poll_lcm(now)
            timer = min(timers, key=lambda timer: timer.due)
            if timer.due <= now:
                timer.run(now)
                self.slips = sum(timer.slips for timer in timers)
                continue
            frame = self._receive(min(timer.due - now, LONGEST_WAIT))
            now = time.monotonic()
            if frame is not None:
                self.robot.receive(frame, now)
            self.robot.expire(now)
        self._publish()

    def _send_sensor(self, make: Callable[[], can.Message]) -> None:
        if self.robot.sending:
            self._send(make())

    def _send(self, frame: can.Message) -> None:
        try:
            self.bus.send(frame)
        except can.CanError as error:
            # An error of the system passes: the next frame may do better. Without one, no bus can carry the frame.
            if error.error_code is None and "buffer full" not in str(error):
                raise BusGoneError(f"cannot send on {self.bus.channel_info}: {error}") from error
            self.dropped += 1
        except OSError as error:
            raise BusGoneError(f"cannot send on {self.bus.channel_info}: {error}") from error
        else:
            self.sent += 1

    def _receive(self, timeout: float) -> can.Message | None:
        try:
            frame = self.bus.recv(timeout)
        except (can.CanError, OSError) as error:
            raise BusGoneError(f"cannot receive on {self.bus.channel_info}: {error}") from error
        self.received += frame is not None
        return frame

    def _publish(self) -> None:
        if self.lcm_side is not None:
            self.lcm_side.publish(self.robot.state)

    def _poll_lcm(self, now: float) -> None:
        if self.lcm_side is not None and now >= self._next_poll:
            self._next_poll = now + LCM_PERIOD
            if self.lcm_side.poll():
                self._publish()
