# SPDX-License-Identifier: MIT
"""The missions on vcan0, with can-utils' candump as a foreign listener."""

from __future__ import annotations

import re
import signal
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from itertools import islice
from pathlib import Path

import cantools
import pytest
from cantools.database.can import Database

from integration import missions, paper
from integration.sim_peers import DBC

BUS = "socketcan:vcan0"


@contextmanager
def candump(file: Path) -> Iterator[None]:
    """Candump writing the whole bus to a file, with a buffer that a burst does not overrun."""
    with file.open("wb") as log:
        process = subprocess.Popen(["candump", "-L", "-r", "8000000", "vcan0"], stdout=log)
        try:
            yield
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(10)


@pytest.mark.timeout(600)  # one shared CPU in the guest: 2,000 ticks take 20 s when it is alone
@pytest.mark.parametrize("name", ["nao_home", "nao_power"])
def test_lock_step_has_the_papers_ticks_and_candump_sees_them(build_dir: Path, tmp_path: Path, name: str) -> None:
    dump = tmp_path / "bus.log"
    with candump(dump):
        observer = missions.lock_step_has_the_papers_ticks(build_dir, BUS, name)
    frames = re.findall(r"^\(\d+\.\d+\) vcan0 ([0-9A-F]{3})#([0-9A-F]*)$", dump.read_text(), re.MULTILINE)
    assert len(frames) == len(dump.read_text().splitlines())
    count = Counter(identifier for identifier, _ in frames)
    ticks = len(observer.modes["PowerCommand"]) - 1
    # Ticks and commands once a tick, and the safe commands once more at the end.
    assert (count["600"], count["200"], count["210"]) == (ticks, ticks + 1, ticks + 1)
    database = cantools.database.load_file(DBC)
    assert isinstance(database, Database)
    battery = [bytes.fromhex(data) for identifier, data in frames if identifier == "100"]
    assert len(battery) >= ticks
    if name == "nao_power":
        # The simulator may have repeated its first sensors while the controller was starting.
        message = database.get_message_by_frame_id(0x100)
        frames_of_ticks = battery[len(battery) - ticks :]
        levels = [dict(message.decode_simple(data, scaling=False))["Level"] for data in frames_of_ticks]
        exact = [int(step.x2 * 10) for step in islice(paper.example_4(Fraction(80), Fraction(50)), ticks)]
        assert levels == exact


def test_a_dead_simulator_stops_the_tree_and_a_new_one_lets_it_go_on(build_dir: Path) -> None:
    missions.a_dead_simulator_stops_the_tree_and_a_new_one_lets_it_go_on(build_dir, BUS)


def test_a_dead_controller_stops_the_robot(build_dir: Path) -> None:
    missions.a_dead_controller_stops_the_robot(build_dir, BUS)


def test_bad_frames_change_nothing_but_a_counter(build_dir: Path) -> None:
    missions.bad_frames_change_nothing_but_a_counter(build_dir, BUS)


def test_the_mission_is_seen_in_lcm(build_dir: Path) -> None:
    missions.the_mission_is_seen_in_lcm(build_dir, BUS)
