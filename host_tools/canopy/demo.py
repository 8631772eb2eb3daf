# SPDX-License-Identifier: MIT
"""`canopy demo`: both NAO examples, each with its controller and the simulated robot on a CAN bus, watched live."""

from __future__ import annotations

import fcntl
import json
import shutil
import socket
import struct
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can
import click

from canopy.canbus import CanBusError, is_plain_data, open_bus
from canopy.children import ChildError, Children
from canopy.escape.terminal import echo, echo_lines
from canopy.lcm_link import DEFAULT_URL, open_lcm
from canopy.model import Model, ModelError, load_model
from canopy.stop import StopFlag
from canopy.view import Display, make_display
from canopy.watch import Watch

_VCAN = "vcan0"
_POLL_S = 0.05
_LINE_PERIOD_S = 2.0
_START_LIMIT_S = 15.0
_QUIET_S = 0.3
_LINGER_S = 1.5  # after the goal, so that its picture can be seen
_SIOCGIFFLAGS = 0x8913
_IFF_UP = 1
_POWER_STEP_S, _POSTURE_STEP_S = 10, 1  # the paper's Δt of Examples 4 and 5


class DemoError(Exception):
    """The demo cannot go on; the text says why, and the way out."""


class InterruptedDemo(Exception):  # noqa: N818 (no error)
    """A signal asked the demo to end."""


@dataclass(frozen=True)
class Part:
    """One example."""

    application: str
    title: str
    start: tuple[str, str]
    """--power and --posture of canopy-sim."""
    time_factor: float
    """How much faster than real time: both give the controller two periods or more for each step that matters."""
    limit_s: float
    mode: int
    """Which of the simulator's phases tells what the robot did: 0 power, 1 posture."""
    goal: Callable[[Watch, list[str]], bool]
    """Given what is seen and the modes commanded so far: reached?"""


def _is_home(watch: Watch, _modes: list[str]) -> bool:
    position = watch.signals.value("Posture", "HeadX")
    return isinstance(position, (int, float)) and position <= 0


def _works_again(_watch: Watch, modes: list[str]) -> bool:
    return modes[-4:] == ["DoTask", "DriveToCharger", "Charge", "DoTask"]


PARTS = (
    Part("nao_home", "from the floor to standing at home", ("80,50", "0.5,0"), 3, 25, 1, _is_home),
    Part("nao_power", "work, but never run empty", ("80,50", "0.5,0"), 200, 40, 0, _works_again),
)


@dataclass
class Result:
    """What one part came to."""

    part: Part
    reached: bool = False
    seconds: float = 0.0
    ticks: int = 0
    overruns: int = 0
    lost: int = 0
    incomplete: int = 0
    simulator: dict[str, Any] = field(default_factory=dict)
    """The simulator's own summary."""

    @property
    def least_battery(self) -> float:
        """Of the whole run [%]."""
        return float(self.simulator["minimum_battery"])

    @property
    def succeeded(self) -> bool:
        """The goal was reached, and the battery was never empty."""
        return self.reached and self.least_battery > 0

    def text(self) -> str:
        """A few lines for people."""
        goal = "reached" if self.reached else "NOT REACHED"
        phases = ", ".join(f"{mode} {_duration(seconds)}" for mode, seconds in self.phases()) or "none"
        return (
            f"{self.part.application}: {self.part.title}: {goal} in {self.seconds:.1f} s\n"
            f"  phases (robot's time): {phases}\n"
            f"  {self.ticks} ticks, {self.overruns} overruns, {self.lost} trace frames lost, "
            f"{self.incomplete} ticks incomplete; lowest battery {self.least_battery:.1f} %"
        )

    def phases(self) -> list[tuple[str, int]]:
        """What the robot did one after the other, and how long in its own time [s]; standing idle is left out."""
        phases: list[tuple[str, int]] = []
        for entry in self.simulator["phases"]:
            mode, seconds = str(entry[self.part.mode]), int(entry[2]) * _POSTURE_STEP_S
            if phases and phases[-1][0] == mode:
                seconds += phases.pop()[1]
            phases.append((mode, seconds))
        return [phase for phase in phases if phase[0] != "Stop"]


def _duration(seconds: int) -> str:
    return f"{seconds} s" if seconds < 10 * _POWER_STEP_S else f"{seconds / 60:.1f} min"


class Demo:
    """One run of a part: starts the programs, watches them, ends them."""

    def __init__(self, build_dir: Path, spec: str, with_lcm: bool, folder: Path, stop: StopFlag) -> None:
        self._examples = build_dir / "examples" / "nao"
        self._spec = spec
        self._with_lcm = with_lcm
        self._folder = folder
        self._stop = stop

    def model(self, part: Part) -> Model:
        """The part's model.

        Raises:
            DemoError: The examples are not built.
        """
        name = part.application
        path = self._examples / "generated" / name / f"{name}.model.json"
        if not (self._examples / name).is_file() or not path.is_file():
            raise DemoError(f"{self._examples / name} is not built; mend with: make demo, or give --build-dir")
        return load_model(path)

    def run(self, part: Part, display: Display, title: str) -> Result:
        """Runs the part until its goal is reached, its time is over, or a signal comes.

        Raises:
            InterruptedDemo: A signal came.
            DemoError, ChildError, ModelError, CanBusError, can.CanError: It cannot go on.
        """
        watch = Watch(self.model(part))
        result = Result(part)
        with open_bus(self._spec) as bus, Children(self._folder) as children:
            children.start("canopy-sim", self._simulator(part, watch.model))
            self._await_robot(watch, bus, children)
            if self._with_lcm:
                children.start("canopy-bridge", self._bridge(watch.model))
            children.start(part.application, [str(self._examples / part.application), "--can", self._spec])
            begin = time.monotonic()
            for now in self._watching(watch, bus, children, begin + part.limit_s, result):
                display.show(watch, now, False, title)
            result.seconds = time.monotonic() - begin
            if self._stop:
                raise InterruptedDemo
            children.end(part.application)
            result.simulator = _parse_summary(children.end("canopy-sim"))
        return result

    def _watching(
        self, watch: Watch, bus: can.BusABC, children: Children, end: float, result: Result
    ) -> Iterator[float]:
        """Gives the time after each look at the bus, until the part is over."""
        modes: list[str] = []
        while (now := time.monotonic()) < end and not self._stop:
            children.check()
            views = watch.idle(now)
            message = bus.recv(_POLL_S)
            if message is not None and is_plain_data(message):
                views += watch.feed(message.arbitration_id, bytes(message.data), now)
            for view in views:
                result.ticks += 1
                result.overruns, result.lost = view.overruns, view.lost
                result.incomplete += not view.complete
            mode = watch.signals.value("PowerCommand", "Mode")
            if isinstance(mode, str) and (not modes or modes[-1] != mode):
                modes.append(mode)
            if not result.reached and result.part.goal(watch, modes):
                result.reached = True
                end = min(end, now + _LINGER_S)
            yield now

    def _await_robot(self, watch: Watch, bus: can.BusABC, children: Children) -> None:
        end = time.monotonic() + _START_LIMIT_S
        while watch.signals.value("Battery", "Level") is None and not self._stop:
            children.check()
            now = time.monotonic()
            if now > end:
                raise DemoError(f"the simulator sends nothing on {self._spec}: {children.last_words('canopy-sim')}")
            message = bus.recv(_POLL_S)
            if message is not None and is_plain_data(message):
                watch.feed(message.arbitration_id, bytes(message.data), now)

    def _simulator(self, part: Part, model: Model) -> list[str]:
        beside = Path(sys.executable).parent / "canopy-sim"
        program = str(beside) if beside.is_file() else shutil.which("canopy-sim")
        if program is None:
            raise DemoError("canopy-sim is not installed; mend with: pip install ./sim")
        power, posture = part.start
        arguments = ["--can", self._spec, "--dbc", str(model.dbc), "--time-factor", str(part.time_factor), "--json"]
        arguments += ["--power", power, "--posture", posture]
        return [program, *arguments, *([] if self._with_lcm else ["--no-lcm"])]

    def _bridge(self, model: Model) -> list[str]:
        return [sys.executable, "-m", "canopy", "bridge", "--model", str(model.path), "--can", self._spec]


def _parse_summary(text: str) -> dict[str, Any]:
    try:
        summary = json.loads(text)
    except ValueError:
        summary = None
    if not isinstance(summary, dict):
        raise DemoError(f"canopy-sim ended without a summary: {text.strip()[-200:] or 'it said nothing'}")
    return summary


def choose_bus(spec: str | None, folder: Path) -> str:
    """The bus to use: the one asked for, else vcan0 where it is up and nobody sends on it, else a unixbus in `folder`.

    Raises:
        DemoError: Somebody else sends on the bus that was asked for.
        CanBusError: It cannot be opened.
    """
    if spec is None:
        spec = f"socketcan:{_VCAN}"
        return spec if _is_up(_VCAN) and _is_quiet(spec) else f"unixbus:{folder}/bus"
    if not _is_quiet(spec):
        raise DemoError(f"somebody sends on {spec} already; stop that, or choose another bus with --can")
    return spec


def _is_up(interface: str) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            answer = fcntl.ioctl(probe, _SIOCGIFFLAGS, struct.pack("16sH14x", interface.encode(), 0))
        except OSError:
            return False
    return bool(struct.unpack_from("16xH", answer)[0] & _IFF_UP)


def _is_quiet(spec: str) -> bool:
    with open_bus(spec) as bus:
        return bus.recv(_QUIET_S) is None


def run_parts(build_dir: Path, spec: str | None, stop: StopFlag) -> list[Result]:
    """Runs all parts, one after the other.

    Raises:
        InterruptedDemo: A signal came.
        DemoError, ChildError, ModelError, CanBusError, can.CanError: It cannot go on.
    """
    results = []
    with tempfile.TemporaryDirectory(prefix="canopy-demo-") as temporary:
        folder = Path(temporary)
        spec = choose_bus(spec, folder)
        with_lcm = open_lcm(DEFAULT_URL, "canopy demo") is not None
        lcm_text = ", and on LCM (`canopy spy` shows it)" if with_lcm else ""
        echo(f"Two controllers, one after the other, with the simulated robot on {spec}{lcm_text}.")
        demo = Demo(build_dir, spec, with_lcm, folder, stop)
        for number, part in enumerate(PARTS, 1):
            title = f"{number} of {len(PARTS)}: {part.application}: {part.title}"
            if not sys.stdout.isatty():  # on a terminal it is in the picture
                echo(title)
            with make_display(False, _LINE_PERIOD_S) as display:
                results.append(demo.run(part, display, title))
    return results


@click.command(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy demo
  canopy demo --build-dir build/asan --can unixbus:bus0
""",
)
@click.option(
    "--build-dir",
    type=click.Path(path_type=Path),
    default="build/host",
    show_default=True,
    help="CMake's build folder, which holds the example programs.",
)
@click.option("--can", "bus_name", help="The CAN bus to use.  [default: vcan0 where it is up, else a unixbus]")
def command(build_dir: Path, bus_name: str | None) -> None:
    """Run the NAO examples and watch them.

    First the controller nao_home brings the robot from the floor to standing at home, then nao_power works, drives to
    the charger before the battery is empty, charges, and works again. Takes under a minute.

    Exit status: 0 both goals were reached and the battery was never empty, 1 not so, 130 interrupted.
    """
    with StopFlag() as stop:
        try:
            results = run_parts(build_dir, bus_name, stop)
        except InterruptedDemo:
            echo("canopy demo: interrupted; all it had started has ended", err=True)
            sys.exit(130)
        except (DemoError, ChildError, ModelError, CanBusError, can.CanError) as error:
            echo(f"canopy demo: {error}", err=True)
            sys.exit(1)
    echo()
    echo("Summary")
    for result in results:
        echo_lines(result.text())
    sys.exit(0 if all(result.succeeded for result in results) else 1)
