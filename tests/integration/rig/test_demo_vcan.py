# SPDX-License-Identifier: MIT
"""canopy demo on vcan0, which it chooses by itself where it is up and free, with LCM in the same network."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

import can

from canopy.canbus import open_bus


def demo(build_dir: Path) -> list[str]:
    return [sys.executable, "-m", "canopy", "demo", "--build-dir", str(build_dir)]


def test_the_demo_chooses_vcan0(build_dir: Path) -> None:
    done = subprocess.run(demo(build_dir), capture_output=True, text=True, timeout=110)
    assert (done.returncode, done.stderr) == (0, "")
    assert "with the simulated robot on socketcan:vcan0, and on LCM" in done.stdout
    assert done.stdout.count("reached in") == 2
    assert done.stdout.count(" 0 trace frames lost, 0 ticks incomplete; ") == 2


def test_the_demo_leaves_a_bus_in_use_alone(build_dir: Path) -> None:
    stop = threading.Event()

    def send() -> None:
        with open_bus("socketcan:vcan0") as bus:
            while not stop.wait(0.02):
                bus.send(can.Message(arbitration_id=0x123, is_extended_id=False))

    sender = threading.Thread(target=send)
    sender.start()
    with subprocess.Popen(demo(build_dir), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    stop.set()
    sender.join()
    assert "with the simulated robot on unixbus:" in first
    assert process.returncode == 130
