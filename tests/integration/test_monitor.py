# SPDX-License-Identifier: MIT
"""canopy monitor: lines and JSON into a pipe, a picture in a terminal (a pseudo-terminal here)."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rich.console import Console

from canopy.canbus import open_bus
from canopy.model import load_model
from canopy.view import line, picture, symbol
from canopy.watch import Watch
from integration.trace_source import TraceSource, database, to_message, write_model

SPEC = "unixbus:monitor"


def robot_frames() -> list[tuple[int, bytes]]:
    """One frame of each message that the controller receives and sends."""
    values: dict[str, dict[str, int | float]] = {
        "Battery": {"Charging": 0, "Level": 49.3, "ChargerDistance": -0.932},
        "Posture": {"HeadX": 0.5, "HeadHeight": 0.48},
        "PowerCommand": {"Mode": 2},
        "PostureCommand": {"Mode": 3},
    }
    found = database()
    frames = []
    for name, fields in values.items():
        message = found.get_message_by_name(name)
        frames.append((message.frame_id, message.encode({"E2E_CRC": 0, "E2E_Counter": 0, **fields})))
    return frames


@pytest.fixture
def traffic(bus_dir: Path) -> Iterator[Callable[[], None]]:
    """A controller and a robot on the bus, in real time, until the function is called or the test ends."""
    stop = threading.Event()

    def run() -> None:
        source = TraceSource(4)
        with open_bus(SPEC) as bus:
            while not stop.wait(0.05):
                for frame in robot_frames() + source.frames([1, 3, 1, 9]):
                    bus.send(to_message(frame))

    thread = threading.Thread(target=run)
    thread.start()
    yield stop.set
    stop.set()
    thread.join()


def monitor(model: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "canopy", "monitor", "--model", str(model), "--can", SPEC, *options]


def test_a_pipe_gets_lines_without_colours(tmp_path: Path, traffic: Callable[[], None]) -> None:
    command = monitor(write_model(tmp_path), "--duration", "1.5", "--period", "0.4")
    environment = dict(os.environ, FORCE_COLOR="1", TERM="xterm-256color")
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert "\x1b" not in done.stdout
    lines = done.stdout.splitlines()
    assert len(lines) in (2, 3)
    assert "RUNNING [n1 FAILURE, n2 RUNNING] Charging 0, Level 49.3 %, ChargerDistance -0.932 m" in lines[-1]
    assert (
        "HeadX 0.500 m, HeadHeight 0.480 m, PowerCommand.Mode DriveToCharger, PostureCommand.Mode WalkHome" in lines[-1]
    )
    assert "0 overruns, 0 trace frames lost" in lines[-1]


def test_json_has_one_object_for_each_tick(tmp_path: Path, traffic: Callable[[], None]) -> None:
    command = monitor(write_model(tmp_path), "--duration", "2", "--period", "0", "--json")
    done = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert (done.returncode, done.stderr) == (0, "")
    ticks = [json.loads(text) for text in done.stdout.splitlines()]
    numbers = [tick["tick"] for tick in ticks]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert len(numbers) > 10
    last = ticks[-1]
    assert last["signals"]["Battery"] == {"Charging": 0, "Level": 49.3, "ChargerDistance": -0.932}
    assert last["signals"]["PostureCommand"] == {"Mode": "WalkHome"}
    assert [node["status"] for node in last["nodes"]] == ["RUNNING", "FAILURE", "RUNNING", "IDLE (was RUNNING)"]
    assert (last["root"], last["lost"], last["complete"], last["stale"]) == ("RUNNING", 0, True, [])
    assert 10 < last["ticks_per_s"] < 25


def read_terminal(command: list[str], seconds: float, columns: int = 110) -> tuple[str, int]:
    """Runs the command in a pseudo-terminal, ends it with SIGINT; gives what it wrote, and its status."""
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR", "COLUMNS", "LINES")}
    environment.update(TERM="xterm-256color", LC_ALL="C.UTF-8")
    process = subprocess.Popen(command, stdin=follower, stdout=follower, stderr=follower, env=environment)
    os.close(follower)
    end, written = time.monotonic() + seconds, b""
    with contextlib.closing(os.fdopen(leader, "rb", buffering=0)) as terminal:
        signalled = False
        while process.poll() is None or select.select([terminal], [], [], 0)[0]:
            if time.monotonic() > end and not signalled:
                process.send_signal(signal.SIGINT)
                signalled = True
            try:
                if select.select([terminal], [], [], 0.1)[0]:
                    written += os.read(leader, 65536)
            except OSError as error:
                assert error.errno == errno.EIO  # the other side is closed
                break
        return written.decode(), process.wait(20)


def test_a_terminal_gets_a_picture(tmp_path: Path, traffic: Callable[[], None]) -> None:
    text, status = read_terminal(monitor(write_model(tmp_path)), 3)
    assert status == 0
    picture = text[text.rindex("GetHome") :]
    for part in ("?  Get home", "(n1)", "FAILURE", "was RUNNING", "Level", "49.3 %", "-0.932 m", "WalkHome", "ticks/s"):
        assert part in picture, picture
    assert "\x1b[1;33m?  Get home" in picture  # RUNNING is bold yellow
    assert "\x1b[1;31mFAILURE" in picture
    assert text.endswith("\x1b[?25h")  # the cursor is there again


def test_the_state_of_the_bus_and_of_the_filter_is_shown(tmp_path: Path) -> None:
    watch, source = Watch(load_model(write_model(tmp_path))), TraceSource(4)

    def feed(*frames: tuple[int, bytes]) -> tuple[str, dict[str, object]]:
        tick, *rest = source.frames([1, 3, 1, 9])
        for frame in (tick, *frames, *rest):
            watch.feed(*frame, 1.0)
        return line(watch, 1.0), watch.snapshot(1.0)

    text, data = feed()
    assert "; bus " not in text
    assert (data["bus"], data["overload"], data["returning"], data["rx_unknown"]) == (None, None, None, 0)
    text, data = feed(source.arrivals(ages=[3]), source.health(RxUnknown=12))
    assert "; bus " not in text
    assert "0 refused, 12 unknown, 0 not sent" in text
    assert (data["bus"], data["overload"], data["returning"], data["rx_unknown"]) == ("error-active", False, False, 12)
    text, data = feed(source.arrivals(state=2, overload=1), source.health(RxUnknown=65535, TxDropped=3))
    assert "; bus error-passive, overload; " in text
    assert "0 refused, unknown filtered, 3 not sent" in text
    assert (data["bus"], data["overload"], data["returning"], data["rx_unknown"]) == (
        "error-passive",
        True,
        False,
        None,
    )
    console = Console(width=160)
    with console.capture() as capture:
        console.print(picture(watch, 1.0, "title"))
    assert "; bus error-passive, overload; " in capture.get()


def test_silence_is_shown(tmp_path: Path) -> None:
    watch = Watch(load_model(write_model(tmp_path)))
    assert line(watch, 0.0) == "nao_home: no trace yet"
    source = TraceSource(4)
    for tick in range(41):
        for frame in robot_frames() + source.frames([1, 3, 1, 9]):
            watch.feed(*frame, 100 + tick * 0.05)
    assert "; 20.0 ticks/s;" in line(watch, 102.1)
    assert "stale" not in line(watch, 102.1)
    late = line(watch, 105.0)
    assert "SILENT for 3.0 s" in late
    assert late.count("(stale)") == 7
    assert watch.snapshot(105.0)["stale"] == ["Battery", "Posture", "PostureCommand", "PowerCommand"]


def test_a_frame_of_a_wrong_length_is_counted(tmp_path: Path) -> None:
    watch = Watch(load_model(write_model(tmp_path)))
    watch.feed(0x100, b"123", 0.0)
    assert watch.snapshot(0.0)["refused"] == 1
    assert watch.signals.value("Battery", "Level") is None


def test_symbols_are_the_papers(tmp_path: Path) -> None:
    root, leaf = load_model(write_model(tmp_path)).nodes[:2]
    assert (symbol(root), symbol(leaf)) == ("?", "Look")
