# SPDX-License-Identifier: MIT
"""canopy-sim as a process on unixbus, opposite a small controller; with LCM in a network of its own."""

from __future__ import annotations

import json
import shutil
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from fractions import Fraction
from itertools import groupby, islice, pairwise
from pathlib import Path
from typing import Any

import can
import pytest

from canopy.lcm_link import CHANNEL_ROBOT, CHANNEL_ROBOT_COMMAND, DEFAULT_URL
from integration import paper
from integration.lcm_netns import NO_ROUTE, LcmNetwork
from integration.sim_peers import DBC, TICK, TICK_ID, Controller, Simulator

LCM_PEER = Path(__file__).parent / "lcm_peer.py"
STOP, DO_TASK, DRIVE, CHARGE = range(4)
STOP, SIT_UP, STAND_UP, WALK_HOME = range(4)
TIMEOUT = 0.5
"""GenMsgTimeoutTime of the commands [s]."""
SLACK = 0.1
"""For a busy machine [s]."""


@pytest.fixture
def bus(bus_dir: Path) -> str:
    return f"unixbus:{bus_dir}/bus0"


@pytest.fixture
def controller(bus: str) -> Iterator[Controller]:
    with Controller(bus) as controller:
        yield controller


def median_gap(times: list[float]) -> float:
    """Median of the times between neighbours: single ones may be late on a busy machine."""
    return statistics.median(later - earlier for earlier, later in pairwise(times))


def policy(sensors: dict[str, dict[str, Any]]) -> tuple[int, int]:
    """Both of the paper's trees, on what came over the bus; raw values, for the thresholds are exact only there."""
    level = round(sensors["Battery"]["Level"] * 10)
    distance = round(sensors["Battery"]["ChargerDistance"] * 1000)
    x, height = round(sensors["Posture"]["HeadX"] * 1000), round(sensors["Posture"]["HeadHeight"] * 1000)
    task = level >= 1000 or (distance >= 100 and level > 200)
    power = DO_TASK if task else CHARGE if distance < 100 else DRIVE
    if x <= 0:
        return power, STOP
    return power, WALK_HOME if height >= 480 else STAND_UP if height >= 300 else SIT_UP


def expected_phases(steps: int) -> list[list[object]]:
    """Phases of both examples side by side, from (22, 21) and (0.5, 0)."""
    power = [paper.MODES[step.phase] for step in islice(paper.example_4(Fraction(22), Fraction(21)), steps)]
    posture = [paper.MODES[step.phase] for step in paper.example_5(Fraction(1, 2), Fraction(0))]
    posture += ["Stop"] * (steps - len(posture))
    return [[*modes, len(list(run))] for modes, run in groupby(zip(power, posture, strict=True))]


def test_lock_step_makes_one_step_a_tick_and_counts_the_papers_phases(bus: str, controller: Controller) -> None:
    steps = 200
    with Simulator(bus, "--lock-step", "--no-lcm", "--power", "22,21", "--steps", str(steps)) as simulator:
        for number in range(steps):
            assert [controller.receive()[0] for _ in range(3)] == ["Battery", "Posture", "SimulationStep"]
            assert controller.sensors["SimulationStep"]["Step"] == number
            controller.answer(*policy(controller.sensors))
        summary = simulator.wait()
    assert summary["ended_by"] == "steps"
    assert summary["steps"] == steps
    assert summary["phases"] == expected_phases(steps)
    assert summary["minimum_battery"] == min(
        float(step.x2) for step in islice(paper.example_4(Fraction(22), Fraction(21)), steps)
    )
    assert summary["frames"]["accepted"] == 3 * steps
    assert summary["frames"]["sent"] == 3 * steps
    assert not any(summary["frames"]["refused"].values())
    assert summary["final"]["head_x"] == 0.0
    assert summary["commands_timed_out"] == summary["repeats"] == 0


def test_lock_step_repeats_the_same_step_and_later_renumbers_it(bus: str, controller: Controller) -> None:
    with Simulator(bus, "--lock-step", "--no-lcm") as simulator:
        times: dict[int, list[float]] = {}
        while 1 not in times:
            controller.receive_message("SimulationStep")
            times.setdefault(controller.sensors["SimulationStep"]["Step"], []).append(time.monotonic())
        assert len(times[0]) == 8
        assert median_gap(times[0]) == pytest.approx(0.25, abs=0.05)
        controller.answer(DO_TASK, SIT_UP)
        controller.receive_message("SimulationStep")
        assert controller.sensors["SimulationStep"]["Step"] == 2
        summary = simulator.end()
    assert summary["ended_by"] == "signal"
    assert summary["phases"] == [["DoTask", "SitUp", 1]]
    assert summary["repeats"] == 8


def test_lock_step_stops_the_robot_on_silence_and_goes_on_afterwards(bus: str, controller: Controller) -> None:
    with Simulator(bus, "--lock-step", "--no-lcm") as simulator:
        controller.receive_message("SimulationStep")
        controller.answer(DO_TASK, SIT_UP)
        controller.receive_for(TIMEOUT + 2 * SLACK)
        tick = can.Message(arbitration_id=TICK_ID, is_extended_id=False, data=TICK)
        controller.send(tick)  # a tick without commands: those of before do not hold any more
        controller.receive_for(SLACK)
        controller.answer(DO_TASK, SIT_UP)
        controller.receive_for(SLACK)
        summary = simulator.end(signal.SIGINT)
    assert summary["phases"] == [["DoTask", "SitUp", 1], ["Stop", "Stop", 1], ["DoTask", "SitUp", 1]]
    assert summary["commands_timed_out"] == 2
    assert not summary["final"]["stopped"]


def test_real_time_sends_sensors_at_their_cycle_time(bus: str, controller: Controller) -> None:
    with Simulator(bus, "--no-lcm", "--power", "0.1,100", "--posture", "0.25,0.33") as simulator:
        controller.receive_message("Posture")
        begin = time.monotonic()
        frames = controller.receive_for(2.0)
        summary = simulator.end()
    for name in ("Battery", "Posture"):
        arrivals = [frame.timestamp for found, frame in frames if found == name]
        # Absolute deadlines: the number of frames is right though single ones may be late.
        assert len(arrivals) == pytest.approx(40, abs=3)
        assert median_gap(arrivals) == pytest.approx(0.05, abs=0.02)
    assert {found for found, _ in frames} == {"Battery", "Posture"}
    battery, posture = controller.sensors["Battery"], controller.sensors["Posture"]
    assert (battery["Level"], battery["ChargerDistance"], battery["Charging"]) == (100, 0.1, 0)
    assert (posture["HeadX"], posture["HeadHeight"]) == (0.25, 0.33)
    # Nobody commanded: the robot has stood still.
    assert summary["final"]["stopped"]
    assert all(phase[:2] == ["Stop", "Stop"] for phase in summary["phases"])
    assert summary["steps"] <= time.monotonic() - begin + 1


def test_real_time_steps_follow_the_time_factor(bus: str, controller: Controller) -> None:
    """40 times as fast: a posture step every 25 ms, a power step every 250 ms."""
    begin = time.monotonic()
    with Simulator(bus, "--no-lcm", "--time-factor", "40", "--steps", "60", "--posture", "9,0.5") as simulator:
        while simulator.process.poll() is None:
            controller.send(controller.command("PowerCommand", DRIVE), controller.command("PostureCommand", WALK_HOME))
            time.sleep(0.05)
        summary = simulator.wait()
    assert time.monotonic() - begin >= 60 / 40
    commanded = sum(steps for power, posture, steps in summary["phases"] if posture == "WalkHome")
    assert commanded >= 30
    assert summary["final"]["head_x"] == pytest.approx(9 - 0.1 * commanded)
    driven = 80 - summary["final"]["charger_distance"]
    assert driven == pytest.approx(commanded / 10, abs=1)


def test_stops_on_silence_and_goes_on_afterwards(bus: str, controller: Controller) -> None:
    with Simulator(bus, "--no-lcm", "--time-factor", "20", "--posture", "10,0.5") as simulator:
        controller.receive_message("Posture")

        def walk_for(seconds: float) -> float:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                controller.send(controller.command("PostureCommand", WALK_HOME))
                controller.receive_for(0.05)
            return float(controller.sensors["Posture"]["HeadX"])

        walked = walk_for(0.5)
        assert walked < 10
        controller.receive_for(TIMEOUT + SLACK)
        stopped = controller.sensors["Posture"]["HeadX"]
        assert stopped < walked  # the command held until its timeout
        controller.receive_for(0.5)
        assert controller.sensors["Posture"]["HeadX"] == stopped
        assert walk_for(0.5) < stopped
        summary = simulator.end()
    assert summary["commands_timed_out"] == 1
    assert [phase[1] for phase in summary["phases"]] in (
        ["Stop", "WalkHome", "Stop", "WalkHome"],
        ["WalkHome", "Stop", "WalkHome"],
    )


def test_bad_frames_are_refused_and_change_nothing_but_a_counter(bus: str, controller: Controller) -> None:
    with Simulator(bus, "--no-lcm", "--time-factor", "20", "--posture", "10,0.5") as simulator:
        controller.receive_message("Posture")
        good = controller.command("PostureCommand", STOP)
        command = good.arbitration_id
        wrong_crc = controller.command("PostureCommand", WALK_HOME)
        wrong_crc.data[0] ^= 0x01
        masked = controller.command("PowerCommand", WALK_HOME)
        masked.arbitration_id = command
        controller.send(
            good,
            good,  # repeated
            wrong_crc,
            masked,  # another message's data id: wrong CRC
            can.Message(arbitration_id=command, is_extended_id=False, data=good.data[:2]),  # length
            can.Message(arbitration_id=command, is_extended_id=False, data=[*good.data, 0]),  # length
            can.Message(arbitration_id=command, is_extended_id=False, is_remote_frame=True, dlc=3),  # flags
            can.Message(arbitration_id=command, is_extended_id=True, data=good.data),  # flags
            controller.command("PostureCommand", 9),  # range: delta 2, since wrong_crc took a counter and was refused
            controller.command("PostureCommand", WALK_HOME, skip=5),  # sequence
            can.Message(arbitration_id=0x123, is_extended_id=False, data=bytes(8)),  # unknown
            can.Message(arbitration_id=0x601, is_extended_id=False, data=bytes(8)),  # CanopyChange: not for the robot
        )
        controller.receive_for(0.3)
        assert controller.sensors["Posture"]["HeadX"] == 10
        controller.send(controller.command("PostureCommand", WALK_HOME))  # in order after the wrong one
        controller.receive_for(0.3)
        assert controller.sensors["Posture"]["HeadX"] < 10
        frames = simulator.end()["frames"]
    refused = {"flags": 2, "length": 2, "crc": 2, "repeated": 1, "sequence": 1, "range": 1, "version": 0}
    assert frames["refused"] == refused
    assert (frames["accepted"], frames["unknown"], frames["ignored"]) == (2, 1, 1)
    assert frames["received"] == 13


def lcm_send(network: LcmNetwork, **fields: float) -> None:
    """One robot_command_t; values that are not named are NaN."""
    quantities = ("battery", "charger_distance", "head_x", "head_height", "ball_distance")
    values = dict.fromkeys(quantities, float("nan")) | fields
    peer = [sys.executable, str(LCM_PEER), "send", DEFAULT_URL, CHANNEL_ROBOT_COMMAND, "robot_command_t"]
    subprocess.run(network.command([*peer, json.dumps(values)]), check=True, timeout=20)


def until(controller: Controller, message: str, signal_name: str, value: float) -> None:
    """Waits until a sensor shows a value."""
    end = time.monotonic() + 5
    while controller.receive_message(message) and controller.sensors[message][signal_name] != value:
        assert time.monotonic() < end, f"{signal_name} is {controller.sensors[message][signal_name]}, not {value}"


def test_lcm_commands_and_state(bus: str, controller: Controller) -> None:
    with LcmNetwork() as network:
        listen = [sys.executable, str(LCM_PEER), "listen", DEFAULT_URL, "60", f"{CHANNEL_ROBOT}=robot_state_t"]
        listener = subprocess.Popen(network.command(listen), stdout=subprocess.PIPE, text=True)
        assert listener.stdout is not None
        try:
            assert json.loads(listener.stdout.readline()) == {"listening": True}
            with Simulator(bus, "--power", "12.345,67.8", enter=network.command([])) as simulator:
                until(controller, "Battery", "Level", 67.8)
                state = json.loads(listener.stdout.readline())
                assert (state["battery"], state["charger_distance"]) == (67.8, 12.345)
                assert state["stopped"] and state["sending"]
                assert (state["power_mode"], state["posture_mode"]) == (STOP, STOP)

                lcm_send(network, command=0, battery=20.5, head_height=0.49)
                until(controller, "Battery", "Level", 20.5)
                until(controller, "Posture", "HeadHeight", 0.49)
                assert controller.sensors["Battery"]["ChargerDistance"] == 12.345
                assert controller.sensors["Posture"]["HeadX"] == 0.5
                lcm_send(network, command=1)
                until(controller, "Posture", "HeadHeight", 0)
                lcm_send(network, command=0, battery=10, head_x=11)  # out of range: all of it is refused
                lcm_send(network, command=77)
                lcm_send(network, command=9, number=5)  # a small robot hears no wishes
                lcm_send(network, command=2)
                controller.receive_for(SLACK)
                assert controller.receive_for(0.3) == []
                lcm_send(network, command=3)
                until(controller, "Battery", "Level", 20.5)
                # Repeated, stale or lost frames would show here: the counters go on where they stopped.
                simulator.process.send_signal(signal.SIGTERM)
                out, err = simulator.process.communicate(timeout=20)
        finally:
            listener.kill()
            rest = listener.communicate()[0]
    summary = json.loads(out)
    assert {key: summary["lcm"][key] for key in ("commands", "refused")} == {"commands": 4, "refused": 3}
    assert 1 <= err.count("refused") <= 3  # one line a second at most
    states = [json.loads(line) for line in rest.splitlines() if line.endswith("}")]
    assert {state["sending"] for state in states} == {True, False}
    assert summary["lcm"]["published"] >= 1


def test_goes_on_without_lcm_where_no_route_is(bus: str, controller: Controller) -> None:
    with Simulator(bus, "--lock-step", "--steps", "1", enter=NO_ROUTE) as simulator:
        controller.receive_message("SimulationStep")
        controller.answer(DO_TASK, SIT_UP)
        out, err = simulator.process.communicate(timeout=20)
    assert simulator.process.returncode == 0
    assert json.loads(out)["lcm"] is None
    assert sum("ip route add" in line for line in err.splitlines()) == 1


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "canopy_sim", "--no-lcm", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


def test_summary_for_people(bus: str) -> None:
    done = run("--can", bus, "--dbc", str(DBC), "--time-factor", "100", "--steps", "3")
    assert done.returncode == 0
    assert "real time, 3 steps, ended by steps" in done.stdout
    assert "phase     Stop / Stop: 3 steps" in done.stdout


def test_bus_that_is_not_there_ends_with_1_and_one_line() -> None:
    done = run("--can", "socketcan:nosuch0", "--dbc", str(DBC))
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "unixbus:bus0" in done.stderr


def test_bus_that_goes_away_is_made_anew(bus: str, bus_dir: Path) -> None:
    with Simulator(bus, "--no-lcm") as simulator:
        with Controller(bus) as controller:
            controller.receive_message("Posture")
        shutil.rmtree(bus_dir / "bus0")
        with Controller(bus) as controller:
            controller.receive_message("Posture")
        simulator.process.send_signal(signal.SIGINT)
        out, err = simulator.process.communicate(timeout=10)
    assert simulator.process.returncode == 0
    data = json.loads(out)
    assert (data["ended_by"], data["bus"]["outages"]) == ("signal", 1)
    assert err.count("waiting for it") == err.count("is there after") == 1


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--can", "bus0"], "unixbus:NAME"),
        (["--power", "80"], "80,50"),
        (["--power", "80,50.05"], "1/10"),
        (["--power", "80,111"], "0..110"),
        (["--power", "1e400,50"], "out of range"),
        (["--posture", "0.5,-1"], "0..2"),
        (["--lock-step", "--time-factor", "2"], "--time-factor"),
        (["--time-factor", "0"], "0<x"),
        (["--power", "nan,50"], "out of range"),
        (["--dbc", "/nonexistent.dbc"], "/nonexistent.dbc"),
        (["--dbc", __file__], "test_sim_process.py"),
    ],
)
def test_wrong_command_lines_end_with_2(options: list[str], text: str, bus: str) -> None:
    done = run("--can", bus, "--dbc", str(DBC), *options)
    assert done.returncode == 2
    assert text in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("BO_ 528 PostureCommand", "BO_ 528 OtherCommand", "no message 'PostureCommand'"),
        (" SG_ HeadX ", " SG_ HeadZ ", "no signal HeadX"),
        ('2 "DriveToCharger"', '2 "Drive"', "PowerCommand.Mode"),
        ('"GenSigInactiveValue" SG_ 512 Mode 0', '"GenSigInactiveValue" SG_ 512 Mode 7', "is 7"),
        ('BA_ "GenMsgCycleTime" BO_ 256 50;', "", "Battery needs a GenMsgCycleTime"),
    ],
)
def test_a_dbc_of_another_robot_ends_with_2(old: str, new: str, text: str, bus: str, tmp_path: Path) -> None:
    described = DBC.read_text()
    assert old in described
    dbc = tmp_path / "other.dbc"
    dbc.write_text(described.replace(old, new))
    done = run("--can", bus, "--dbc", str(dbc))
    assert done.returncode == 2
    assert text in " ".join(done.stderr.split())
