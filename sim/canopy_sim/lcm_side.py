# SPDX-License-Identifier: MIT
"""The robot on LCM: its state, events and health out, a desk's commands in.

liblcm receives in a thread of its own; poll() only takes what is there, so the loop on the CAN bus never waits for LCM.
What is wrong with a packet is counted, and said once a second at most: a flood on LCM must not fill a log.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from canopy.escape.terminal import echo
from canopy.lcm_link import (
    CHANNEL_ROBOT,
    CHANNEL_ROBOT_COMMAND,
    CHANNEL_ROBOT_EVENT,
    CHANNEL_ROBOT_HEALTH,
    open_lcm,
    utime_now,
)
from canopy_sim.deeds import Deed, Kind
from canopy_sim.events import Event
from canopy_sim.plant import Plant
from canopy_sim.robot import Robot

if TYPE_CHECKING:
    import lcm

MOST_AT_ONCE = 20
"""Messages taken in one poll(): a flood on LCM should not hold up the bus."""

COMPLAINT_PERIOD = 1.0
"""Least time between two lines about packets that are rejected [s]."""


class LcmSide:
    """Publishes robot_state_t, robot_event_t and robot_health_t, takes robot_command_t. Counters only grow."""

    def __init__(self, link: lcm.LCM, execute: Callable[[Deed], None]) -> None:
        """`execute` does a command; it raises ValueError for one that it rejects."""
        from canopy_msgs.robot_command_t import robot_command_t
        from canopy_msgs.robot_event_t import robot_event_t
        from canopy_msgs.robot_health_t import robot_health_t
        from canopy_msgs.robot_state_t import robot_state_t

        self._command_type = robot_command_t
        self._state_type = robot_state_t
        self._event_type = robot_event_t
        self._health_type = robot_health_t
        self._link = link
        self._execute = execute
        self._next_complaint = 0.0
        self._untold = 0
        self.published = 0
        self.commands = 0
        self.refused = 0
        self._subscription = link.subscribe(CHANNEL_ROBOT_COMMAND, self._take)

    def publish(self, robot: Robot, speed: float) -> None:
        """Sends one robot_state_t; `speed` is that of the robot's clock, 0: it stands."""
        state, message = robot.state, self._state_type()
        message.utime = utime_now()
        message.step = state.step
        message.speed = speed
        message.battery = state.battery
        message.charger_distance = state.charger_distance
        message.head_x = state.head_x
        message.head_height = state.head_height
        message.charging = state.charging
        message.power_mode = int(state.power_mode)
        message.posture_mode = int(state.posture_mode)
        message.stopped = state.stopped
        message.sending = state.sending
        _fill_whole(message, robot.plant)
        message.time_ms = robot.time_ms
        self._send(CHANNEL_ROBOT, message)

    def tell(self, event: Event) -> None:
        """Sends one robot_event_t."""
        message = self._event_type()
        message.utime, message.time_ms, message.text = utime_now(), event.time_ms, event.text
        self._send(CHANNEL_ROBOT_EVENT, message)

    def publish_health(self, counters: Mapping[str, int]) -> None:
        """Sends one robot_health_t; `counters` by the names of its fields, but for this side's own."""
        message = self._health_type()
        message.utime = utime_now()
        for name, value in counters.items():
            setattr(message, name, value)
        message.commands, message.malformed = self.commands, self.refused
        self._send(CHANNEL_ROBOT_HEALTH, message)

    def _send(self, channel: str, message: Any) -> None:
        self._link.publish(channel, message.encode())
        self.published += 1

    def poll(self) -> bool:
        """Takes the commands that have arrived; returns at once.

        Returns:
            True when at least one was carried out.
        """
        before = self.commands
        for _ in range(MOST_AT_ONCE):
            if self._link.handle_timeout(0) <= 0:
                break
        return self.commands != before

    def _take(self, _channel: str, data: bytes) -> None:
        try:
            self._execute(_deed(self._command_type.decode(data)))
        except Exception as error:  # decode() raises whatever struct raises; nothing on LCM may end the robot
            self.refused += 1
            self._complain(str(error))
        else:
            self.commands += 1

    def _complain(self, why: str) -> None:
        now = time.monotonic()
        if now < self._next_complaint:
            self._untold += 1
            return
        more = f" ({self._untold} more since the last such line)" if self._untold else ""
        echo(f"canopy-sim: {CHANNEL_ROBOT_COMMAND} refused: {why}{more}", err=True)
        self.tell(Event(0, f"refused: {why}"))  # for who has sent it, if it can hear
        self._next_complaint, self._untold = now + COMPLAINT_PERIOD, 0


def _fill_whole(message: Any, plant: Plant) -> None:
    raw = plant.raw
    message.profile = int(raw.profile)
    message.plugged = plant.plugged
    message.current = raw.current_ma / 1e3
    message.battery_temperature = raw.battery_mdeg / 1e3
    message.joint_temperature = max(raw.joint_mdeg) / 1e3
    message.pose = int(raw.pose)
    message.toes = int(raw.toes)
    message.wish = int(raw.wish)
    message.says = int(raw.speech.what)
    message.arms = int(raw.arms.what)
    message.ball_distance = raw.ball_um / 1e6
    message.ball_tracked = bool(raw.tracked)
    message.hand = int(raw.hand)


def _deed(message: Any) -> Deed:
    return Deed(
        Kind(message.command),
        message.battery,
        message.charger_distance,
        message.head_x,
        message.head_height,
        message.ball_distance,
        message.number,
        message.milliseconds,
        message.seed,
        message.speed,
    )


def open_lcm_side(url: str, execute: Callable[[Deed], None]) -> LcmSide | None:
    """Opens LCM; None when it cannot work here, which was then said on stderr."""
    link = open_lcm(url, "canopy-sim")
    return None if link is None else LcmSide(link, execute)
