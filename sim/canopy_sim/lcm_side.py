# SPDX-License-Identifier: MIT
"""The robot on LCM: its state out, a desk's commands in.

liblcm receives in a thread of its own; poll() only takes what is there, so the loop on the CAN bus never waits for LCM.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from canopy.lcm_link import CHANNEL_ROBOT, CHANNEL_ROBOT_COMMAND, open_lcm, utime_now
from canopy.process.say import Voice
from canopy_sim.robot import CommandKind, DeskCommand, RobotState

if TYPE_CHECKING:
    import lcm

MOST_AT_ONCE = 20
"""Messages taken in one poll(): a flood on LCM shall not hold up the bus."""


class LcmSide:
    """Publishes robot_state_t, takes robot_command_t. Counters only grow."""

    def __init__(self, link: lcm.LCM, execute: Callable[[DeskCommand], None]) -> None:
        """`execute` does a command; it raises ValueError for one that it refuses."""
        from canopy_msgs.robot_command_t import robot_command_t
        from canopy_msgs.robot_state_t import robot_state_t

        self._command_type = robot_command_t
        self._state_type = robot_state_t
        self._link = link
        self._execute = execute
        self._voice = Voice("canopy-sim")
        self.published = 0
        self.commands = 0
        self.refused = 0
        self._subscription = link.subscribe(CHANNEL_ROBOT_COMMAND, self._take)

    def publish(self, state: RobotState) -> None:
        """Sends one robot_state_t."""
        message = self._state_type()
        message.utime = utime_now()
        message.step = state.step
        message.battery = state.battery
        message.charger_distance = state.charger_distance
        message.head_x = state.head_x
        message.head_height = state.head_height
        message.charging = state.charging
        message.power_mode = int(state.power_mode)
        message.posture_mode = int(state.posture_mode)
        message.stopped = state.stopped
        message.sending = state.sending
        self._link.publish(CHANNEL_ROBOT, message.encode())
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
            message = self._command_type.decode(data)
            command = DeskCommand(
                CommandKind(message.command),
                message.battery,
                message.charger_distance,
                message.head_x,
                message.head_height,
            )
            self._execute(command)
        except Exception as error:  # decode() raises whatever struct raises; nothing on LCM may end the robot
            self.refused += 1
            self._voice.say(f"{CHANNEL_ROBOT_COMMAND} refused: {error}", "refused")
        else:
            self.commands += 1


def open_lcm_side(url: str, execute: Callable[[DeskCommand], None]) -> LcmSide | None:
    """Opens LCM; None when it cannot work here, which was then said on stderr."""
    link = open_lcm(url, "canopy-sim")
    return None if link is None else LcmSide(link, execute)
