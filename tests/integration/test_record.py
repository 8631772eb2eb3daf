# SPDX-License-Identifier: MIT
"""canopy record as a process, and runs in real time that are recorded and replayed bit for bit."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from click.testing import CliRunner

from canopy.canbus import open_bus
from canopy.cli import main
from canopy.trace import Status
from integration import logs, missions
from integration.processes import OwnedProcess
from integration.sim_peers import Simulator
from integration.trace_source import TraceSource, to_message, write_model


class Record(OwnedProcess):
    """The process canopy record; on the bus once the context has begun."""

    def __init__(self, bus: str, output: Path, *options: str) -> None:
        command = [sys.executable, "-m", "canopy", "record", "--can", bus, "-o", str(output), "--json", *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.said = ""

    def end(self, number: signal.Signals = signal.SIGINT) -> dict[str, Any]:
        """Ends it with a signal; gives the summary."""
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=60)
        self.said += err
        data: dict[str, Any] = json.loads(out)
        return data

    def __enter__(self) -> Record:
        assert self.process.stderr is not None
        self.said = self.process.stderr.readline()
        assert "(Ctrl-C ends)" in self.said, self.said
        return self


@pytest.fixture
def bus(bus_dir: Path) -> str:
    return f"unixbus:{bus_dir}/bus0"


@pytest.fixture
def sender(bus: str) -> Iterator[can.BusABC]:
    with open_bus(bus) as opened:
        yield opened


def wait_for_size(path: Path, size: int) -> None:
    end = time.monotonic() + 60
    while not path.is_file() or path.stat().st_size < size:
        assert time.monotonic() < end, "nothing is written"
        time.sleep(0.02)


def record_in_process(*arguments: str) -> Any:
    return CliRunner().invoke(main, ["record", *arguments])


# --- a mission in real time -------------------------------------------------------------------------------------------


def run_mission(build_dir: Path, bus: str, name: str, output: Path) -> tuple[dict[str, Any], int, list[str]]:
    """Jitter, frames that are refused, a robot that falls silent, another one that comes with counters of its own.

    Returns the record's summary, frames that somebody was too slow for, and the modes commanded.
    """
    start = ["--posture", "0.5,0", "--power", "25,20", "--no-lcm"]
    start += ["--time-factor", "5" if name == "nao_home" else "100"]
    command = "PostureCommand" if name == "nao_home" else "PowerCommand"
    model = build_dir / "examples" / "nao" / "generated" / name / f"{name}.model.json"

    def has_gone_on(modes: int) -> bool:
        return len(set(observer.modes[command])) > modes

    with missions.Observer(build_dir, name, bus) as observer, open_bus(bus) as noise:
        with Simulator(bus, *start) as simulator:
            observer.wait_for(lambda: "Battery" in observer.values, 60)
            with (
                Record(bus, output, "--model", str(model)) as record,
                missions.ControllerProcess(build_dir, name, bus) as controller,
            ):
                observer.wait_for(lambda: has_gone_on(1), 60)
                controller.process.send_signal(signal.SIGSTOP)  # a late cycle, an overrun, and cycles left out
                time.sleep(0.12)
                controller.process.send_signal(signal.SIGCONT)
                ticks = len(observer.views)
                observer.wait_for_ticks(ticks + 10, stall=60)
                lost = simulator.end()["bus"]["tx_dropped"]
                observer.wait_for(lambda: observer.views[-1].root_status == Status.FAILURE, 60)
                for bad in (logs.frame(0x100, b"\x01"), logs.frame(0x110, bytes(8)), logs.frame(0x123, b"abc")):
                    noise.send(bad)
                observer.wait_for(lambda: (observer.trace.health.rx_rejected or 0) >= 2, 60)
                with Simulator(bus, *start) as second:
                    observer.wait_for(lambda: observer.views[-1].root_status == Status.RUNNING, 60)
                    observer.wait_for(lambda: has_gone_on(2), 60)
                    report = controller.end()
                    lost += second.end()["bus"]["tx_dropped"]
                summary = record.end()
        modes = observer.modes[command]
    assert record.process.returncode == 0
    assert report["refused"] >= 2
    assert report["timeouts"] >= 2
    return summary, lost + report["lost"] + summary["lost"] + summary["trace_lost"], modes


@pytest.mark.parametrize("name", ["nao_home", "nao_power"])
@pytest.mark.timeout(600)
def test_a_recorded_mission_is_replayed(build_dir: Path, bus: str, name: str, tmp_path: Path) -> None:
    for attempt in range(missions.ATTEMPTS):  # a machine too loaded for a run without losses says so, and tries again
        log = tmp_path / f"{attempt}.log"
        summary, lost, modes = run_mission(build_dir, bus, name, log)
        if not lost:
            break
    assert lost == 0
    assert len(set(modes)) > 2
    assert (summary["starts"], summary["error_frames"]) == (1, 0)
    program = build_dir / "examples" / "nao" / name
    model = program.parent / "generated" / name / f"{name}.model.json"
    command = ["replay", str(log), "--model", str(model), "--program", str(program), "--json"]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, (result.output, result.exception)
    data = json.loads(result.stdout)
    assert summary["ticks"] - 1 <= data["ticks"] <= summary["ticks"]
    assert data["ticks"] > 30
    assert data["inputs"] > 30
    # Other tools read it: a line a frame, as candump writes it.
    assert log.read_text().count("\n") == summary["frames"]


# --- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf"])
def test_every_frame_is_written_as_it_came(bus: str, sender: can.BusABC, tmp_path: Path, suffix: str) -> None:
    output = tmp_path / f"run{suffix}"
    sent = [
        logs.frame(0x123, bytes(range(8))),
        can.Message(arbitration_id=0x1ABCDEF, is_extended_id=True, data=b"\xff"),
        can.Message(arbitration_id=0x7FF, is_extended_id=False, is_fd=True, bitrate_switch=True, data=bytes(64)),
        can.Message(arbitration_id=0x5, is_extended_id=False, is_remote_frame=True, dlc=0),
        can.Message(is_error_frame=True, is_extended_id=False, dlc=8, data=bytes(8)),
        *(logs.frame(0x200, number.to_bytes(2, "little")) for number in range(500)),
    ]
    begin = time.time()
    with Record(bus, output) as record:
        for message in sent:
            sender.send(message, timeout=10)
        data = record.end(signal.SIGTERM)
    assert (record.process.returncode, data["frames"], data["lost"]) == (0, len(sent), 0)
    assert (data["error_frames"], data["ticks"], data["file"]) == (1, None, str(output))
    with can.LogReader(output) as log:
        read = list(log)
    assert len(read) == len(sent)
    for was, now in zip(sent, read, strict=True):
        assert now.is_error_frame == was.is_error_frame
        if not was.is_error_frame:
            names = ("arbitration_id", "is_extended_id", "is_remote_frame", "is_fd", "bitrate_switch", "data")
            assert [getattr(now, name) for name in names] == [getattr(was, name) for name in names]
            # python-can reads the times of an .asc as from its first frame.
            assert 0 <= now.timestamp - (0 if suffix == ".asc" else begin) < 600


def test_a_file_that_is_there_is_kept(bus: str, tmp_path: Path) -> None:
    output = tmp_path / "run.log"
    output.write_text("precious")
    result = record_in_process("--can", bus, "-o", str(output))
    assert result.exit_code == 1
    assert (
        result.stderr == f"canopy record: {output}: is there already; give another name, or --force to overwrite it\n"
    )
    assert output.read_text() == "precious"
    with Record(bus, output, "--force", "--duration", "0.2") as record:
        out, _ = record.process.communicate(timeout=60)
    assert (record.process.returncode, json.loads(out)["frames"], output.read_text()) == (1, 0, "")


@pytest.mark.parametrize(
    ("output", "text"),
    [
        ("run.txt", "run.txt: the suffix says the format, and must be one of .log, .asc, .blf"),
        ("run.csv", "run.csv: the suffix says the format"),
        ("no/folder/run.log", "no/folder/run.log: cannot be written: No such file or directory"),
    ],
)
def test_a_file_that_cannot_be_made(bus: str, tmp_path: Path, output: str, text: str) -> None:
    result = record_in_process("--can", bus, "-o", str(tmp_path / output))
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    assert text in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_bus_or_a_model_that_is_not_there_leaves_no_file(bus: str, tmp_path: Path) -> None:
    output = str(tmp_path / "run.log")
    assert "is no CAN bus" in record_in_process("--can", "bus0", "-o", output).stderr
    result = record_in_process("--can", bus, "-o", output, "--model", str(tmp_path / "x.json"))
    assert (result.exit_code, list(tmp_path.iterdir())) == (1, [])
    assert "cannot be read" in result.stderr


def test_a_full_disk_is_told(bus: str, sender: can.BusABC, tmp_path: Path) -> None:
    output = tmp_path / "full.log"
    output.symlink_to("/dev/full")
    with Record(bus, output, "--force") as record:
        for number in range(2000):
            sender.send(logs.frame(0x200, number.to_bytes(2, "little")))
        out, err = record.process.communicate(timeout=60)
    assert (record.process.returncode, out) == (3, "")
    assert f"canopy record: {output}: [Errno {28}] No space left on device" in err.splitlines()[-1], err


# --- what it tells ----------------------------------------------------------------------------------------------------


def test_losses_and_a_late_start_are_said(bus: str, sender: can.BusABC, tmp_path: Path) -> None:
    source = TraceSource(4)
    ticks = [source.frames([1, 3, 1, number % 2]) for number in range(12)]
    with Record(bus, tmp_path / "run.log", "--model", str(write_model(tmp_path))) as record:
        for number, frames in enumerate(ticks[3:]):
            for frame in frames[: -1 if number == 5 else None]:
                sender.send(to_message(frame), timeout=10)
        data = record.end()
    assert (record.process.returncode, data["ticks"], data["trace_lost"], data["starts"]) == (0, 9, 1, 0)
    assert "the controller was running already (tick 3); a replay begins with its first tick" in record.said
    assert record.said.count("trace frames are lost on the way") == 1


def test_another_controllers_model_is_said_but_the_record_goes_on(bus: str, sender: can.BusABC, tmp_path: Path) -> None:
    with Record(bus, tmp_path / "run.log", "--model", str(write_model(tmp_path))) as record:
        sender.send(logs.frame(0x607, bytes.fromhex("2078563412070000")))
        sender.send(logs.frame(0x123))
        data = record.end()
    assert (record.process.returncode, data["frames"], data["disagreements"]) == (0, 2, 1)
    assert "is not the model of the tree that the controller runs: that one has 7 nodes and the hash 12345678…" in (
        record.said
    )


def test_progress_is_shown(bus: str, sender: can.BusABC, tmp_path: Path) -> None:
    with Record(bus, tmp_path / "run.log") as record:
        assert record.process.stderr is not None
        sender.send(logs.frame(0x123))
        line = record.process.stderr.readline()
        record.end()
    assert line.startswith("canopy record: 1 frames in ")
    assert os.linesep in line
    assert "\r" not in line
