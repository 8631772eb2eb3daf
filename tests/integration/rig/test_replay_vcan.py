# SPDX-License-Identifier: MIT
"""canopy record on vcan0, beside candump; both logs are replayed. And what the kernel drops is counted."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import can
import pytest
from click.testing import CliRunner

from canopy.canbus import open_bus
from canopy.cli import main
from integration import logs, missions
from integration.rig.test_missions_vcan import candump
from integration.rig.vcan import Queue, vxcan_pair
from integration.sim_peers import Simulator
from integration.test_record import Record

BUS = "socketcan:vcan0"
TICKS = 20


@pytest.mark.timeout(300)
def test_both_logs_of_a_run_are_replayed(build_dir: Path, tmp_path: Path) -> None:
    program = build_dir / "examples" / "nao" / "nao_home"
    model = program.parent / "generated" / "nao_home" / "nao_home.model.json"
    with Record(BUS, tmp_path / "own.log", "--model", str(model)) as record, candump(tmp_path / "foreign.log"):
        with (
            Simulator(BUS, "--lock-step", "--no-lcm", "--steps", str(TICKS), "--posture", "0.5,0") as simulator,
            missions.ControllerProcess(build_dir, "nao_home", BUS, "--lock-step", "--ticks", str(TICKS)) as controller,
        ):
            assert controller.wait()["expired"] == 0
            simulator.wait()
        summary = record.end()
    assert (summary["lost"], summary["trace_lost"], summary["starts"]) == (0, 0, 1)
    for name in ("own.log", "foreign.log"):
        command = ["replay", str(tmp_path / name), "--model", str(model), "--program", str(program), "--json"]
        result = CliRunner().invoke(main, command)
        assert result.exit_code == 0, (name, result.output, result.exception)
        assert json.loads(result.stdout)["ticks"] == TICKS


@pytest.mark.timeout(300)
def test_a_run_across_a_blocked_bus_is_replayed(build_dir: Path, tmp_path: Path) -> None:
    """The trace has room for four ticks: a bus that is blocked for three takes nothing away from the replay."""
    program = build_dir / "examples" / "nao" / "nao_home"
    model = program.parent / "generated" / "nao_home" / "nao_home.model.json"
    log, ticks, period_s = tmp_path / "run.log", 120, 0.05
    far, near = "socketcan:vxcan1", "socketcan:vxcan0"
    with vxcan_pair(), Queue("vxcan0", 10) as queue, Record(far, log, "--model", str(model)) as record:
        with (
            Simulator(far, "--no-lcm", "--posture", "0.5,0"),
            missions.ControllerProcess(build_dir, "nao_home", near, "--ticks", str(ticks)) as controller,
        ):
            for _ in range(3):
                time.sleep(1)
                queue.block()
                time.sleep(3 * period_s)
                queue.release()
            told = controller.wait()
        assert record.end()["trace_lost"] == 0
    assert told["replaced"] + told["expired"] >= 3 * 2  # it was blocked
    command = ["replay", str(log), "--model", str(model), "--program", str(program), "--json"]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, (result.output, result.exception)
    data = json.loads(result.stdout)
    assert (data["equal"], data["ticks"]) == (True, ticks)
    assert data["dropped"] >= 3 * 2


def test_fd_frames_are_recorded_and_what_the_kernel_drops_is_counted(tmp_path: Path) -> None:
    flood = 20_000
    output = tmp_path / "run.log"
    with open_bus(BUS, fd=True) as bus, Record(BUS, output) as record:
        bus.send(can.Message(arbitration_id=0x7F0, is_extended_id=False, is_fd=True, data=bytes(48)))
        record.process.send_signal(signal.SIGSTOP)
        for number in range(flood):
            bus.send(logs.frame(0x7F1, number.to_bytes(4, "little")))
        record.process.send_signal(signal.SIGCONT)
        data = record.end()
    assert record.process.returncode == 0
    assert data["lost"] > 0
    assert data["frames"] + data["lost"] == flood + 1
    assert "frames are lost: this machine is too slow for the bus" in record.said
    with can.LogReader(output) as log:
        first = next(iter(log))
    assert (first.arbitration_id, first.is_fd, len(first.data)) == (0x7F0, True, 48)
