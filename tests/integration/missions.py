# SPDX-License-Identifier: MIT
"""The example's missions with every part as a process of its own, on any bus: what they must show, written once.

test_missions.py runs them on a unixbus, rig/test_missions_vcan.py on vcan0.
"""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from fractions import Fraction
from itertools import groupby
from pathlib import Path
from types import TracebackType
from typing import Any

import can
import cantools
from can.interfaces.socketcan import SocketcanBus
from cantools.database.can import Database

from canopy.canbus import open_bus
from canopy.lcm_link import CHANNEL_ROBOT, CHANNEL_TREE, CHANNEL_TREE_STRUCTURE, DEFAULT_URL
from canopy.model import load_model
from canopy.trace import Status, TraceDecoder, TreeView
from integration import paper
from integration.lcm_netns import LcmNetwork
from integration.processes import OwnedProcess
from integration.sim_peers import DBC, Simulator

LCM_PEER = Path(__file__).parent / "lcm_peer.py"
TIMEOUT = 0.5
"""GenMsgTimeoutTime of sensors and commands [s]."""
PERIOD = 0.05
"""Of the controller's tick [s]."""
SLACK = 0.25
"""For a busy machine [s]."""
SO_RCVBUFFORCE = 33
"""Of Linux: beyond net.core.rmem_max, for root; Python does not name it."""
RECEIVE_BUFFER = 8 << 20
ATTEMPTS = 4
"""Of a run that is judged by an observer which must not miss a frame."""


class ControllerProcess(OwnedProcess):
    """nao_home or nao_power; ends with the context."""

    def __init__(self, build_dir: Path, name: str, bus: str, *options: str, enter: Iterable[str] = ()) -> None:
        program = build_dir / "examples" / "nao" / name
        self.process = subprocess.Popen(
            [*enter, str(program), "--can", bus, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def wait(self, timeout: float = 60) -> dict[str, int]:
        """Waits for a good end; gives the summary's numbers by the words before them."""
        out, err = self.process.communicate(timeout=timeout)
        assert self.process.returncode == 0, (self.process.returncode, out, err)
        numbers = {name: int(value) for name, value in re.findall(r"(\w+) (\d+)", out)}
        ticks = re.search(r"(\d+) ticks, (\d+) overruns", out)
        assert ticks is not None, out
        return {**numbers, "ticks": int(ticks[1]), "overruns": int(ticks[2])}

    def end(self) -> dict[str, int]:
        """Ends it as Ctrl-C does."""
        self.process.send_signal(signal.SIGINT)
        return self.wait()


class Observer:
    """A participant that only listens, and decodes with cantools and the model file."""

    def __init__(self, build_dir: Path, name: str, bus: str) -> None:
        model = load_model(build_dir / "examples" / "nao" / "generated" / name / f"{name}.model.json")
        database = cantools.database.load_file(DBC)
        assert isinstance(database, Database)
        self.database = database
        self.node_names = [node.name for node in model.nodes]
        self.trace = TraceDecoder(model)
        self.bus = open_bus(bus)
        if isinstance(self.bus, SocketcanBus):  # a burst that overruns the kernel's default is no loss of ours
            self.bus.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            with suppress(PermissionError):
                self.bus.socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER)
        self.values: dict[str, dict[str, Any]] = {}
        """Last values by message."""
        self.modes: dict[str, list[str]] = {"PowerCommand": [], "PostureCommand": []}
        """Every mode that was commanded, in order."""
        self.views: list[TreeView] = []
        """The tree after each tick."""

    def __enter__(self) -> Observer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bus.shutdown()

    def poll(self, timeout: float) -> bool:
        """Takes one frame; False when none came in time."""
        frame = self.bus.recv(timeout)
        if frame is not None:
            self.take(frame)
        return frame is not None

    def take(self, frame: can.Message) -> None:
        """Decodes a frame."""
        if not frame.is_remote_frame:
            self.views.extend(self.trace.feed(frame.arbitration_id, bytes(frame.data)))
        try:
            message = self.database.get_message_by_frame_id(frame.arbitration_id)
        except KeyError:
            return
        if len(frame.data) != message.length:
            return
        self.values[message.name] = dict(message.decode_simple(bytes(frame.data)))
        if message.name in self.modes:
            self.modes[message.name].append(str(self.values[message.name]["Mode"]))

    def take_all(self, ended: Callable[[], bool], stall: float) -> None:
        """Takes every frame until `ended`, as fast as they come, and decodes them only then.

        In lock-step two processes send as fast as they can. A loaded machine may be slow, but must not stand still.

        Raises:
            AssertionError: no frame within `stall` seconds.
        """
        frames: list[can.Message] = []
        last = time.monotonic()
        while not ended():
            frame = self.bus.recv(0.1)
            if frame is not None:
                frames.append(frame)
                last = time.monotonic()
            assert time.monotonic() - last < stall, f"no frame for {stall} s after {len(frames)}"
        while (frame := self.bus.recv(0.5)) is not None:
            frames.append(frame)
        for frame in frames:
            self.take(frame)

    def wait_for(self, condition: Callable[[], bool], timeout: float) -> float:
        """Listens until the condition holds; gives the seconds it took.

        Raises:
            AssertionError: it does not hold in time.
        """
        start = time.monotonic()
        while not condition():
            assert time.monotonic() - start < timeout, f"not within {timeout} s; last: {self.values}"
            self.poll(0.02)
        return time.monotonic() - start

    def wait_for_ticks(self, ticks: int, stall: float) -> None:
        """Listens until so many ticks were seen. A loaded machine may be slow, but must not stand still.

        Raises:
            AssertionError: no further tick within `stall` seconds.
        """
        while len(self.views) < ticks:
            seen = len(self.views)
            self.wait_for(lambda: len(self.views) > seen, stall)  # noqa: B023  (called at once)

    def listen(self, seconds: float) -> None:
        """Listens for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.poll(left)

    def last_mode(self, message: str) -> str | None:
        """The mode commanded last."""
        return self.modes[message][-1] if self.modes[message] else None


def _runs(modes: list[str]) -> list[tuple[str, int]]:
    return [(mode, len(list(run))) for mode, run in groupby(modes)]


def lock_step_has_the_papers_ticks(build_dir: Path, bus: str, name: str) -> Observer:
    """Every phase lasts as many ticks as in exact arithmetic: seen on the bus, by the simulator, and in the trace."""
    if name == "nao_power":
        ticks, message, start = 2000, "PowerCommand", ["--power", "80,50"]
        expected = paper.phases(paper.example_4(Fraction(80), Fraction(50)), ticks)
    else:
        message, start = "PostureCommand", ["--posture", "0.5,0"]
        expected = paper.phases(paper.example_5(Fraction(1, 2), Fraction(0)))
        ticks = sum(length for _, length in expected)
    modes = [(paper.MODES[phase], length) for phase, length in expected]
    options = ["--lock-step", "--no-lcm", "--steps", str(ticks), *start]
    for _ in range(ATTEMPTS):
        with (
            Observer(build_dir, name, bus) as observer,
            Simulator(bus, *options) as simulator,
            ControllerProcess(build_dir, name, bus, "--lock-step", "--ticks", str(ticks)) as controller,
        ):
            observer.take_all(lambda: controller.process.poll() is not None, stall=60)
            report = controller.wait()
            summary = simulator.wait()
        # On a machine so busy that the observer stood still for 100 ms it has not seen everything: then once more.
        if observer.trace.lost == 0 and len(observer.modes[message]) == ticks + 1:
            break
    assert report["ticks"] == ticks
    assert all(report[name] == 0 for name in ("refused", "unknown", "lost", "replaced", "expired", "timeouts"))
    # When it ends, the controller sends its safe commands once more.
    assert _runs(observer.modes[message][:ticks]) == modes
    assert observer.modes[message][ticks:] == ["Stop"]
    place = 0 if message == "PowerCommand" else 1
    assert [(phase[place], phase[2]) for phase in summary["phases"]] == modes
    assert summary["minimum_battery"] > 0
    assert observer.trace.lost == 0
    assert [view.tick for view in observer.views][: ticks - 1] == list(range(ticks - 1))
    if name == "nao_home":
        leaves = {"SitUp": "Lie down to Sit up", "StandUp": "Sit to Stand", "WalkHome": "Walk Home"}
        for view, mode in zip(observer.views, observer.modes[message], strict=False):
            running = [
                node for node, code in zip(observer.node_names, view.statuses, strict=True) if code == Status.RUNNING
            ]
            assert running[1:] == ([leaves[mode]] if mode in leaves else [])
    return observer


def a_dead_simulator_stops_the_tree_and_a_new_one_lets_it_go_on(build_dir: Path, bus: str) -> None:
    """Kill the simulator: within the timeout no leaf acts on its signals. Start it again: the mission goes on."""
    options = ["--no-lcm", "--power", "50,80", "--time-factor", "200"]
    with (
        Observer(build_dir, "nao_power", bus) as observer,
        ControllerProcess(build_dir, "nao_power", bus) as controller,
    ):
        with Simulator(bus, *options) as simulator:
            observer.wait_for(lambda: observer.last_mode("PowerCommand") == "DoTask", 10)
            observer.listen(0.3)
            simulator.process.kill()
            simulator.process.wait()
        took = observer.wait_for(lambda: observer.last_mode("PowerCommand") == "Stop", 5)
        assert took < TIMEOUT + 2 * PERIOD + SLACK
        observer.listen(0.3)
        assert {observer.last_mode("PowerCommand"), *observer.modes["PowerCommand"][-3:]} == {"Stop"}
        assert observer.views[-1].root_status == Status.FAILURE
        assert Status.RUNNING not in observer.views[-1].statuses
        with Simulator(bus, *options) as simulator:
            observer.wait_for(lambda: observer.last_mode("PowerCommand") == "DoTask", 10)
            assert simulator.end()["minimum_battery"] > 0
        report = controller.end()
    assert report["timeouts"] >= 1
    assert report["faults"] == 0


def a_dead_controller_stops_the_robot(build_dir: Path, bus: str) -> None:
    """Kill the controller: within the commands' timeout the robot stands still."""
    with (
        Observer(build_dir, "nao_power", bus) as observer,
        Simulator(bus, "--no-lcm", "--power", "20,80", "--time-factor", "200") as simulator,
    ):
        with ControllerProcess(build_dir, "nao_power", bus) as controller:
            observer.wait_for(lambda: observer.last_mode("PowerCommand") == "DoTask", 10)
            observer.listen(0.5)
            controller.process.kill()
            controller.process.wait()
        observer.listen(TIMEOUT + 2 * PERIOD + SLACK)
        stopped_at = observer.values["Battery"]
        observer.listen(0.5)
        keys = ("Level", "ChargerDistance")
        assert [observer.values["Battery"][key] for key in keys] == [stopped_at[key] for key in keys]
        assert stopped_at["ChargerDistance"] > 20
        summary = simulator.end()
    assert summary["commands_timed_out"] >= 1
    assert summary["final"]["stopped"] is True


def bad_frames_change_nothing_but_a_counter(build_dir: Path, bus: str) -> None:
    """Garbage, short, long, remote and unknown frames among the good ones."""

    def frame(identifier: int, data: bytes = b"", **more: Any) -> can.Message:
        return can.Message(arbitration_id=identifier, data=data, **{"is_extended_id": False, **more})

    refused = [
        frame(0x100, b"\x12\x34\x56\x78\x9a\xbc\xde\xf0"),
        frame(0x110, bytes(8)),
        frame(0x100, b"\x01\x02\x03"),
        frame(0x110),
        frame(0x100, dlc=8, is_remote_frame=True),
    ]
    unknown = [frame(0x123, b"abc"), frame(0x7FF), frame(0x100, bytes(8), is_extended_id=True)]
    rounds = 10
    with (
        Observer(build_dir, "nao_power", bus) as observer,
        Simulator(bus, "--no-lcm", "--power", "50,90", "--time-factor", "100") as simulator,
        ControllerProcess(build_dir, "nao_power", bus) as controller,
        open_bus(bus) as noise,
    ):
        observer.wait_for(lambda: observer.last_mode("PowerCommand") == "DoTask", 10)
        before = len(observer.modes["PowerCommand"])
        for _ in range(rounds):
            for bad in (*refused, *unknown):
                noise.send(bad)
            observer.listen(0.1)
        observer.wait_for(lambda: observer.trace.health.rx_rejected == rounds * len(refused), 5)
        assert (observer.trace.health.rx_filtered, observer.trace.health.rx_unknown) == (True, None)
        assert set(observer.modes["PowerCommand"][before:]) == {"DoTask"}
        report = controller.end()
        simulator.end()
    assert report["refused"] == rounds * len(refused)
    assert report["unknown"] == 0
    assert report["timeouts"] == report["faults"] == 0


def the_mission_is_seen_in_lcm(build_dir: Path, bus: str) -> None:
    """Simulator, controller and bridge as processes; an LCM subscriber sees tree, structure and robot."""
    folder = build_dir / "examples" / "nao" / "generated" / "nao_home"
    channels = [
        f"{CHANNEL_TREE}=tree_status_t",
        f"{CHANNEL_TREE_STRUCTURE}=tree_structure_t",
        f"{CHANNEL_ROBOT}=robot_state_t",
    ]
    with LcmNetwork() as network:
        enter = network.command([])
        listener = subprocess.Popen(
            network.command([sys.executable, str(LCM_PEER), "listen", DEFAULT_URL, "12", *channels]),
            stdout=subprocess.PIPE,
            text=True,
        )
        assert listener.stdout is not None
        assert json.loads(listener.stdout.readline()) == {"listening": True}
        model = str(folder / "nao_home.model.json")
        bridge_command = [sys.executable, "-m", "canopy", "bridge", "--model", model, "--can", bus]
        bridge = subprocess.Popen(network.command(bridge_command), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with (
            Simulator(bus, "--posture", "0.5,0", "--time-factor", "5", enter=enter) as simulator,
            ControllerProcess(build_dir, "nao_home", bus, enter=enter) as controller,
        ):
            out, _ = listener.communicate(timeout=60)
            report = controller.end()
            simulator.end()
        bridge.send_signal(signal.SIGINT)
        _, bridge_errors = bridge.communicate(timeout=20)
    assert bridge.returncode == 0, bridge_errors
    assert report["faults"] == 0
    messages = [json.loads(line) for line in out.splitlines()]
    trees = [message for message in messages if message["channel"] == CHANNEL_TREE]
    structures = [message for message in messages if message["channel"] == CHANNEL_TREE_STRUCTURE]
    robots = [message for message in messages if message["channel"] == CHANNEL_ROBOT]
    ticks = [tree["tick"] for tree in trees]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    assert len(ticks) > 60
    assert trees[-1]["trace_lost"] == 0
    assert trees[-1]["application"] == "nao_home"
    assert structures[0]["name"] == ["Get home", "Walk Home", "Sit to Stand", "Lie down to Sit up"]
    assert structures[0]["parent"] == [-1, 0, 0, 0]
    assert all(trees[-1]["certain"])
    running = [key for key, _ in groupby(tuple(tree["code"]).index(1, 1) for tree in trees if 1 in tree["code"][1:])]
    assert running == [3, 2, 1]
    told = [key for key, _ in groupby(tuple(tree["running"]) for tree in trees if tree["running"])]
    assert told == [("Lie down to Sit up",), ("Sit to Stand",), ("Walk Home",)]
    assert trees[-1]["root_status"] == Status.SUCCESS
    assert robots[-1]["head_x"] == 0
    assert robots[-1]["head_height"] == 0.5
