# SPDX-License-Identifier: MIT
"""The program canopy-sim."""

from __future__ import annotations

import signal
import sys
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import can
import click

from canopy.can_bus.steady import SteadyBus
from canopy.canbus import CanBusError, split_spec
from canopy.compiler.cli import HexNumber
from canopy.compiler.errors import CompileError
from canopy.escape.json_text import dumps
from canopy.escape.terminal import CleanCommand, echo, echo_lines
from canopy.lcm_link import DEFAULT_URL
from canopy.process.say import Voice
from canopy_sim.deeds import OF_WHOLE
from canopy_sim.lcm_side import open_lcm_side
from canopy_sim.messages import DEFAULT_TRACE, DescriptionError, RobotMessages, load_messages
from canopy_sim.plant import Plant, Profile
from canopy_sim.process import FASTEST, BusGoneError, Simulation
from canopy_sim.robot import Robot
from canopy_sim.summary import summarise, summary_text
from canopy_sim.timetable import Event, load_timetable

LARGEST = 10**9
"""Steps in one number of a Pair: what is below fits into the plant's integers, which then look closer."""


class BusName(click.ParamType[str]):
    """A CAN bus as `kind:channel`."""

    name = "bus"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Checks the form; whether the bus is there is seen when it is opened."""
        try:
            split_spec(value)
        except CanBusError as error:
            self.fail(str(error), param, ctx)
        return str(value)


class Pair(click.ParamType[tuple[int, int]]):
    """Two decimal numbers, exact, each in whole steps of its own."""

    name = "x1,x2"

    def __init__(self, *per_unit: int) -> None:
        """`per_unit`: how many steps make one, for each number."""
        self._per_unit = per_unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Gives both numbers in steps."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = [Decimal(text) * per for text, per in zip(value.split(","), self._per_unit, strict=True)]
        except (InvalidOperation, ValueError):
            self.fail(f"'{value}' is no pair of numbers like 80,50", param, ctx)
        if not all(number.is_finite() and abs(number) <= LARGEST for number in numbers):
            self.fail(f"'{value}' is out of range", param, ctx)
        steps = [int(number) for number in numbers]
        if steps != numbers:
            self.fail(f"'{value}': the steps are {' and '.join(f'1/{per}' for per in self._per_unit)}", param, ctx)
        return steps[0], steps[1]


def read_dbc(path: Path, trace: int) -> RobotMessages:
    """Reads the DBC; a wrong one ends like a wrong option."""
    try:
        return load_messages(path, trace)
    except DescriptionError as error:
        raise click.BadParameter(str(error), param_hint="'--dbc'") from error


def read_timetable(_ctx: click.Context, _param: click.Parameter, value: Path | None) -> list[Event]:
    """Reads the mission while the command line is read."""
    try:
        return [] if value is None else load_timetable(value)
    except CompileError as error:
        raise click.BadParameter(str(error)) from error


def make_plant(
    power: tuple[int, int] | None, posture: tuple[int, int] | None, profile: Profile = Profile.paper, seed: int = 1
) -> Plant:
    """The plant as it begins: (distance [mm], battery [0.1 %]), (head x, head height [mm]); None: the profile's."""
    plant = Plant(profile, seed)
    try:
        if power is not None:
            plant.set_power(power[0] * 10**6, power[1])
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--power'") from error
    try:
        if posture is not None:
            plant.set_posture(*posture)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="'--posture'") from error
    return plant


@click.command(
    cls=CleanCommand,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  A controller in real time, the robot's clock 10 times as fast:
    canopy-sim --can unixbus:bus0 --dbc nao.dbc --time-factor 10
  The whole robot, and what people do to it in a minute and a half:
    canopy-sim --can unixbus:bus0 --dbc big.dbc --profile nao --mission missions/tour.toml
  Exactly 2000 steps, one for each tick of a controller that was started with --lock-step:
    canopy-sim --can socketcan:vcan0 --dbc nao.dbc --lock-step --steps 2000 --json
""",
)
@click.option(
    "--can", "bus_name", type=BusName(), required=True, help="socketcan:vcan0, unixbus:bus0 or unixbus:/a/folder"
)
@click.option(
    "--dbc",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    required=True,
    help="The bus description: examples/nao/nao.dbc for Examples 4 and 5, big.dbc for the whole robot.",
)
@click.option(
    "--trace",
    type=HexNumber(0, 0x1FFFFFF8),
    metavar="ID",
    default=f"0x{DEFAULT_TRACE:X}",
    show_default=True,
    help="Where the controller's trace begins, as it was built (TRACE, --trace): its CanopyTick ends a lock-step.",
)
@click.option("--lock-step", is_flag=True, help="One step of the plant for each tick of the controller.")
@click.option(
    "--time-factor",
    type=click.FloatRange(0, FASTEST, min_open=True),
    help="Real time: how much faster the robot's clock runs.  [default: 1]",
)
@click.option(
    "--power",
    type=Pair(1000, 10),
    help="First distance to the charger [m] and charge [%].  [default: paper 80,50, nao 3,80]",
)
@click.option(
    "--posture",
    type=Pair(1000, 1000),
    help="First distance of the head from home and height of the head [m].  [default: paper 0.5,0, nao 0.5,0.55]",
)
@click.option(
    "--profile",
    type=click.Choice([profile.name for profile in Profile]),
    default=Profile.paper.name,
    show_default=True,
    help="The paper's equations, or a NAO's documented figures (needs big.dbc).",
)
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=1, show_default=True, help="Of the robot's chances.")
@click.option(
    "--steps",
    type=click.IntRange(1),
    help="End after so many steps of the plant (1 s of the robot's time, with nao 10 ms).",
)
@click.option(
    "--mission",
    "timetable",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    callback=read_timetable,
    help="What happens to the robot and when: timed events in TOML.",
)
@click.option("--lcm-url", default=DEFAULT_URL, show_default=True, help="Where the state goes and commands come from.")
@click.option("--no-lcm", is_flag=True, help="Without LCM.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one line of JSON.")
def main(
    bus_name: str,
    dbc: Path,
    trace: int,
    lock_step: bool,
    time_factor: float | None,
    power: tuple[int, int] | None,
    posture: tuple[int, int] | None,
    profile: str,
    seed: int,
    steps: int | None,
    timetable: list[Event],
    lcm_url: str,
    no_lcm: bool,
    as_json: bool,
) -> None:
    """Robot simulator: a NAO on a CAN bus.

    Sends the robot's sensor frames, obeys its command frames, and stops when they are older than their timeout. State,
    events and health go out on LCM, and commands come in: `canopy sim --help` lists them.
    Without --steps it runs until Ctrl-C. A summary is printed at the end.

    Exit status: 0 done, 1 the bus cannot be opened or has failed, 2 wrong command line or DBC.
    """
    if lock_step and time_factor is not None:
        raise click.UsageError("--time-factor is for real time: in lock-step the controller's ticks are the clock.")
    messages = read_dbc(dbc, trace)
    if profile == Profile.nao.name and not messages.is_whole:
        raise click.UsageError("--profile nao is for the whole robot: give --dbc examples/nao/big.dbc.")
    _check_timetable(timetable, messages)
    robot = Robot(messages, make_plant(power, posture, Profile[profile], seed))
    try:
        bus = SteadyBus(bus_name, Voice("canopy-sim"), create=True)
    except CanBusError as error:
        echo(f"canopy-sim: {error}", err=True)
        sys.exit(1)
    with bus:
        simulation = Simulation(bus, messages, robot, steps=steps, timetable=timetable)
        simulation.lcm_side = None if no_lcm else open_lcm_side(lcm_url, simulation.execute)
        mode = "lock-step" if lock_step else "real time"
        echo(f"canopy-sim: {mode} on {bus_name}", err=True)
        ended_by = _run(simulation, lock_step, time_factor or 1.0)
        summary = summarise(simulation, mode, ended_by)
    echo_lines(dumps(summary) if as_json else summary_text(summary))
    sys.exit(1 if ended_by == "failure" else 0)


def _check_timetable(timetable: list[Event], messages: RobotMessages) -> None:
    for _, deed in timetable:
        if deed.kind in OF_WHOLE and not messages.is_whole:
            raise click.UsageError(
                f"--mission has {deed.kind.name}, which is for the whole robot: give --dbc examples/nao/big.dbc."
            )


def _run(simulation: Simulation, lock_step: bool, time_factor: float) -> str:
    """Runs to the end and says what ended it: "steps", "signal", or "failure" (said on stderr)."""
    ended_by = "steps"

    def on_signal(_number: int, _frame: object) -> None:
        nonlocal ended_by
        ended_by = "signal"
        simulation.stop()

    signal.signal(signal.SIGINT, on_signal)
    signal.signal(signal.SIGTERM, on_signal)
    try:
        if lock_step:
            simulation.run_lock_step()
        else:
            simulation.run_real_time(time_factor)
    except (BusGoneError, can.CanError) as error:
        echo(f"canopy-sim: {error}", err=True)
        return "failure"
    return ended_by
