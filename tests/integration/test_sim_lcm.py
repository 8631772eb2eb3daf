# SPDX-License-Identifier: MIT
"""The whole robot on LCM: `canopy sim` tells it things, it shows its state and events, and lcm-logger keeps them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import lcm
import pytest

from canopy.lcm_link import (
    CHANNEL_ROBOT,
    CHANNEL_ROBOT_COMMAND,
    CHANNEL_ROBOT_EVENT,
    CHANNEL_ROBOT_HEALTH,
    CHANNEL_TREE,
    DEFAULT_URL,
)
from canopy_sim.plant import Pose, Wish
from integration.big_mission import model_file
from integration.big_processes import BIG_DBC
from integration.lcm_netns import LcmNetwork
from integration.missions import ControllerProcess
from integration.processes import OwnedProcess
from integration.sim_peers import Simulator

LCM_PEER = Path(__file__).parent / "lcm_peer.py"
TOOLS = Path(sys.executable).parent
CHANNELS = {
    CHANNEL_ROBOT: "robot_state_t",
    CHANNEL_ROBOT_EVENT: "robot_event_t",
    CHANNEL_ROBOT_HEALTH: "robot_health_t",
    CHANNEL_TREE: "tree_status_t",
}


class Listener(OwnedProcess):
    """Everything on the channels, from when it is made; ends with the context."""

    def __init__(self, network: LcmNetwork) -> None:
        self.process = subprocess.Popen(
            network.command(
                [
                    sys.executable,
                    str(LCM_PEER),
                    "listen",
                    DEFAULT_URL,
                    "100",
                    *(f"{c}={t}" for c, t in CHANNELS.items()),
                ]
            ),
            stdout=subprocess.PIPE,
            text=True,
        )
        self.heard: list[dict[str, Any]] = []
        assert self.next() == {"listening": True}

    def next(self) -> dict[str, Any]:
        """The next message."""
        assert self.process.stdout is not None
        message: dict[str, Any] = json.loads(self.process.stdout.readline())
        self.heard.append(message)
        return message

    def until(self, channel: str, seconds: float = 20, **fields: Any) -> dict[str, Any]:
        """The next message of a channel with these fields."""
        end = time.monotonic() + seconds
        while True:
            message = self.next()
            assert time.monotonic() < end, f"no {channel} with {fields}; last {message}"
            if message.get("channel") == channel and fields.items() <= message.items():
                return message


class Bridge(OwnedProcess):
    """`canopy bridge`; ends with the context."""

    def __init__(self, command: list[str]) -> None:
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True)


@pytest.fixture
def network() -> Iterator[LcmNetwork]:
    with LcmNetwork() as network:
        yield network


def tell(network: LcmNetwork, *words: str) -> subprocess.CompletedProcess[str]:
    """`canopy sim WORDS`."""
    command = network.command([sys.executable, "-m", "canopy", "sim", *words])
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


@contextmanager
def robot(bus_dir: Path, network: LcmNetwork, *options: str) -> Iterator[tuple[Simulator, Listener]]:
    """The whole robot in real time, and a listener."""
    bus = f"unixbus:{bus_dir}/bus0"
    with (
        Listener(network) as listener,
        Simulator(bus, "--profile", "nao", *options, enter=network.command([]), dbc=BIG_DBC) as simulator,
    ):
        listener.until(CHANNEL_ROBOT)
        yield simulator, listener


def test_each_command_does_what_it_says(bus_dir: Path, network: LcmNetwork) -> None:
    with robot(bus_dir, network) as (simulator, listener):
        for words, fields in (
            (["say", "ball game"], {"wish": int(Wish.BallGame)}),
            (["press-chest"], {"wish": int(Wish.Sit)}),
            (["bumper", "left-outer", "right-outer", "--ms", "60000"], {"toes": 0b1001}),
            (["bumper"], {"toes": 0b1111}),
            (["set", "--battery", "33", "--charger-distance", "0", "--ball-distance", "0.5"], {"ball_distance": 0.5}),
            (["unplug"], {"plugged": False}),
            (["plug"], {"plugged": True}),
            (["drain", "12.5"], {"battery": 12.5}),
            (["overheat"], {"joint_temperature": 85.0}),
            (["drop-ball"], {}),
            (["stop-sending"], {"sending": False}),
            (["resume-sending"], {"sending": True}),
            (["reset", "--seed", "9", "--battery", "40"], {"battery": 40.0, "toes": 0}),
            (["reset", "--profile", "paper"], {"profile": 0, "pose": int(Pose.LyingBack)}),
        ):
            done = tell(network, *words)
            assert done.returncode == 0, (words, done.stdout, done.stderr)
            listener.until(CHANNEL_ROBOT, **fields)
        assert tell(network, "push-over").returncode == 0
        health = listener.until(CHANNEL_ROBOT_HEALTH, commands=15)
        assert health["malformed"] == 0
        assert health["sent"] > 0
        summary = simulator.end()
    assert summary["lcm"]["commands"] == 15


def test_the_clock_stands_steps_and_changes_its_speed(bus_dir: Path, network: LcmNetwork) -> None:
    with robot(bus_dir, network, "--time-factor", "2") as (simulator, listener):
        assert tell(network, "pause").returncode == 0
        stands = listener.until(CHANNEL_ROBOT, speed=0.0)
        assert tell(network, "step", "250").returncode == 0
        listener.until(CHANNEL_ROBOT, speed=0.0, step=stands["step"] + 250, time_ms=stands["time_ms"] + 2500)
        assert tell(network, "run").returncode == 0
        assert tell(network, "speed", "20").returncode == 0
        first = listener.until(CHANNEL_ROBOT, speed=20.0)
        last = listener.until(CHANNEL_ROBOT, speed=20.0)
        while last["utime"] < first["utime"] + 2_000_000:
            last = listener.until(CHANNEL_ROBOT, speed=20.0)
        factor = (last["time_ms"] - first["time_ms"]) * 1000 / (last["utime"] - first["utime"])
        assert factor == pytest.approx(20, rel=0.15)
        simulator.end()


def test_in_lock_step_there_is_no_speed_and_it_says_so(bus_dir: Path, network: LcmNetwork) -> None:
    with robot(bus_dir, network, "--lock-step") as (_, listener):
        done = tell(network, "speed", "3")
        assert done.returncode == 1
        assert "in real time" in done.stderr
        assert tell(network, "pause").returncode == 0
        listener.until(CHANNEL_ROBOT, speed=0.0)


def test_what_happens_is_told_in_words(build_dir: Path, bus_dir: Path, network: LcmNetwork) -> None:
    with (
        robot(bus_dir, network, "--time-factor", "10") as (_, listener),
        ControllerProcess(build_dir, "nao_big", f"unixbus:{bus_dir}/bus0"),
    ):
        assert tell(network, "push-over").returncode == 0
        fell = listener.until(CHANNEL_ROBOT_EVENT)
        while not fell["text"].startswith("fell on its"):
            fell = listener.until(CHANNEL_ROBOT_EVENT)
        assert tell(network, "say", "stand up").returncode == 0
        listener.until(CHANNEL_ROBOT_EVENT, text="somebody wished: StandUp")
        stands = listener.until(CHANNEL_ROBOT_EVENT, text="stands")
        assert stands["time_ms"] > fell["time_ms"]


def test_nobody_there_is_said(network: LcmNetwork) -> None:
    done = tell(network, "push-over")
    assert done.returncode == 1
    assert "no robot answers" in done.stderr


def test_a_wrong_wish_is_a_wrong_command_line(network: LcmNetwork) -> None:
    done = tell(network, "say", "fly")
    assert done.returncode == 2
    assert "ball game" in done.stderr


def test_malformed_packets_are_counted_and_told_once_a_second(bus_dir: Path, network: LcmNetwork) -> None:
    flood = (
        "import lcm, time\n"
        f"link = lcm.LCM({DEFAULT_URL!r})\n"
        "for number in range(300):\n"
        f"    link.publish({CHANNEL_ROBOT_COMMAND!r}, bytes([number % 256]) * (number % 90))\n"
        "    time.sleep(0.005)\n"
    )
    with robot(bus_dir, network) as (simulator, listener):
        subprocess.run(network.command([sys.executable, "-c", flood]), check=True, timeout=30)
        listener.until(CHANNEL_ROBOT_HEALTH, malformed=300, commands=0)
        assert tell(network, "push-over").returncode == 0
        simulator.process.send_signal(signal.SIGTERM)
        out, err = simulator.process.communicate(timeout=20)
    assert json.loads(out)["lcm"]["refused"] == 300
    assert 1 <= err.count("refused") <= 5


@contextmanager
def lcm_tool(network: LcmNetwork, *command: str) -> Iterator[subprocess.Popen[bytes]]:
    """One of LCM's own tools, ended as Ctrl-C does: with its wrapper in Python, so as a group."""
    process = subprocess.Popen(
        network.command([str(TOOLS / command[0]), *command[1:]]),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        for number in (signal.SIGINT, signal.SIGKILL):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, number)
            with suppress(subprocess.TimeoutExpired):
                process.wait(5)


def logged(log: Path) -> list[tuple[str, bytes]]:
    return [(event.channel, event.data) for event in lcm.EventLog(str(log))]


def test_lcm_logger_and_logplayer_give_back_a_mission(
    build_dir: Path, bus_dir: Path, network: LcmNetwork, tmp_path: Path
) -> None:
    """Simulator, controller and bridge are logged; the log is played to a listener, and its commands to a new robot."""
    bus, log, again = f"unixbus:{bus_dir}/bus0", tmp_path / "mission.lcm", tmp_path / "again.lcm"
    bridge = [sys.executable, "-m", "canopy", "bridge", "--model", str(model_file(build_dir)), "--can", bus]
    with lcm_tool(network, "lcm-logger", "-q", f"--lcm-url={DEFAULT_URL}", str(log)):
        with (
            robot(bus_dir, network, "--time-factor", "10") as (_, listener),
            ControllerProcess(build_dir, "nao_big", bus),
            Bridge(network.command(bridge)),
        ):
            listener.until(CHANNEL_TREE)
            assert tell(network, "say", "sit").returncode == 0
            listener.until(CHANNEL_ROBOT, pose=int(Pose.Sit))
            assert tell(network, "push-over").returncode == 0
            listener.until(CHANNEL_ROBOT_EVENT, text="sits")
        time.sleep(0.5)
    recorded = logged(log)
    assert {channel for channel, _ in recorded} >= {*CHANNELS, CHANNEL_ROBOT_COMMAND}
    with lcm_tool(network, "lcm-logger", "-q", f"--lcm-url={DEFAULT_URL}", str(again)):
        time.sleep(0.5)
        with lcm_tool(network, "lcm-logplayer", f"--lcm-url={DEFAULT_URL}", "--speed=2", str(log)) as player:
            player.wait(60)
        time.sleep(1.0)
    known = set(recorded)
    played = [one for one in logged(again) if one in known]
    assert played == recorded
    commands = tmp_path / "commands.lcm"
    subprocess.run(
        [str(TOOLS / "lcm-logfilter"), "-c", CHANNEL_ROBOT_COMMAND, str(log), str(commands)],
        check=True,
        timeout=30,
    )
    assert len(logged(commands)) == 2
    with robot(bus_dir, network, "--time-factor", "10") as (simulator, listener):
        with lcm_tool(network, "lcm-logplayer", f"--lcm-url={DEFAULT_URL}", str(commands)) as player:
            listener.until(CHANNEL_ROBOT, wish=int(Wish.Sit))
            player.wait(60)
        summary = simulator.end()
    assert summary["lcm"]["commands"] == 2
