# SPDX-License-Identifier: MIT
"""The robot as a process on a CAN bus: one thread, one loop, two ways to run it.

Lock-step: the robot sends its sensors and SimulationStep(k), waits for the controller's CanopyTick, makes one step of
the plant with the commands that came before it, and goes on with k + 1, as fast as both programs can; the plant makes
as many steps as the controller makes ticks. Real time: frames at their cycle times, steps of the plant on the robot's
clock, which runs `factor` times as fast as the wall's.

Everything cyclic has absolute deadlines, so lateness does not add up; what comes more than a period late is skipped and
counted as a slip, never sent in a burst.

A person at a desk may let the robot's clock stand, let it make single steps, and in real time change its speed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import can

from canopy_sim.deeds import CLOCK, Deed, Kind
from canopy_sim.lcm_side import LcmSide
from canopy_sim.messages import RobotMessages
from canopy_sim.robot import Robot
from canopy_sim.timetable import Event

LONGEST_WAIT = 0.05
"""Most time in one wait for a frame [s]: how soon a signal or an LCM command is seen on a silent bus."""

LCM_PERIOD = 0.01
"""Least time between two looks at LCM [s]."""

STATE_PERIOD = 0.05
"""Real time: cycle of the published state [s]."""

HEALTH_PERIOD = 1.0
"""Cycle of the published health [s]."""

SHORTEST_PERIOD = 0.004
"""Real time: where the robot's steps are shorter, several are made at once [s]."""

FASTEST = 1000.0
"""Of the robot's clock, in real time."""

STEPS_MAX = 1_000_000
"""In one STEP of a desk."""

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
        timetable: What happens to the robot at which time of its clock, the earliest first.
    """

    bus: can.BusABC
    messages: RobotMessages
    robot: Robot
    lcm_side: LcmSide | None = None
    steps: int | None = None
    timetable: list[Event] = field(default_factory=list)
    sent: int = 0
    dropped: int = 0
    """Frames that found the bus's transmit buffer full, or the bus away, or that the system could not send."""
    received: int = 0
    slips: int = 0
    """Real time: cycles skipped because the process came more than a period late."""
    repeats: int = 0
    """Lock-step: how often a step was sent again because nobody answered."""
    factor: float = 0.0
    """Real time: how much faster than the wall's the robot's clock runs; 0: lock-step."""
    paused: bool = False
    allowed: int = 0
    """While paused: steps that a desk still wants."""
    _stop: bool = field(default=False, init=False)
    _next_poll: float = field(default=0.0, init=False)
    _next_health: float = field(default=0.0, init=False)
    _old_slips: int = field(default=0, init=False)
    _timers: list[_Timer] = field(default_factory=list, init=False)

    def stop(self) -> None:
        """Ends the loop within LONGEST_WAIT; may be called from a signal handler."""
        self._stop = True

    def execute(self, deed: Deed) -> None:
        """Does what a desk wants: of the clock here, the rest is the robot's.

        Raises:
            ValueError: It cannot be done; nothing was changed.
        """
        if deed.kind not in CLOCK:
            self.robot.execute(deed)
        elif deed.kind is Kind.STEP:
            if not 1 <= deed.number <= STEPS_MAX:
                raise ValueError(f"{deed.number} steps are out of range (1..{STEPS_MAX})")
            self.paused, self.allowed = True, self.allowed + deed.number
        elif deed.kind is Kind.SPEED:
            if self.factor == 0 or not 0 < deed.speed <= FASTEST:
                raise ValueError(f"speed {deed.speed}: in real time it is above 0 and at most {FASTEST:g}")
            self.factor = deed.speed
            self._start_timers(time.monotonic())
        else:
            self.paused, self.allowed = deed.kind is Kind.PAUSE, 0

    @property
    def _ended(self) -> bool:
        return self._stop or (self.steps is not None and self.robot.steps >= self.steps)

    @property
    def _stands(self) -> bool:
        return self.paused and self.allowed == 0

    def _after_step(self) -> None:
        self.allowed -= self.allowed > 0
        while self.timetable and self.timetable[0][0] <= self.robot.time_ms:
            self.robot.execute(self.timetable.pop(0)[1])

    def run_lock_step(self) -> None:
        """Runs until stop(), or the last step.

        Raises:
            BusGoneError: The bus does not work any more.
        """
        number = 0
        silent = 0
        while not self._ended:
            if self._stands:
                self._idle()
                continue
            self._send_lock_step(number)
            self._publish()
            if self._await_tick(time.monotonic() + REPEAT_AFTER):
                self.robot.lock_step(time.monotonic())
                self._after_step()
                number += 1
                silent = 0
            elif not self._ended:
                self.repeats += 1
                silent += 1
                number += silent % RENUMBER_AFTER == 0
        self._publish()

    def _idle(self) -> None:
        """Lock-step, while the clock stands: nothing is sent, and the controller waits."""
        now = time.monotonic()
        self._poll_lcm(now)
        frame = self._receive(LCM_PERIOD)
        if frame is not None:
            self.robot.receive(frame, now)

    def _send_lock_step(self, number: int) -> None:
        if self.robot.sending:
            for name in self.messages.sensors:
                self._send(self.robot.frame(name))
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

    def _start_timers(self, start: float) -> None:
        """Real time: all that is cyclic, from now on; the robot's steps at its factor."""
        self._old_slips += sum(timer.slips for timer in self._timers)
        step_period = self.robot.step_ms / 1e3 / self.factor
        at_once = max(1, round(SHORTEST_PERIOD / step_period))
        self._timers = [
            _Timer(at_once * step_period, lambda now: self._make_steps(at_once, now), start + at_once * step_period),
            *(
                _Timer(outgoing.cycle, self._sender(name), start)
                for name, (_, outgoing) in self.messages.sensors.items()
            ),
            _Timer(STATE_PERIOD, lambda _: self._publish(), start),
        ]

    def _make_steps(self, steps: int, now: float) -> None:
        for _ in range(steps):
            if self._stands or self._ended:
                return
            self.robot.real_time_step(now)
            self._after_step()

    def _sender(self, name: str) -> Callable[[float], None]:
        def send(_now: float) -> None:
            if self.robot.sending:
                self._send(self.robot.frame(name))

        return send

    def run_real_time(self, factor: float) -> None:
        """Runs until stop(), or the last step.

        Args:
            factor: How much faster than the wall's the robot's clock runs.

        Raises:
            BusGoneError: The bus does not work any more.
        """
        self.factor = factor
        self._start_timers(time.monotonic())
        while not self._ended:
            now = time.monotonic()
            self._poll_lcm(now)
            timer = min(self._timers, key=lambda timer: timer.due)
            if timer.due <= now:
                timer.run(now)
                self.slips = self._old_slips + sum(timer.slips for timer in self._timers)
                continue
            frame = self._receive(min(timer.due - now, LONGEST_WAIT))
            now = time.monotonic()
            if frame is not None:
                self.robot.receive(frame, now)
            self.robot.expire(now)
        self._publish()

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
        events = self.robot.events()
        if self.lcm_side is not None:
            self.lcm_side.publish(self.robot, 0.0 if self._stands else self.factor)
            for event in events:
                self.lcm_side.tell(event)

    def _poll_lcm(self, now: float) -> None:
        if self.lcm_side is None or now < self._next_poll:
            return
        self._next_poll = now + LCM_PERIOD
        if self.lcm_side.poll():
            self._publish()
        if now >= self._next_health:
            self._next_health = now + HEALTH_PERIOD
            self.lcm_side.publish_health(self.health())

    def health(self) -> dict[str, int]:
        """Counters, by the names of robot_health_t."""
        return {
            "sent": self.sent,
            "dropped": self.dropped,
            "received": self.received,
            "refused": sum(self.robot.refused.values()),
            "unknown": self.robot.unknown,
            "timeouts": self.robot.timeouts,
            "slips": self.slips,
            "repeats": self.repeats,
        }
