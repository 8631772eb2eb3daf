# SPDX-License-Identifier: MIT
"""The Big BT's mission with every part as a process of its own, on any bus; `canopy sim` tells the robot things."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cantools
from cantools.database.can import Database

from canopy.canbus import open_bus
from canopy.live.codes import Status, last_result
from canopy.trace import TraceDecoder
from canopy_sim.plant import Wish
from integration.big_mission import below, folder, leaves, play, read_model
from integration.lcm_netns import LcmNetwork
from integration.missions import ControllerProcess
from integration.sim_peers import DBC, Simulator

BIG_DBC = DBC.with_name("big.dbc")
SLACK = 10.0
"""For a busy machine, in each wait [s]."""
WORDS = {
    Wish.Sit: "sit",
    Wish.StandUp: "stand up",
    Wish.Sleep: "sleep",
    Wish.SayGoodbye: "say goodbye",
    Wish.BallGame: "ball game",
}


class Processes:
    """The stage behind a bus."""

    def __init__(self, build_dir: Path, bus: str, network: LcmNetwork, factor: float, *, corrected: bool) -> None:
        self.model = read_model(build_dir, corrected=corrected)
        self.trace = TraceDecoder(self.model)
        self.bus = open_bus(bus)
        database = cantools.database.load_file(BIG_DBC)
        assert isinstance(database, Database)
        self._database = database
        self._known = {message.frame_id for message in database.messages}
        self._network = network
        self._factor = factor
        self._values: dict[str, dict[str, Any]] = {}
        self._shown: set[tuple[str, str]] = set()
        self.reached: set[int] = set()
        """Nodes that were seen to be anything but IDLE."""

    def poll(self) -> None:
        """Takes one frame, if one comes soon."""
        frame = self.bus.recv(0.02)
        if frame is None:
            return
        data = bytes(frame.data)
        for view in self.trace.feed(frame.arbitration_id, data):
            self.reached |= {
                index
                for index, node in enumerate(view.nodes)
                if node.code >= 0 and last_result(node.code) is not Status.IDLE
            }
        if frame.arbitration_id not in self._known:  # the trace
            return
        message = self._database.get_message_by_frame_id(frame.arbitration_id)
        self._values[message.name] = dict(message.decode_simple(data))
        self._shown |= {(f"{message.name}.{name}", str(value)) for name, value in self._values[message.name].items()}

    def sim(self, *words: str) -> None:
        """`canopy sim WORDS`."""
        self._shown.clear()
        command = self._network.command([sys.executable, "-m", "canopy", "sim", *words])
        done = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while done.poll() is None:
            self.poll()
        assert done.returncode == 0, done.communicate()[0]
        done.communicate()

    def say(self, wish: Wish) -> None:
        self.sim("say", WORDS[wish])

    def push_over(self) -> None:
        self.sim("push-over")
        lying = {("Posture.Name", "LyingBack"), ("Posture.Name", "LyingBelly")}
        self.wait("it has lain", lambda: not lying.isdisjoint(self._shown), 10)

    def press_toes(self) -> None:
        self.sim("bumper", "left-inner", "right-inner")

    def drain(self, percent: float) -> None:
        self.sim("drain", str(percent))

    def shows(self, signal: str) -> str:
        message, _, name = signal.partition(".")
        return str(self._values.get(message, {}).get(name))

    def has_shown(self, signal: str, value: str) -> bool:
        return (signal, value) in self._shown

    def wait(self, what: str, condition: Callable[[], bool], seconds: float) -> None:
        end = time.monotonic() + seconds / self._factor + SLACK
        while not condition():
            assert time.monotonic() < end, f"not within {seconds} s of the robot's time: {what}; {self._values}"
            self.poll()

    def pass_time(self, seconds: float) -> None:
        end = time.monotonic() + seconds / self._factor
        while time.monotonic() < end:
            self.poll()


def the_mission_is_played(build_dir: Path, bus: str, *, corrected: bool, factor: float) -> None:
    """All five activities and the ball game; every leaf has its turn, but for the two that are dead as printed."""
    options = [] if corrected else ["--image", str(folder(build_dir) / "nao_big_as_printed.img")]
    with (
        LcmNetwork() as network,
        Simulator(
            bus, "--profile", "nao", "--time-factor", str(factor), enter=network.command([]), dbc=BIG_DBC
        ) as simulator,
        ControllerProcess(build_dir, "nao_big", bus, *options) as controller,
    ):
        stage = Processes(build_dir, bus, network, factor, corrected=corrected)
        with stage.bus:
            play(stage, corrected=corrected)
        report = controller.end()
        summary = simulator.end()
    names = leaves(stage.model)
    dead = set() if corrected else below(stage.model, "Play") & names.keys() - below(stage.model, "Play Ball Game")
    assert names.keys() - stage.reached == dead, sorted(names[index] for index in names.keys() - stage.reached)
    assert report["faults"] == 0
    # A machine so busy that frames are lost shows gaps in the counters; nothing else may be wrong with a frame.
    assert {reason for reason, count in summary["frames"]["refused"].items() if count} <= {"sequence", "repeated"}
    assert summary["lcm"]["refused"] == 0
