# SPDX-License-Identifier: MIT
"""The missions on a unixbus: no root, no kernel CAN."""

from __future__ import annotations

from pathlib import Path

import pytest

from integration import missions


@pytest.fixture
def bus(bus_dir: Path) -> str:
    return f"unixbus:{bus_dir}/bus0"


@pytest.mark.parametrize("name", ["nao_home", "nao_power"])
@pytest.mark.timeout(600)
def test_lock_step_has_the_papers_ticks(build_dir: Path, bus: str, name: str) -> None:
    missions.lock_step_has_the_papers_ticks(build_dir, bus, name)


def test_a_dead_simulator_stops_the_tree_and_a_new_one_lets_it_go_on(build_dir: Path, bus: str) -> None:
    missions.a_dead_simulator_stops_the_tree_and_a_new_one_lets_it_go_on(build_dir, bus)


def test_a_dead_controller_stops_the_robot(build_dir: Path, bus: str) -> None:
    missions.a_dead_controller_stops_the_robot(build_dir, bus)


def test_bad_frames_change_nothing_but_a_counter(build_dir: Path, bus: str) -> None:
    missions.bad_frames_change_nothing_but_a_counter(build_dir, bus)


def test_the_mission_is_seen_in_lcm(build_dir: Path, bus: str) -> None:
    missions.the_mission_is_seen_in_lcm(build_dir, bus)
