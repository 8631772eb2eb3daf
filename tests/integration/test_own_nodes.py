# SPDX-License-Identifier: MIT
"""docs/own-nodes.md walked from end to end: what it shows is what is there, and the courier does what it tells."""

from __future__ import annotations

import importlib.util
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

from canopy.canbus import is_plain_data, open_bus
from canopy.cli import main
from canopy.live.codes import UNKNOWN, last_result
from canopy.model import load_model
from canopy.trace import Status
from canopy.watch import Watch
from integration.language import ROOT, WARNINGS

COURIER = ROOT / "examples" / "courier"
PAGE = (ROOT / "docs" / "own-nodes.md").read_text(encoding="utf-8")
SHOWN = re.findall(r"^<!-- ([^\n]*) -->\n```\w*\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
COMMAND = re.search(r"^canopy compile (.*?) *--stubs nodes\.c -o generated$", PAGE, re.MULTILINE | re.DOTALL)


def compile_courier(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs the page's command; the results go to `folder`."""
    assert COMMAND is not None
    monkeypatch.chdir(COURIER)
    words = re.findall(r"'([^']*)'|([^\s\\]+)", COMMAND[1])
    arguments = ["compile", *(quoted or plain for quoted, plain in words)]
    output = ["--stubs", str(folder / "nodes.c"), "-o", str(folder / "generated")]
    result = CliRunner().invoke(main, [*arguments, *output])
    assert result.exit_code == 0, result.output


def test_the_skeletons_are_those_that_the_page_shows_and_they_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_courier(tmp_path, monkeypatch)
    stubs = (tmp_path / "nodes.c").read_text()
    assert dict(SHOWN)["stubs"] in stubs
    program = tmp_path / "program.c"
    program.write_text(
        '#include <stddef.h>\n#include "courier_app.h"\n'
        "int main(void) { return canopy_tree_validate(courier_app.tree, NULL); }\n"
    )
    sources = [program, tmp_path / "nodes.c", *(tmp_path / "generated").glob("*.c")]
    sources += (ROOT / "runtime" / "src").glob("*.c")
    include = [f"-I{folder}" for folder in (ROOT / "runtime" / "include", tmp_path / "generated", COURIER)]
    command = ["gcc", "-std=c11", *WARNINGS, *include, *map(str, sources), "-o", str(tmp_path / "program")]
    subprocess.run(command, check=True)
    subprocess.run([str(tmp_path / "program")], check=True)


@pytest.mark.parametrize(("name", "text"), SHOWN, ids=[name for name, _ in SHOWN])
def test_what_the_page_shows_is_what_is_there(name: str, text: str) -> None:
    if name == "canopy show":
        assert CliRunner().invoke(main, ["show", str(COURIER / "trees" / "courier.xml")]).output == text
    elif name not in ("stubs", "canopy monitor"):  # these have tests of their own
        assert text in (COURIER / name).read_text(encoding="utf-8")


def robot_module() -> ModuleType:
    spec = importlib.util.spec_from_file_location("courier_robot", COURIER / "robot.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def courier(build_dir: Path, bus_dir: Path) -> Iterator[str]:
    """The controller, running on a bus of that name."""
    bus_name = f"unixbus:{bus_dir}/bus0"
    program = subprocess.Popen([build_dir / "examples" / "courier" / "courier", bus_name])
    yield bus_name
    program.send_signal(signal.SIGINT)
    assert program.wait(10) == 0


class Observer(threading.Thread):
    """Takes down what each node returned, from the trace: (name, status) whenever it changes."""

    def __init__(self, bus_name: str, model: Path) -> None:
        super().__init__()
        self._bus_name = bus_name
        self.watch = Watch(load_model(model))
        self.history: list[tuple[str, Status]] = []
        self.stopped = threading.Event()
        self.ready = threading.Event()

    def run(self) -> None:
        before = (0,) * len(self.watch.model.nodes)
        with open_bus(self._bus_name) as bus:
            self.ready.set()
            while not self.stopped.is_set():
                message = bus.recv(0.05)
                if message is None or not is_plain_data(message):
                    continue
                for view in self.watch.feed(message.arbitration_id, bytes(message.data), 0.0):
                    codes = tuple(node.code if node.certain else UNKNOWN for node in view.nodes)
                    for node, old, new in zip(self.watch.model.nodes, before, codes, strict=True):
                        if new not in (old, UNKNOWN):
                            self.history.append((node.name, last_result(new)))
                    before = codes


def test_the_courier_helps_itself_twice_and_arrives(courier: str, build_dir: Path, tmp_path: Path) -> None:
    model = build_dir / "examples" / "courier" / "generated" / "courier" / "courier.model.json"
    observer = Observer(courier, model)
    command = [sys.executable, "-m", "canopy", "monitor", "--model", str(model), "--can", courier, "--period", "0"]
    robot = robot_module()
    world = robot.Robot()
    with (tmp_path / "monitor.txt").open("w+") as printed:
        monitor = subprocess.Popen(command, stdout=printed)
        observer.start()
        try:
            assert observer.ready.wait(10)
            end = time.monotonic() + 20
            while not (tmp_path / "monitor.txt").stat().st_size:
                assert time.monotonic() < end, "the monitor sees nothing"
                time.sleep(0.05)
            robot.play(courier, world)
        finally:
            observer.stopped.set()
            observer.join()
            monitor.send_signal(signal.SIGINT)
            assert monitor.wait(10) == 0
    lines = (tmp_path / "monitor.txt").read_text(encoding="utf-8").splitlines()

    assert world.has_arrived and not world.ghost and not world.sill
    story = iter(observer.history)
    for event in (
        ("ComputePath", Status.FAILURE),  # the obstacle that is not there
        ("Clear the obstacles", Status.SUCCESS),
        ("ComputePath", Status.SUCCESS),
        ("FollowPath", Status.RUNNING),
        ("FollowPath", Status.FAILURE),  # the sill
        ("OrderChanged", Status.FAILURE),
        ("Ways to get free", Status.SUCCESS),
        ("MoveBy", Status.SUCCESS),
        ("ComputePath", Status.SUCCESS),
        ("Deliver", Status.SUCCESS),
        ("FollowPath", Status.SUCCESS),
        ("WaitForOrder", Status.RUNNING),
    ):
        assert event in story, f"{event} is missing, or out of order, in {observer.history}"
    assert ("Let them pass", Status.RUNNING) not in observer.history
    assert ("Go there", Status.FAILURE) not in observer.history

    seen = iter([line.split(" ", 2)[2].partition("]")[0] + "]" for line in lines])  # without "tick N", and the signals
    for line in dict(SHOWN)["canopy monitor"].splitlines():
        assert line in seen, f"{line!r} is missing, or out of order"
