# SPDX-License-Identifier: MIT
"""`canopy monitor`: a controller's tree and signals, live from its CAN bus."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import can
import click

from canopy.can_bus.steady import SteadyBus
from canopy.canbus import CanBusError, is_plain_data
from canopy.escape.terminal import echo
from canopy.model import ModelError, load_model
from canopy.process.say import Voice
from canopy.process.status import NOTHING
from canopy.stop import StopFlag
from canopy.view import Display, make_display
from canopy.watch import Watch

_POLL_S = 0.05


def run(
    watch: Watch, bus: SteadyBus, display: Display, stop: StopFlag, duration: float | None, title: str, voice: Voice
) -> None:
    """Shows what the bus tells until a signal comes or `duration` [s] is over."""
    end = None if duration is None else time.monotonic() + duration
    claim: str | None = None
    while not stop and (end is None or time.monotonic() < end):
        message = bus.recv(_POLL_S)
        now = time.monotonic()
        views = watch.idle(now)
        if message is not None and is_plain_data(message):
            views += watch.feed(message.arbitration_id, bytes(message.data), now)
        if watch.disagreement is not None and watch.disagreement != claim:
            voice.say(watch.disagreement, "model")
        claim = watch.disagreement
        display.show(watch, now, bool(views), title)


@click.command(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy monitor --model build/host/examples/nao/generated/nao_home/nao_home.model.json --can socketcan:vcan0
  canopy monitor --model nao_home.model.json --can unixbus:bus0 --json --period 0 | head
""",
)
@click.option("--model", "model_path", type=click.Path(path_type=Path), required=True, help="<application>.model.json")
@click.option("--can", "bus_name", required=True, help="socketcan:vcan0, unixbus:bus0 or unixbus:/a/folder")
@click.option(
    "--period",
    type=click.FloatRange(0, 3600),
    default=1.0,
    show_default=True,
    help="Lines and JSON: one every so many seconds; 0: one for each tick.",
)
@click.option("--duration", type=click.FloatRange(0, min_open=True), help="End after so many seconds.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line.")
def command(model_path: Path, bus_name: str, period: float, duration: float | None, as_json: bool) -> None:
    """Watch a controller's tree and signals live.

    In a terminal it draws the tree with its statuses, the signals the controller receives and sends, and what was lost
    on the way. Into a file or a pipe it prints lines. It only listens. A bus that is not there, down or gone is waited
    for. Runs until Ctrl-C.

    Exit status: 0 done, 1 nothing ever came, or the model or the bus cannot be used, 2 wrong command line.
    """
    voice = Voice("canopy monitor")
    with StopFlag() as stop:
        try:
            watch = Watch(load_model(model_path))
            with SteadyBus(bus_name, voice) as bus, make_display(as_json, period) as display:
                run(
                    watch,
                    bus,
                    display,
                    stop,
                    duration,
                    f"{watch.model.application} on {bus_name}  (Ctrl-C ends)",
                    voice,
                )
        except (ModelError, CanBusError, can.CanError) as error:
            echo(f"canopy monitor: {error}", err=True)
            sys.exit(NOTHING)
    voice.end()
    if not bus.heard:
        echo(f"canopy monitor: nothing came on {bus_name}; `canopy buses` lists the buses that there are", err=True)
        sys.exit(NOTHING)
