# SPDX-License-Identifier: MIT
"""Missions: what happens to the robot at which time, from a file; and the tour of the Big BT that is shipped."""

from __future__ import annotations

from pathlib import Path

import pytest

from canopy.compiler.errors import CompileError
from canopy_sim.deeds import Kind
from canopy_sim.plant import Wish
from canopy_sim.timetable import load_timetable
from integration.big_processes import BIG_DBC
from integration.missions import ControllerProcess
from integration.sim_peers import Simulator

TOUR = BIG_DBC.parent / "missions" / "tour.toml"


def test_events_are_read_in_the_order_of_their_times(tmp_path: Path) -> None:
    file = tmp_path / "mission.toml"
    file.write_text(
        '[[events]]\nat = 2.5\ndo = "bumper"\ntoes = ["left-outer", "right-outer"]\nms = 300\n'
        '[[events]]\nat = 1\ndo = "say"\nwish = "ball game"\n'
        '[[events]]\nat = 2\ndo = "set"\nbattery = 33.5\nhead_x = -0.25\n'
    )
    (said_at, said), (set_at, put), (pressed_at, pressed) = load_timetable(file)
    assert (said_at, said.kind, said.number) == (1000, Kind.SAY, Wish.BallGame)
    assert (set_at, put.kind, put.battery, put.head_x) == (2000, Kind.SET_STATE, 33.5, -0.25)
    assert (pressed_at, pressed.kind, pressed.number, pressed.milliseconds) == (2500, Kind.PRESS_TOES, 0b1001, 300)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 0, "1 to 10000"),
        ("speed = 3\n", 1, "unknown key 'speed'"),
        ("events = 3\n", 1, "1 to 10000"),
        ('[[events]]\ndo = "say"\nwish = "sit"\n', 1, "'at' is None"),
        ('[[events]]\nat = -1\ndo = "plug"\n', 2, "'at' is -1"),
        ('[[events]]\nat = 1\ndo = "psh-over"\n', 3, "'do' is 'psh-over'"),
        ('[[events]]\nat = 1\ndo = "say"\n', 3, "'say' needs 'wish'"),
        ('[[events]]\nat = 1\ndo = "say"\nwish = "fly"\n', 4, "'wish' is 'fly'"),
        ('[[events]]\nat = 1\ndo = "plug"\nwish = "sit"\n', 4, "'plug' has no 'wish'"),
        ('[[events]]\nat = 1\ndo = "drain"\npercent = 101\n', 4, "'percent' is 101"),
        ('[[events]]\nat = 1\ndo = "bumper"\ntoes = "left"\n', 4, "'toes' is 'left'"),
        ('[[events]]\nat = 1\ndo = "bumper"\nms = 1.5\n', 4, "'ms' is"),
        ('[[events]]\nat = true\ndo = "plug"\n', 2, "'at' is True"),
        ("[[events]\n", 1, "not valid TOML"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, text: str, line: int, message: str) -> None:
    file = tmp_path / "mission.toml"
    file.write_text(text)
    with pytest.raises(CompileError) as error:
        load_timetable(file)
    assert message in error.value.message
    assert error.value.place.line == line
    assert error.value.place.file == str(file)


@pytest.mark.timeout(120)
def test_the_tour_shows_all_that_the_big_bt_can_do(build_dir: Path, bus_dir: Path) -> None:
    """150 s of the robot's time in 15: five activities, ball, a fall, toes, and the way to the charger."""
    bus = f"unixbus:{bus_dir}/bus0"
    options = ["--profile", "nao", "--no-lcm", "--time-factor", "10", "--steps", "15000", "--mission", str(TOUR)]
    with Simulator(bus, *options, dbc=BIG_DBC) as simulator, ControllerProcess(build_dir, "nao_big", bus) as controller:
        summary = simulator.wait(100)
        controller.end()
    legs = {phase[1] for phase in summary["phases"]}
    assert {"SitDown", "LieDown", "SitUp", "StandUp", "ApproachBall", "BackOff"} <= legs
    power = [phase[0] for phase in summary["phases"]]
    assert "DriveToCharger" in power
    assert power[-1] in ("DriveToCharger", "Charge")


def test_a_mission_for_the_whole_robot_needs_its_bus(bus_dir: Path) -> None:
    simulator = Simulator(f"unixbus:{bus_dir}/bus0", "--no-lcm", "--mission", str(TOUR))
    with simulator:
        _, err = simulator.process.communicate(timeout=30)
    assert simulator.process.returncode == 2
    assert "big.dbc" in err
