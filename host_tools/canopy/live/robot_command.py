# SPDX-License-Identifier: MIT
"""`canopy sim`: tells the simulated robot something, by name, over LCM (robot_command_t; docs/simulator.md)."""

from __future__ import annotations

import math
import sys
import time
from typing import Any

import click

from canopy.escape.terminal import CleanCommand, echo
from canopy.lcm_link import (
    CHANNEL_ROBOT,
    CHANNEL_ROBOT_COMMAND,
    CHANNEL_ROBOT_EVENT,
    DEFAULT_URL,
    open_lcm,
    utime_now,
)

WISHES = {"sit": 1, "stand up": 2, "sleep": 3, "say goodbye": 4, "ball game": 5}
"""Voice.Suggestion of big.dbc."""

PROFILES = {"paper": 0, "nao": 1}
TOES = {"left-outer": 1, "left-inner": 2, "right-inner": 4, "right-outer": 8}
QUANTITIES = ("battery", "charger_distance", "head_x", "head_height", "ball_distance")
REFUSED = "refused: "
"""How an event begins that says why a command was not carried out."""
ANSWER_S = 1.0
"""How long the robot's state is waited for, which says that somebody is there."""
TAKEN_S = 0.15
"""After so long a robot that is there has taken the command, or refused it."""
TURN_MS = 20


class _Group(CleanCommand, click.Group):
    pass


def _message(command: str, **fields: float) -> Any:
    """A robot_command_t; quantities that are not named stay as they are."""
    from canopy_msgs.robot_command_t import robot_command_t

    message = robot_command_t()
    message.utime = utime_now()
    message.command = getattr(robot_command_t, command)
    for name in QUANTITIES:
        setattr(message, name, math.nan)
    message.seed, message.speed = 1, 1.0
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def send(ctx: click.Context, command: str, **fields: float) -> None:
    """Sends one command, and looks whether a robot is there that takes it; if not, says so and ends with 1."""
    link = open_lcm(str(ctx.obj), "canopy sim")
    if link is None:
        sys.exit(1)
    from canopy_msgs.robot_event_t import robot_event_t  # open_lcm() has looked whether it is there

    states: list[bytes] = []
    refusals: list[str] = []

    def on_event(_channel: str, data: bytes) -> None:
        try:
            text = str(robot_event_t.decode(data).text)
        except ValueError:  # somebody else's packet
            return
        if text.startswith(REFUSED):
            refusals.append(text)

    link.subscribe(CHANNEL_ROBOT, lambda _channel, data: states.append(data))
    link.subscribe(CHANNEL_ROBOT_EVENT, on_event)
    link.publish(CHANNEL_ROBOT_COMMAND, _message(command, **fields).encode())
    begin = time.monotonic()
    while (passed := time.monotonic() - begin) < ANSWER_S and not refusals and not (states and passed > TAKEN_S):
        link.handle_timeout(TURN_MS)
    if not states and not refusals:
        refusals.append("no robot answers: is canopy-sim running, with LCM, on this URL?")
    if refusals:
        echo(f"canopy sim: {refusals[0]}", err=True)
        sys.exit(1)


@click.group(
    cls=_Group,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy sim push-over
  canopy sim say "ball game"
  canopy sim reset --profile nao --seed 7 --battery 30
""",
)
@click.option("--lcm-url", default=DEFAULT_URL, show_default=True, help="Where canopy-sim listens.")
@click.pass_context
def command(ctx: click.Context, lcm_url: str) -> None:
    """Tell the simulated robot something.

    A canopy-sim must run with LCM. What people do to a robot, and what only a simulation can do, each is a command.

    Exit status: 0 sent, and a robot is there; 1 no robot answers, or LCM cannot work; 2 wrong command line.
    """
    ctx.obj = lcm_url


def _simple(name: str, constant: str, text: str) -> None:
    @command.command(name, cls=CleanCommand, help=text)
    @click.pass_context
    def run(ctx: click.Context) -> None:
        send(ctx, constant)


for _name, _constant, _text in (
    ("push-over", "PUSH_OVER", "Push the robot over."),
    ("press-chest", "PRESS_CHEST", "Press the button on its chest: the wish after the last one."),
    ("unplug", "UNPLUG", "Pull the charger's plug."),
    ("plug", "PLUG", "Put the charger's plug back."),
    ("overheat", "OVERHEAT", "Make its legs 85 degrees hot."),
    ("drop-ball", "DROP_BALL", "Take the ball out of its hand."),
    ("run", "RUN", "Let the robot's clock go on."),
    ("pause", "PAUSE", "Let the robot's clock stand."),
    ("stop-sending", "STOP_SENDING", "Let its sensors fall silent."),
    ("resume-sending", "RESUME_SENDING", "Let its sensors speak again."),
):
    _simple(_name, _constant, _text)


@command.command("say", cls=CleanCommand)
@click.argument("wish", type=click.Choice(list(WISHES), case_sensitive=False))
@click.pass_context
def say(ctx: click.Context, wish: str) -> None:
    """Say what the robot should do."""
    send(ctx, "SAY", number=WISHES[wish])


@command.command("bumper", cls=CleanCommand)
@click.argument("toes", nargs=-1, type=click.Choice(list(TOES)))
@click.option(
    "--ms", type=click.IntRange(0, 3_600_000), default=0, help="How long.  [default: until it has backed off]"
)
@click.pass_context
def bumper(ctx: click.Context, toes: tuple[str, ...], ms: int) -> None:
    """Press toe bumpers; all four where none is named."""
    send(ctx, "PRESS_TOES", number=sum(TOES[toe] for toe in set(toes)), milliseconds=ms)


@command.command("drain", cls=CleanCommand)
@click.argument("percent", type=click.FloatRange(0, 100), default=21.0)
@click.pass_context
def drain(ctx: click.Context, percent: float) -> None:
    """Leave so much in the battery [%]; 21 if not said, just above where it goes to charge."""
    send(ctx, "DRAIN", battery=percent)


@command.command("step", cls=CleanCommand)
@click.argument("steps", type=click.IntRange(1, 1_000_000), default=1)
@click.pass_context
def step(ctx: click.Context, steps: int) -> None:
    """Make so many steps, then let the clock stand."""
    send(ctx, "STEP", number=steps)


@command.command("speed", cls=CleanCommand)
@click.argument("factor", type=click.FloatRange(0, 1000, min_open=True))
@click.pass_context
def speed(ctx: click.Context, factor: float) -> None:
    """Let the robot's clock run so many times as fast as real time."""
    send(ctx, "SPEED", speed=factor)


def _state_options(function: Any) -> Any:
    for name, unit in reversed((("battery", "%"), *((quantity, "m") for quantity in QUANTITIES[1:]))):
        option = click.option(f"--{name.replace('_', '-')}", type=float, default=math.nan, help=f"[{unit}]")
        function = option(function)
    return function


@command.command("set", cls=CleanCommand)
@_state_options
@click.pass_context
def set_state(ctx: click.Context, /, **quantities: float) -> None:
    """Put the robot into a state; what is not given stays."""
    send(ctx, "SET_STATE", **quantities)


@command.command("reset", cls=CleanCommand)
@click.option("--profile", type=click.Choice(list(PROFILES)), default="nao", show_default=True, help="Whose numbers.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=1, show_default=True, help="Of its chances.")
@_state_options
@click.pass_context
def reset(ctx: click.Context, /, profile: str, seed: int, **quantities: float) -> None:
    """A new robot, as its profile has it, but for what is given."""
    send(ctx, "RESET", number=PROFILES[profile], seed=seed, **quantities)
