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
from typing import Any

import pytest
from rich.console import Console

from canopy.canbus import open_bus
from canopy.model import load_model
from canopy.view import line, picture, symbol
from canopy.watch import Watch
from integration.trace_source import SLOTS, TEXTS, VALUES, TraceSource, database, to_message, write_model

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
    assert [node["status"] for node in last["nodes"]] == ["RUNNING", "FAILURE", "RUNNING", "IDLE (halted now)"]
    assert all(node["certain"] and node["told"] == node["status"] for node in last["nodes"])
    assert all(0 <= node["since"] <= last["tick"] for node in last["nodes"])
    assert (last["values"], last["crc_errors"], last["health"]["rx_rejected"]) == ([], 0, None)
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
    for part in (
        "?  Get home",
        "(n1)",
        "FAILURE",
        "IDLE (halted now)",
        "Level",
        "49.3 %",
        "-0.932 m",
        "WalkHome",
        "ticks/s",
    ):
        assert part in picture, picture
    assert "\x1b[1;33m?  Get home" in picture  # RUNNING is bold yellow
    assert "\x1b[1;31mFAILURE" in picture
    assert text.endswith("\x1b[?25h")  # the cursor is there again


def test_the_state_of_the_bus_and_the_counters_are_shown(tmp_path: Path) -> None:
    watch, source = Watch(load_model(write_model(tmp_path))), TraceSource(4)

    def feed(*frames: tuple[int, bytes], **inputs: int) -> tuple[str, dict[str, Any]]:
        for frame in (*frames, *source.frames([1, 3, 1, 9], values=(), **inputs)):
            watch.feed(*frame, 1.0)
        return line(watch, 1.0), watch.snapshot(1.0)

    text, data = feed()
    assert "; bus " not in text
    assert "controller" not in text
    assert (data["bus"], data["overload"], data["returning"]) == ("error-active", False, False)
    text, data = feed(source.health(0, 3, 12, 0), source.health(1, 1, 0, 7))
    assert "; controller: 3 refused, 12 unknown, 1 replaced, 7 trace frames dropped" in text
    assert (data["health"]["rx_unknown"], data["health"]["rx_filtered"]) == (12, False)
    pages = source.health(0, 0, 0, 0, filtered=True), source.health(2, 0, 1234, 0, last=1)
    text, data = feed(*pages, CanState=2, Overload=1)
    assert "; bus error-passive, overload; " in text
    assert "; controller: 0 refused, unknown filtered, longest cycle 1.234 ms, latest 2.56 ms" in text
    assert (data["bus"], data["overload"], data["returning"]) == ("error-passive", True, False)
    assert (data["health"]["rx_unknown"], data["health"]["rx_filtered"]) == (None, True)
    console = Console(width=160)
    with console.capture() as capture:
        console.print(picture(watch, 1.0, "title"))
    assert "; bus error-passive, overload; " in capture.get()


def test_what_is_not_certain_is_not_shown_as_the_truth(tmp_path: Path) -> None:
    watch = Watch(load_model(write_model(tmp_path, values=VALUES, texts=TEXTS)))
    source = TraceSource(4, SLOTS, snapshot_every=1000, changes_max=1)
    feed = [source.frames([1, 3, 1, 2], values=[5, 0, 0, 215]), source.frames([1, 3, 1, 7], values=[5, 0, 0, 215])]
    for frame in feed[0] + feed[1]:
        watch.feed(*frame, 1.0)
    text, data = line(watch, 1.0), watch.snapshot(1.0)
    assert "[n1 FAILURE, n2 RUNNING, n3 FAILURE (kept)]" in text
    assert "; count 5, arm/far 0 mm, warm 21.5 °C, n1 none, word , exact 0, 2 more; " in text
    assert data["nodes"][3] == {
        "name": "n3",
        "type": "Look",
        "status": "FAILURE (kept)",
        "told": "FAILURE (kept)",
        "certain": True,
        "since": 1,
        "since_exact": True,
    }
    assert data["values"][2] == {
        "kind": "entry",
        "name": "warm",
        "node": None,
        "value": 21.5,
        "unit": "°C",
        "certain": True,
    }
    console = Console(width=160)
    with console.capture() as capture:
        console.print(picture(watch, 1.0, "title"))
    assert "(n3)  FAILURE (kept) since tick 1" in capture.get()
    assert "21.5 °C" in capture.get()
    watch.feed(*source.frames([1, 3, 1, 7])[0], 1.0)
    tick = source.frames([1, 3, 1, 2])
    for frame in (tick[0], *tick[2:]):
        watch.feed(*frame, 1.0)
    text, data = line(watch, 1.0), watch.snapshot(1.0)
    assert "[]" not in text
    assert (data["nodes"][1]["status"], data["nodes"][1]["certain"]) == ("FAILURE", True)
    watch.idle(2.0)
    for frame in source.frames([2, 2, 2, 2])[1:]:
        watch.feed(*frame, 2.0)
    for frame in source.frames([2, 2, 2, 2]):
        watch.feed(*frame, 2.0)
    text, data = line(watch, 2.0), watch.snapshot(2.0)
    assert " [] " in text
    assert (data["nodes"][1]["status"], data["nodes"][1]["certain"], data["nodes"][1]["since"]) == (
        "unknown",
        False,
        None,
    )


def test_a_frame_of_a_tick_that_is_long_over_is_not_believed(tmp_path: Path) -> None:
    """Sixteen ticks later the numbers fit again; the time does not."""
    watch, source = Watch(load_model(write_model(tmp_path))), TraceSource(4, snapshot_every=1000)
    for frame in source.frames([0] * 4):
        watch.feed(*frame, 0.0)
    for frame in source.frames([1] * 4)[:2]:
        watch.feed(*frame, 0.05)
    source.tick, source.sequence = 17, 3
    late = source.frames([2] * 4)[2:]
    assert len(late) == 1
    (view,) = watch.feed(*late[0], 0.05 + 16 * 0.05)
    assert view.tick == 1
    assert not any(node.certain for node in view.nodes)


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
