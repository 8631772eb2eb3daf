# SPDX-License-Identifier: MIT
"""`canopy bridge`: a controller's trace frames on CAN become LCM messages, one CANOPY_TREE for each tick."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import can
import click

from canopy.can_bus.steady import SteadyBus
from canopy.canbus import CanBusError, is_plain_data
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo
from canopy.lcm_link import CHANNEL_TREE, CHANNEL_TREE_STRUCTURE, DEFAULT_URL, open_lcm, utime_now
from canopy.live.lcm_messages import status_message, structure_message
from canopy.live.rest_of_tick import RestOfTick
from canopy.model import Model, ModelError, load_model
from canopy.process.say import Voice
from canopy.process.status import NOTHING
from canopy.stop import StopFlag
from canopy.trace import TraceDecoder, TreeView

if TYPE_CHECKING:
    import lcm

_POLL_S = 0.1


@dataclass
class Summary:
    """What a bridge has done."""

    application: str
    ticks: int = 0
    """Ticks seen, complete or not."""
    incomplete: int = 0
    """Ticks of which frames were missing."""
    published: int = 0
    publish_failed: int = 0
    lost: int = 0
    ticks_missed: int = 0
    restarts: int = 0
    refused: int = 0
    crc_errors: int = 0
    """Of these: CanopyTick frames with a wrong CRC, where they are protected."""
    overruns: int = 0
    disagreements: int = 0
    """How often a CanopyModel began to claim another tree than the model's."""

    def text(self) -> str:
        """One line for people."""
        return (
            f"canopy bridge: {self.application}: {self.ticks} ticks seen ({self.incomplete} incomplete, "
            f"{self.ticks_missed} missed), {self.published} LCM messages published, {self.publish_failed} failed; "
            f"{self.lost} trace frames lost, {self.refused} refused; {self.overruns} overruns, {self.restarts} restarts"
            + (f"; {self.disagreements} claims of another tree" if self.disagreements else "")
        )


class Bridge:
    """Takes the bus's frames, publishes what they tell. Without LCM (None) it only counts."""

    def __init__(self, model: Model, link: lcm.LCM | None, structure_period: float, voice: Voice) -> None:
        self.summary = Summary(model.application)
        self._model = model
        self._link = link
        self._decoder = TraceDecoder(model)
        self._structure_period = structure_period
        self._structure_due = 0.0
        self._rest = RestOfTick(model)
        self._voice = voice
        self._claim: str | None = None

    def feed(self, identifier: int, data: bytes, utime: int) -> None:
        """Takes one data frame that was received at `utime` [µs since 1970]."""
        now = time.monotonic()
        if self._rest.is_over(now):
            self._take(self._decoder.flush(), utime)
        self._rest.saw(identifier, now)
        self._take(self._decoder.feed(identifier, data), utime)
        self._compare()

    def _compare(self) -> None:
        """Says once that the controller claims another tree than the model's: anybody can, on a bus."""
        claim = self._decoder.mismatch
        if claim is not None and claim != self._claim:
            self._voice.say(claim, "model")
            self.summary.disagreements += 1
        self._claim = claim

    def idle(self) -> None:
        """Call this often: sends what is due, and gives up waiting for frames that no longer come."""
        now = time.monotonic()
        if self._rest.is_over(now):
            self._take(self._decoder.flush(), utime_now())
        if now >= self._structure_due:
            self._structure_due = now + self._structure_period
            if self._link is not None:
                self._publish(CHANNEL_TREE_STRUCTURE, structure_message(self._model))

    def end(self) -> Summary:
        """Publishes the rest, and sums up."""
        self._take(self._decoder.flush(), utime_now())
        for name in ("lost", "ticks_missed", "restarts", "refused", "crc_errors"):
            setattr(self.summary, name, getattr(self._decoder, name))
        return self.summary

    def _take(self, views: Iterable[TreeView], utime: int) -> None:
        for view in views:
            self.summary.ticks += 1
            self.summary.incomplete += not view.complete
            self.summary.overruns = view.overruns
            if view.lost and not self.summary.lost:
                echo(
                    f"canopy bridge: trace frames are lost on the way ({view.lost} at tick {view.tick}); "
                    "further ones are counted (trace_lost), not printed",
                    err=True,
                )
            self.summary.lost = view.lost
            if self._link is not None:
                self._publish(CHANNEL_TREE, status_message(self._model, view, utime))

    def _publish(self, channel: str, message: Any) -> None:
        assert self._link is not None
        try:
            self._link.publish(channel, message.encode())
        except OSError as error:
            if not self.summary.publish_failed:
                echo(f"canopy bridge: LCM cannot publish: {error}; further failures are counted", err=True)
            self.summary.publish_failed += 1
        else:
            self.summary.published += 1


def run(bridge: Bridge, bus: SteadyBus, stop: StopFlag, duration: float | None) -> None:
    """Until a signal comes or `duration` [s] is over."""
    end = None if duration is None else time.monotonic() + duration
    while not stop and (end is None or time.monotonic() < end):
        message = bus.recv(_POLL_S)
        if message is not None and is_plain_data(message):
            bridge.feed(message.arbitration_id, bytes(message.data), int(message.timestamp * 1e6))
        bridge.idle()


@click.command(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy bridge --model build/host/examples/nao/generated/nao_home/nao_home.model.json --can socketcan:vcan0
  canopy bridge --model nao_home.model.json --can unixbus:bus0 --duration 60 --json
""",
)
@click.option("--model", "model_path", type=click.Path(path_type=Path), required=True, help="<application>.model.json")
@click.option("--can", "bus_name", required=True, help="socketcan:vcan0, unixbus:bus0 or unixbus:/a/folder")
@click.option("--lcm-url", default=DEFAULT_URL, show_default=True, help="Where the messages go.")
@click.option(
    "--structure-period",
    type=click.FloatRange(0.1, 3600),
    default=2.0,
    show_default=True,
    help="How often the tree's structure is published [s].",
)
@click.option("--duration", type=click.FloatRange(0, min_open=True), help="End after so many seconds.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one line of JSON.")
def command(
    model_path: Path, bus_name: str, lcm_url: str, structure_period: float, duration: float | None, as_json: bool
) -> None:
    """Publish a controller's trace on LCM.

    Each tick is published as a tree_status_t on CANOPY_TREE, the tree's structure as a tree_structure_t on
    CANOPY_TREE_STRUCTURE. Without LCM on this machine it says so and only counts. A bus that is not there, down or gone
    is waited for. Runs until Ctrl-C; a summary is printed at the end.

    Exit status: 0 done, 1 nothing ever came, or the model or the bus cannot be used, 2 wrong command line.
    """
    voice = Voice("canopy bridge")
    with StopFlag() as stop:
        try:
            model = load_model(model_path)
            with SteadyBus(bus_name, voice) as bus:
                bridge = Bridge(model, open_lcm(lcm_url, "canopy bridge"), structure_period, voice)
                bridge.idle()
                echo(f"canopy bridge: {model.application} on {bus_name}", err=True)
                run(bridge, bus, stop, duration)
        except (ModelError, CanBusError, can.CanError) as error:
            echo(f"canopy bridge: {error}", err=True)
            sys.exit(NOTHING)
        summary = bridge.end()
    voice.end()
    echo(dumps(asdict(summary)) if as_json else summary.text())
    if not bus.heard:
        echo(f"canopy bridge: nothing came on {bus_name}; `canopy buses` lists the buses that there are", err=True)
        sys.exit(NOTHING)
