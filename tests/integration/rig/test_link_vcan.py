# SPDX-License-Identifier: MIT
"""A link that goes down and up, an interface that is taken away and made anew: no program ends, each says so."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest

from canopy.canbus import open_bus
from integration.sim_peers import DBC

LINK = "vcan9"
BUS = f"socketcan:{LINK}"


def ip(*words: str) -> None:
    subprocess.run(["ip", "link", *words], check=True, timeout=30)


@pytest.fixture
def link() -> Iterator[None]:
    ip("add", "dev", LINK, "type", "vcan")
    ip("set", LINK, "up")
    yield
    subprocess.run(["ip", "link", "del", LINK], timeout=30, check=False)


def start(*command: str) -> subprocess.Popen[str]:
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def tool(name: str, *options: str) -> subprocess.Popen[str]:
    return start(sys.executable, "-m", "canopy", name, "--can", BUS, *options)


def frames_are_heard(seconds: float, wanted: Callable[[can.Message], bool]) -> bool:
    """Whether such a frame comes in time. A new listener, who knows nothing of what was."""
    with open_bus(BUS) as bus:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = bus.recv(0.2)
            if message is not None and wanted(message):
                return True
    return False


def is_tick(message: can.Message) -> bool:
    return message.arbitration_id == 0x600


def is_sensor(message: can.Message) -> bool:
    return message.arbitration_id == 0x110


@pytest.mark.timeout(300)
def test_every_program_outlives_its_link(build_dir: Path, tmp_path: Path, link: None) -> None:
    folder = build_dir / "examples" / "nao"
    model = str(folder / "generated" / "nao_home" / "nao_home.model.json")
    log = tmp_path / "run.log"
    programs = {
        "sim": start(sys.executable, "-m", "canopy_sim", "--can", BUS, "--dbc", str(DBC), "--no-lcm", "--json"),
        "record": tool("record", "-o", str(log), "--json"),
        "monitor": tool("monitor", "--model", model, "--json", "--period", "0.2"),
        "bridge": tool("bridge", "--model", model, "--lcm-url", "memq://", "--json"),
    }
    assert frames_are_heard(60, is_sensor)
    time.sleep(2)  # the slower ones are there now, too
    programs["controller"] = start(str(folder / "nao_home"), "--can", BUS)
    assert frames_are_heard(60, is_tick)

    ip("set", LINK, "down")
    time.sleep(1.5)
    assert {name: process.poll() for name, process in programs.items()} == dict.fromkeys(programs)
    ip("set", LINK, "up")
    assert frames_are_heard(20, is_tick)
    assert frames_are_heard(20, is_sensor)
    ip("del", LINK)
    time.sleep(1.5)
    ip("add", "dev", LINK, "type", "vcan")
    ip("set", LINK, "up")
    assert frames_are_heard(20, is_tick)
    assert frames_are_heard(20, is_sensor)
    time.sleep(1)

    said = {}
    for name, process in programs.items():
        assert process.poll() is None, name
        process.send_signal(signal.SIGINT)
        said[name] = process.communicate(timeout=60)
        assert process.returncode == 0, (name, said[name])
        assert "Traceback" not in said[name][1]
    for name in ("sim", "record", "monitor", "bridge"):
        lines = said[name][1].splitlines()
        assert [line for line in lines if "is down; waiting" in line or "is gone; waiting" in line] == [
            line for line in lines if "waiting for it" in line
        ]
        assert sum("waiting for it" in line for line in lines) == 2, (name, lines)
        assert sum("is there after" in line for line in lines) == 2, (name, lines)
    ticks = [json.loads(line)["tick"] for line in said["monitor"][0].splitlines()]
    assert ticks[-1] > 100
    assert json.loads(said["bridge"][0])["ticks"] > 50
    assert json.loads(said["sim"][0])["bus"]["outages"] == 2
    summary = json.loads(said["record"][0])
    assert summary["outages"] == 2
    assert 2.5 < summary["away_s"] < 15
    with can.LogReader(log) as reader:
        marks = [message for message in reader if message.is_error_frame]
    assert len(marks) == 2
    assert log.read_text().count("#47415000") == 2  # "GAP", then the milliseconds


def test_a_controller_that_starts_on_a_link_that_is_down_says_so(build_dir: Path, link: None) -> None:
    ip("set", LINK, "down")
    controller = start(str(build_dir / "examples" / "nao" / "nao_home"), "--can", BUS)
    try:
        time.sleep(1)
        assert controller.poll() is None
        ip("set", LINK, "up")
        assert frames_are_heard(20, is_tick)
    finally:
        controller.send_signal(signal.SIGINT)
        _, err = controller.communicate(timeout=60)
    assert controller.returncode == 0
    assert f"nao_home: {BUS}: the bus is down" in err
    assert "ip link set" in err


def test_a_listener_that_starts_on_a_link_that_is_down_waits_and_says_that_nothing_came(link: None) -> None:
    ip("set", LINK, "down")
    done = tool("record", "-o", "/dev/shm/never.log", "--duration", "1")
    _, err = done.communicate(timeout=60)
    assert done.returncode == 1
    assert f"{BUS} is down; waiting for it" in err
    assert "nothing came" in err
