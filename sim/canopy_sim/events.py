# SPDX-License-Identifier: MIT
"""What happens to the robot, in words: seen by looking at it before and after each step."""

from __future__ import annotations

from dataclasses import dataclass

from canopy_sim.plant import ActState, ArmsMode, Command, Hand, Plant, Pose, PowerMode, Wish, Words

KEPT_MAX = 1000
"""Events that wait to be taken; older ones are forgotten."""


@dataclass(frozen=True)
class Event:
    """Something that happened. `time_ms` is on the robot's clock."""

    time_ms: int
    text: str


@dataclass(frozen=True)
class _Look:
    pose: Pose
    hand: Hand
    power: PowerMode
    charging: bool
    plugged: bool
    falls: int
    wishes: int
    toes: int
    speech: tuple[ActState, int, int]
    arms: tuple[ActState, int, int]
    is_empty: bool


class Watcher:
    """Looks at a plant after each step, and says what has changed."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._events: list[Event] = []
        self._last = self._see(Command())

    def _see(self, command: Command) -> _Look:
        raw = self._plant.raw
        return _Look(
            pose=Pose(raw.pose),
            hand=Hand(raw.hand),
            power=PowerMode(command.power),
            charging=self._plant.charging,
            plugged=not raw.unplugged,
            falls=int(raw.falls),
            wishes=int(raw.wishes),
            toes=int(raw.toes),
            speech=(ActState(raw.speech.state), int(raw.speech.what), int(raw.speech.number)),
            arms=(ActState(raw.arms.state), int(raw.arms.what), int(raw.arms.number)),
            is_empty=self._plant.battery <= 0,
        )

    def look(self, command: Command) -> None:
        """After a step with this command."""
        before, now = self._last, self._see(command)
        if before == now:
            return
        self._last = now
        for text in (*self._body(before, now), *self._acts(before, now), *self._energy(before, now)):
            self._events.append(Event(int(self._plant.raw.time_ms), text))
        del self._events[:-KEPT_MAX]

    def _body(self, before: _Look, now: _Look) -> list[str]:
        texts = []
        if now.falls > before.falls:
            texts.append("fell on its back" if now.pose is Pose.LyingBack else "fell on its belly")
        elif now.pose is not before.pose and now.pose is not Pose.Moving:
            texts.append({Pose.Stand: "stands", Pose.Sit: "sits"}.get(now.pose, "lies"))
        if now.wishes != before.wishes:
            texts.append(f"somebody wished: {Wish(self._plant.raw.wish).name}")
        if now.toes and not before.toes:
            texts.append("something is at its toes")
        elif before.toes and not now.toes:
            texts.append("its toes are free")
        return texts

    @staticmethod
    def _acts(before: _Look, now: _Look) -> list[str]:
        texts = []
        if now.speech != before.speech and now.speech[0] is ActState.Busy:
            texts.append(f"says: {Words(now.speech[1]).name}")
        if now.arms != before.arms and now.arms[0] is ActState.Busy:
            texts.append(f"its arms: {ArmsMode(now.arms[1]).name}")
        if now.hand is not before.hand:
            dropped = "dropped the ball" if before.hand is Hand.Holds else "the ball lies on the floor"
            texts.append({Hand.Holds: "has the ball", Hand.Threw: "threw the ball"}.get(now.hand, dropped))
        return texts

    @staticmethod
    def _energy(before: _Look, now: _Look) -> list[str]:
        texts = []
        if now.power is not before.power and PowerMode.DriveToCharger in (now.power, before.power):
            texts.append("goes to the charger" if now.power is PowerMode.DriveToCharger else "goes there no more")
        if now.charging != before.charging:
            texts.append("charges" if now.charging else "charges no more")
        if now.plugged != before.plugged:
            texts.append("the charger has mains again" if now.plugged else "somebody pulled the charger's plug")
        if now.is_empty and not before.is_empty:
            texts.append("its battery is empty")
        return texts

    def take(self) -> list[Event]:
        """What was seen since the last call."""
        events, self._events = self._events, []
        return events
