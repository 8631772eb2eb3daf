# SPDX-License-Identifier: MIT
"""canopy demo with the real controllers and the real simulator, as a user runs it, and what it leaves behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import can
import pytest

from canopy.canbus import open_bus
from canopy.children import ChildError, Children
from canopy.stop import StopFlag
from integration.lcm_netns import NO_ROUTE, LcmNetwork


def demo(build_dir: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "canopy", "demo", "--build-dir", str(build_dir), *options]


def descendants(pid: int) -> list[int]:
    """Process ids of all that a process has started, and they in turn."""
    children = [
        int(text)
        for task in Path(f"/proc/{pid}/task").glob("*/children")
        for text in task.read_text(encoding="ascii").split()
    ]
    return children + [deeper for child in children for deeper in descendants(child)]


def test_both_goals_are_reached(build_dir: Path, bus_dir: Path) -> None:
    """The whole of it without a terminal: lines, no colours, both goals, nothing lost; with LCM and its bridge."""
    with LcmNetwork() as network:
        done = subprocess.run(
            network.command(demo(build_dir, "--can", "unixbus:demo")), capture_output=True, text=True, timeout=100
        )
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout
    assert "and on LCM" in done.stdout
    assert "nao_home: from the floor to standing at home: reached in" in done.stdout
    assert "phases (robot's time): SitUp 10 s, StandUp 4 s, WalkHome 5 s" in done.stdout
    assert "nao_power: work, but never run empty: reached in" in done.stdout
    for mode in ("DoTask", "DriveToCharger", "Charge"):
        assert f"PowerCommand.Mode {mode}" in done.stdout
    assert done.stdout.count(" 0 trace frames lost, 0 ticks incomplete; lowest battery ") == 2
    assert "lowest battery 0.0 %" not in done.stdout
    assert list((bus_dir / "demo").iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_and_all_it_has_started(build_dir: Path, bus_dir: Path, number: signal.Signals) -> None:
    # The tests may run under nohup, which has SIGHUP ignored, and the demo respects that.
    command = ["env", "--default-signal", *NO_ROUTE, *demo(build_dir, "--can", "unixbus:demo")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        end = time.monotonic() + 30
        while len(started := descendants(process.pid)) < 2:
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.05)
        process.send_signal(number)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "canopy demo: interrupted; all it had started has ended" in errors
    assert "canopy demo: going on without LCM: " in errors
    assert not [pid for pid in started if Path(f"/proc/{pid}").exists()]


def test_a_controller_that_dies_is_an_error(build_dir: Path, bus_dir: Path) -> None:
    command = [*NO_ROUTE, *demo(build_dir, "--can", "unixbus:demo")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        end = time.monotonic() + 30
        controllers: list[int] = []
        while not controllers:
            assert time.monotonic() < end
            time.sleep(0.05)
            started = descendants(process.pid)
            controllers = [pid for pid in started if _program(pid) == "nao_home"]
        os.kill(controllers[0], signal.SIGKILL)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "canopy demo: nao_home ended by itself, with status -9" in errors
    assert not [pid for pid in started if Path(f"/proc/{pid}").exists()]


def _program(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/comm").read_text(encoding="ascii").strip()
    except FileNotFoundError:
        return ""


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--build-dir", "/nothing"], "/nothing/examples/nao/nao_home is not built; mend with: make demo"),
        (["--can", "bus0"], "'bus0' is no CAN bus"),
    ],
)
def test_what_is_missing_is_said(build_dir: Path, bus_dir: Path, options: list[str], text: str) -> None:
    command = [*NO_ROUTE, *demo(build_dir), *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert done.returncode == 1
    assert f"canopy demo: {text}" in done.stderr


def test_a_bus_in_use_is_not_taken(build_dir: Path, bus_dir: Path) -> None:
    stop = threading.Event()

    def send() -> None:
        with open_bus("unixbus:demo") as bus:
            while not stop.wait(0.02):
                bus.send(can.Message(arbitration_id=0x123, is_extended_id=False))

    sender = threading.Thread(target=send)
    sender.start()
    command = [*NO_ROUTE, *demo(build_dir, "--can", "unixbus:demo")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30)
    stop.set()
    sender.join()
    assert done.returncode == 1
    assert "canopy demo: somebody sends on unixbus:demo already; stop that, or choose another bus" in done.stderr


def test_children_end_in_the_end(tmp_path: Path) -> None:
    with Children(tmp_path) as children:
        children.start("sleeper", ["sleep", "100"])
        children.start("deaf", ["sh", "-c", "trap '' INT; echo deaf; while :; do sleep 0.1; done"])
        children.check()
        with pytest.raises(ChildError, match="nothing: cannot start /nothing: No such file"):
            children.start("nothing", ["/nothing"])
        children.start("failing", ["sh", "-c", "echo so it is >&2; exit 3"])
        end = time.monotonic() + 10
        with pytest.raises(ChildError, match="failing ended by itself, with status 3: so it is"):
            while time.monotonic() < end:
                children.check()
                time.sleep(0.01)
        started = descendants(os.getpid())
        assert children.end("sleeper") == ""
    assert not [pid for pid in started if _program(pid) == "sleep" and os.getpgid(pid) == pid]


def test_the_stop_flag_puts_the_handlers_back() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with StopFlag() as stop:
        assert not stop
        signal.raise_signal(signal.SIGTERM)
        assert stop
    assert signal.getsignal(signal.SIGTERM) is before
