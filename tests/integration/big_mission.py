# SPDX-License-Identifier: MIT
"""A mission that the Big BT plays, told once, for the robot in this process and for one behind a bus.

People make it do all five activities and play ball, knock it over, put things in its way, and drain its battery.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from canopy.model import Model, load_model
from canopy_sim.mission import Mission
from canopy_sim.plant import Plant, Profile, Wish

LEAVES_ONLY_ALIVE_WHEN_CORRECTED = {"Sit to Stand", "Lie down to Sit up"}
"""Those behind Play Ball Game in Fig. 34, where they never have their turn."""


class Stage(Protocol):
    """Where the mission is played."""

    def say(self, wish: Wish) -> None: ...
    def push_over(self) -> None:
        """When it comes back the robot has lain."""
        ...

    def press_toes(self) -> None: ...
    def drain(self, percent: float) -> None: ...
    def shows(self, signal: str) -> str:
        """A sensor's or a command's value now, by `Message.Signal`, as the DBC names it."""
        ...

    def has_shown(self, signal: str, value: str) -> bool:
        """As shows(), but also true when it was so at any time since the last deed began."""
        ...

    def wait(self, what: str, condition: Callable[[], bool], seconds: float) -> None:
        """Lets the robot's time go on until the condition holds; an AssertionError where it does not in time."""
        ...

    def pass_time(self, seconds: float) -> None:
        """Lets so much of the robot's time go by."""
        ...


def folder(build_dir: Path) -> Path:
    """Where the Big BT's generated files are."""
    return build_dir / "examples" / "nao" / "generated" / "nao_big"


def model_file(build_dir: Path, *, corrected: bool = True) -> Path:
    """The model file of the tree, or of the one that is printed."""
    name = "nao_big.model.json" if corrected else "nao_big_as_printed.model.json"
    return folder(build_dir) / name


def leaves(model: Model) -> dict[int, str]:
    """Index and name of every leaf."""
    return {node.index: node.name for node in model.nodes if node.end == node.index + 1}


def below(model: Model, name: str) -> set[int]:
    """Indices of a node of that name and of all that is below it."""
    node = next(node for node in model.nodes if node.name == name)
    return set(range(node.index, node.end))


class InProcess:
    """The stage in this process."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission

    @property
    def plant(self) -> Plant:
        return self.mission.plant

    def say(self, wish: Wish) -> None:
        self.plant.say(wish)

    def push_over(self) -> None:
        self.plant.push_over()

    def press_toes(self) -> None:
        self.plant.press_toes(0b0110, 0)

    def drain(self, percent: float) -> None:
        self.plant.drain(round(percent * 10))

    def shows(self, signal: str) -> str:
        raw = self.plant.raw
        shown = {
            "Posture.Name": ("Moving", "Stand", "Sit", "LyingBack", "LyingBelly")[raw.pose],
            "Ball.Hand": ("Empty", "Holds", "Threw")[raw.hand],
            "Battery.Charging": str(int(self.plant.charging)),
            "Touch.ToeLeftInner": str(raw.toes >> 1 & 1),
            "Acts.SpeechState": ("Idle", "Busy", "Done")[raw.speech.state],
            "Acts.Said": ("Nothing", "Ouch", "WhatToDo", "Goodbye")[raw.speech.what],
        }
        return shown[signal] if signal in shown else str(self.mission.application.output(signal))

    def has_shown(self, signal: str, value: str) -> bool:
        return self.shows(signal) == value

    def wait(self, what: str, condition: Callable[[], bool], seconds: float) -> None:
        ticks = round(seconds * 1000 / self.plant.step_ms)
        for _ in range(ticks):
            if condition():
                return
            self.mission.run(1)
        raise AssertionError(f"not within {seconds} s: {what}")

    def pass_time(self, seconds: float) -> None:
        self.mission.run(round(seconds * 1000 / self.plant.step_ms))


def play(stage: Stage, *, corrected: bool) -> None:
    """The mission. What the printed tree cannot do is asked of the corrected one alone."""

    def until(signal: str, value: str, seconds: float = 120) -> None:
        stage.wait(f"{signal} is {value}", lambda: stage.shows(signal) == value, seconds)

    until("UpperCommand.Say", "WhatToDo")
    for wish, posture in (
        (Wish.Sit, "Sit"),
        (Wish.StandUp, "Stand"),
        (Wish.Sleep, "LyingBack"),
        (Wish.StandUp, "Stand"),
    ):
        stage.say(wish)
        until("Posture.Name", posture)
    stage.say(Wish.Sit)
    until("Posture.Name", "Sit")
    stage.push_over()
    until("Posture.Name", "Sit")
    stage.say(Wish.SayGoodbye)
    stage.wait(
        "it has said goodbye",
        lambda: (stage.shows("Acts.Said"), stage.shows("Acts.SpeechState")) == ("Goodbye", "Done"),
        60,
    )
    stage.pass_time(5)
    _play_ball(stage, until, corrected=corrected)
    stage.press_toes()
    for signal, value in (("PostureCommand.Mode", "BackOff"), ("UpperCommand.Say", "Ouch")):
        stage.wait(f"{signal} was {value}", lambda: stage.has_shown(signal, value), 10)  # noqa: B023  (called at once)
    until("Touch.ToeLeftInner", "0", 60)
    stage.drain(19)
    until("PowerCommand.Mode", "DriveToCharger", 20)
    if corrected:
        stage.push_over()
        until("Battery.Charging", "1", 1200)


def _play_ball(stage: Stage, until: Callable[..., None], *, corrected: bool) -> None:
    if not corrected:  # nobody gets up for the game
        stage.say(Wish.StandUp)
        until("Posture.Name", "Stand")
    stage.say(Wish.BallGame)
    until("Ball.Hand", "Threw", 300)
    stage.push_over()
    if corrected:
        until("Posture.Name", "Stand")
        return
    stage.pass_time(60)
    assert stage.shows("Posture.Name").startswith("Lying")
    stage.say(Wish.StandUp)
    until("Posture.Name", "Stand")


def read_model(build_dir: Path, *, corrected: bool) -> Model:
    """The tree."""
    return load_model(model_file(build_dir, corrected=corrected))


__all__ = ["InProcess", "Profile", "Stage", "below", "leaves", "model_file", "play", "read_model"]
