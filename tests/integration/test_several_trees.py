# SPDX-License-Identifier: MIT
"""Two trees in one program, two nodes of one DBC: each sends at its own rate, each is watched through its own model."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

import can
import pytest
from click.testing import CliRunner

from canopy.canbus import is_plain_data, open_bus
from canopy.cli import main
from canopy.model import load_model
from canopy.trace import Status, TraceDecoder, TreeView

SEVERAL = Path(__file__).parents[1] / "unit" / "several"
DBC = SEVERAL / "rover.dbc"
WHEELS = bytes([100, 0, 0])
CYCLES_MS = {"Drive": 20, "Lamp": 40, "Goal": 40, "Echo": 120, "CanopyTick": 10, "CanopyTick_Navigator": 40}
IDS = {"Drive": 0x200, "Lamp": 0x201, "Goal": 0x210, "Echo": 0x211, "CanopyTick": 0x600, "CanopyTick_Navigator": 0x610}
RUN_S = 1.5


def model_file(build_dir: Path, name: str) -> Path:
    return build_dir / "tests" / "unit" / "generated" / name / f"{name}.model.json"


def watch(spec: str, decoders: list[TraceDecoder]) -> tuple[dict[int, list[bytes]], list[list[TreeView]]]:
    """The wheels report for RUN_S, every 10 ms; gives the frames by id, and the views of each decoder."""
    frames: dict[int, list[bytes]] = defaultdict(list)
    views: list[list[TreeView]] = [[] for _ in decoders]
    with open_bus(spec) as bus:
        wheels = can.Message(arbitration_id=0x100, is_extended_id=False, data=WHEELS)
        end = time.monotonic() + RUN_S
        due = time.monotonic()
        while time.monotonic() < end:
            if time.monotonic() >= due:
                bus.send(wheels)
                due += 0.01
            frame = bus.recv(max(0.0, due - time.monotonic()))
            if frame is None or not is_plain_data(frame):
                continue
            frames[frame.arbitration_id].append(bytes(frame.data))
            for decoder, seen in zip(decoders, views, strict=True):
                seen.extend(decoder.feed(frame.arbitration_id, bytes(frame.data)))
    return frames, views


def test_each_tree_sends_at_its_own_rate_and_is_watched_by_its_own_trace(
    build_dir: Path, bus_dir: Path, helper: Callable[[str], Path]
) -> None:
    models = [load_model(model_file(build_dir, name)) for name in ("driver", "navigator")]
    decoders = [TraceDecoder(model) for model in models]
    spec = f"unixbus:{bus_dir}/bus0"
    program = subprocess.Popen([helper("two_trees"), spec], stdout=subprocess.PIPE, text=True)
    try:
        frames, views = watch(spec, decoders)
    finally:
        program.send_signal(signal.SIGTERM)
        output, _ = program.communicate(timeout=10)
    assert program.returncode == 0
    _, driver_ticks, _, navigator_ticks = output.split()
    assert int(driver_ticks) > 2 * int(navigator_ticks)  # 4, on a machine that is never late
    # As many frames as ticks of the sender allow: a late machine drops whole ticks, and never changes the ratio.
    for name, ticks, period in (
        ("Drive", views[0], 10),
        ("Lamp", views[0], 10),
        ("Goal", views[1], 40),
        ("Echo", views[1], 40),
    ):
        expected = len(ticks) * period / CYCLES_MS[name]
        assert abs(len(frames[IDS[name]]) - expected) <= 2, name
    assert frames[IDS["Drive"]][-1] == b"\x2a"  # the navigator's goal
    assert frames[IDS["Echo"]][-1] == b"\x2a"  # the navigator sees the driver
    for seen, decoder in zip(views, decoders, strict=True):
        assert len(seen) > 5
        assert seen[-1].complete
        assert seen[-1].root_status == Status.SUCCESS
        assert (decoder.lost, decoder.refused) == (0, 0)


def test_the_model_names_the_trace_of_its_node(build_dir: Path) -> None:
    for name, base in (("driver", 0x600), ("navigator", 0x610)):
        data = json.loads(model_file(build_dir, name).read_text())
        assert (data["trace"]["base"], data["trace"]["extended"]) == (base, False)
        assert not any("Canopy" in message for message in data["bus"]["send"] + data["bus"]["receive"])


def compile_c(tmp_path: Path, file: str) -> None:
    include = ["-I", str(Path(__file__).parents[2] / "runtime" / "include"), "-I", str(tmp_path / "out")]
    command = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", *include, "-c", "-o", str(tmp_path / "object.o")]
    subprocess.run([*command, str(tmp_path / "out" / file)], check=True)


def compile_driver(
    tmp_path: Path, text: str, tree: Path = SEVERAL / "driver.xml", options: Sequence[str] = ()
) -> tuple[int, str]:
    (tmp_path / "rover.dbc").write_text(text)
    arguments = ["compile", str(tree), "--dbc", str(tmp_path / "rover.dbc"), "--node", "Driver"]
    result = CliRunner().invoke(main, [*arguments, "--period-ms", "10", "-o", str(tmp_path / "out"), *options])
    return result.exit_code, result.stderr


OLD_TICK = 'BO_ {} CanopyTick{}: 8 {}\n SG_ Tick : 8|32@1+ (1,0) [0|4294967295] "" {}\n\nBO_ 256 Wheels'


@pytest.mark.parametrize("name", ["", "_Mine"])
def test_trace_messages_that_the_dbc_still_has_are_named(tmp_path: Path, name: str) -> None:
    text = DBC.read_text().replace("BO_ 256 Wheels", OLD_TICK.format(1600, name, "Driver", "Base"))
    code, errors = compile_driver(tmp_path, text)
    assert code == 2
    line = text[: text.index("BO_ 1600")].count("\n") + 1
    assert f"rover.dbc:{line}:" in errors
    assert f"node 'Driver' sends 'CanopyTick{name}', and the trace's messages are made by the compiler" in errors
    assert "take the Canopy messages out of the DBC, and give --trace 0x600 (in CMake: TRACE 0x600)" in errors


def test_ids_that_the_dbc_has_are_not_the_traces(tmp_path: Path) -> None:
    text = DBC.read_text().replace("BO_ 256 Wheels", OLD_TICK.format(0x607, "_Navigator", "Navigator", "Base"))
    code, errors = compile_driver(tmp_path, text, options=["--trace", "0x600"])
    assert code == 2
    assert "the trace takes the ids 0x600 to 0x607, and 0x607 is 'CanopyTick_Navigator' of rover.dbc" in errors
    assert "take eight ids in a row that are free" in errors
    assert compile_driver(tmp_path, text, options=["--trace", "0x608"])[0] == 0
    assert compile_driver(tmp_path, text, options=["--trace", "0x800"])[0] == 0  # 29-bit ids
    code, errors = compile_driver(tmp_path, text, options=["--trace", "0x7F9"])
    assert code == 2
    assert "the trace takes the ids 0x7F9 to 0x800, which are no CAN ids" in errors


def test_a_trace_message_of_another_node_is_an_input_like_any_other(tmp_path: Path) -> None:
    text = DBC.read_text().replace("BO_ 256 Wheels", OLD_TICK.format(0x610, "_Navigator", "Navigator", "Driver"))
    code, errors = compile_driver(tmp_path, text, options=["--trace", "0x600"])
    assert code == 0, errors
    data = json.loads((tmp_path / "out" / "driver.model.json").read_text())
    assert "CanopyTick_Navigator" in data["bus"]["receive"]
    assert data["trace"]["base"] == 0x600


def test_names_of_the_bus_do_not_meet_those_of_the_application(tmp_path: Path) -> None:
    """A message Period with a signal Us would become the macro DRIVER_PERIOD_US, which is the application's."""
    message = 'BO_ 800 Period: 2 Base\n SG_ Us : 0|16@1+ (1,0) [0|65535] "us" Driver\n\nBO_ 256 Wheels'
    text = DBC.read_text().replace("BO_ 256 Wheels", message)
    code, errors = compile_driver(tmp_path, text)
    assert code == 0, errors
    compile_c(tmp_path, "driver_app.c")


def test_a_message_may_have_the_name_of_a_leafs_function(tmp_path: Path) -> None:
    """The leaf IsSafe is is_safe_tick() in C, and the message IsSafeTick the member is_safe_tick."""
    (tmp_path / "driver.xml").write_text((SEVERAL / "driver.xml").read_text().replace("Wheels", "IsSafeTick"))
    code, errors = compile_driver(
        tmp_path, DBC.read_text().replace(" Wheels:", " IsSafeTick:"), tmp_path / "driver.xml"
    )
    assert code == 0, errors
    leaves = (SEVERAL / "driver_leaves.c").read_text()
    (tmp_path / "out" / "leaves.c").write_text(leaves.replace("in->wheels.", "in->is_safe_tick."))
    for file in ("driver_app.c", "driver_bus.c", "leaves.c"):
        compile_c(tmp_path, file)


def test_a_second_tree_can_be_monitored(build_dir: Path, bus_dir: Path, helper: Callable[[str], Path]) -> None:
    spec = f"unixbus:{bus_dir}/bus0"
    program = subprocess.Popen([helper("two_trees"), spec], stdout=subprocess.DEVNULL)
    command = [sys.executable, "-m", "canopy", "monitor", "--model", str(model_file(build_dir, "navigator"))]
    try:
        done = subprocess.run(
            [*command, "--can", spec, "--duration", "1", "--period", "0.3"], capture_output=True, text=True, timeout=60
        )
    finally:
        program.send_signal(signal.SIGTERM)
        program.wait(timeout=10)
    assert (done.returncode, done.stderr) == (0, "")
    assert "FAILURE" in done.stdout  # the wheels are silent
