# SPDX-License-Identifier: MIT
"""The bounds in time that the compiler prints: never below what an adversary on the bus achieves, and not far above."""

from __future__ import annotations

import json
import random
import re
import subprocess
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.bounds import Bounds, Others, make_bounds, refusal
from canopy.compiler.bus_model import Bus
from canopy.compiler.bus_reader import read_bus
from canopy.compiler.bus_timing import frame_bits

ROOT = Path(__file__).parents[2]
TREE = ROOT / "examples/nao/trees/get_home.xml"
DBC = ROOT / "examples/nao/nao.dbc"
LONGEST = frame_bits(8, extended=True, fd=False)


def rover(tmp_path: Path, commands: int, cycle_ms: int) -> Bus:
    """A bus with so many commands of 8 bytes."""
    lines = ["BU_: Controller Drive"]
    for number in range(commands):
        lines += [
            "",
            f"BO_ {0x200 + number} Command{number}: 8 Controller",
            ' SG_ Speed : 0|8@1+ (1,0) [0|255] "" Drive',
        ]
    lines += [
        "",
        'BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;',
        'BA_DEF_ SG_ "GenSigInactiveValue" INT 0 255;',
        f'BA_DEF_DEF_ "GenMsgCycleTime" {cycle_ms};',
        'BA_DEF_DEF_ "GenSigInactiveValue" 0;',
        "",
    ]
    path = tmp_path / "rover.dbc"
    path.write_text("\n".join(lines))
    return read_bus(path, "Controller", cycle_ms, "rover")


def adversary(bus: Bus, bitrate: int, others: Others, greedy: random.Random | None) -> list[Fraction]:
    """The wait of each output when others do the worst they may: greedily, or at random moments."""
    bit = Fraction(1_000_000, bitrate)
    now = LONGEST * bit  # one frame has just begun at 0 ...
    queue = [LONGEST * bit] + [frame_bits(m.length, extended=m.extended, fd=m.fd) * bit for m in bus.send]
    spent = Fraction(0)
    waits = []
    for own in queue:  # ... the first of ours is a less urgent one that holds the mailbox
        now += others.latency_us
        while True:
            allowed = others.burst * LONGEST * bit + Fraction(others.load_percent, 100) * now
            if spent + LONGEST * bit > allowed or (greedy is not None and greedy.random() < 0.2):
                break
            spent += LONGEST * bit
            now += LONGEST * bit
        now += own
        waits.append(now)
    return waits[1:]


def bounds_of(bus: Bus, bitrate: int, others: Others) -> Bounds:
    return make_bounds(bus, bitrate, others, trace_frames=8)


@pytest.mark.parametrize("load", [0, 30, 60, 90])
@pytest.mark.parametrize(("commands", "cycle_ms"), [(1, 50), (2, 50), (6, 100)])
def test_no_adversary_is_slower_and_a_greedy_one_comes_close(
    tmp_path: Path, commands: int, cycle_ms: int, load: int
) -> None:
    bus = rover(tmp_path, commands, cycle_ms)
    others = Others(load, 10, 50)
    found = bounds_of(bus, 500_000, others)
    runs = [adversary(bus, 500_000, others, None)]
    runs += [adversary(bus, 500_000, others, random.Random(seed)) for seed in range(50)]
    for run in runs:
        for wait, output in zip(run, found.outputs, strict=True):
            assert output.wait_us is None or wait <= output.wait_us
    for wait, output in zip(runs[0], found.outputs, strict=True):
        assert output.wait_us is None or wait >= Fraction(7, 10) * output.wait_us


def test_a_bound_by_hand(tmp_path: Path) -> None:
    found = bounds_of(rover(tmp_path, 1, 50), 500_000, Others(0, 0, 0))
    # Two frames of 160 bits before it, and its own 135: 2 us each.
    assert (LONGEST, found.outputs[0].wait_us) == (160, 2 * (2 * 160 + 135))
    assert found.outputs[0].reaction_us == 50_000 + 2 * (2 * 160 + 135)
    assert (found.outputs[0].safe_us, found.load_limit_percent) == (None, 98)


def test_the_limit_is_the_last_load_that_is_kept(tmp_path: Path) -> None:
    bus = rover(tmp_path, 6, 20)
    limit = bounds_of(bus, 500_000, Others()).load_limit_percent
    assert limit is not None
    assert 0 < limit < 99
    assert refusal(bus, bounds_of(bus, 500_000, Others(load_percent=limit))) is None
    assert refusal(bus, bounds_of(bus, 500_000, Others(load_percent=limit + 1))) is not None


def test_a_less_urgent_output_waits_longer(tmp_path: Path) -> None:
    waits = [output.wait_us for output in bounds_of(rover(tmp_path, 6, 100), 500_000, Others()).outputs]
    assert None not in waits
    assert waits == sorted(waits, key=lambda wait: wait or 0)
    assert len(set(waits)) == len(waits)


def compile_nao(tmp_path: Path, *options: str) -> Result:
    command = ["compile", str(TREE), "--dbc", str(DBC), "--node", "Controller", "--period-ms", "50"]
    return CliRunner().invoke(main, [*command, "-o", str(tmp_path / "out"), *options])


def test_what_fails_at_the_stated_load_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    result = compile_nao(tmp_path, "--foreign-load", "98")
    assert result.exit_code == 2
    assert "message 'PowerCommand' may wait" in result.stderr
    assert "it can be kept up to 91 %" in result.stderr
    assert not (tmp_path / "out").exists()


def test_an_input_that_gets_stale_by_itself_is_refused(tmp_path: Path) -> None:
    text = DBC.read_text().replace('BA_ "GenMsgTimeoutTime" BO_ 256 500;', 'BA_ "GenMsgTimeoutTime" BO_ 256 55;')
    (tmp_path / "nao.dbc").write_text(text)
    command = ["compile", str(TREE), "--dbc", str(tmp_path / "nao.dbc"), "--node", "Controller", "--period-ms", "50"]
    result = CliRunner().invoke(main, [*command, "-o", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "message 'Battery' may get stale" in result.stderr


def test_the_docs_show_what_is_printed(tmp_path: Path) -> None:
    shown = re.search(r"^  sends .*?(?=^```)", (ROOT / "docs/safety.md").read_text(), re.MULTILINE | re.DOTALL)
    assert shown is not None
    assert shown[0] in compile_nao(tmp_path, "--trace", "0x600").stdout


def test_the_model_file_has_them(tmp_path: Path) -> None:
    assert compile_nao(tmp_path, "--foreign-burst", "3", "--tx-latency-us", "20").exit_code == 0
    bounds = json.loads((tmp_path / "out/get_home.model.json").read_text())["budget"]["bounds"]
    assert bounds["others"] == {"load_percent": 60, "burst": 3, "latency_us": 20}
    assert [output["name"] for output in bounds["outputs"]] == ["PowerCommand", "PostureCommand"]


def test_names_of_the_images_own_members_are_kept(tmp_path: Path) -> None:
    dbc = (
        "BU_: Controller B\nBO_ 1 CanState: 2 B\n"
        ' SG_ AgeMs : 0|8@1+ (1,0) [0|255] "" Controller\n SG_ Fresh : 8|8@1+ (1,0) [0|255] "" Controller\n'
        '\nBO_ 2 Overload: 1 B\n SG_ Now : 0|8@1+ (1,0) [0|255] "" Controller\n'
    )
    (tmp_path / "b.dbc").write_text(dbc)
    (tmp_path / "t.xml").write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="T"><AlwaysSuccess/></BehaviorTree></root>\n'
    )
    arguments = ["compile", str(tmp_path / "t.xml"), "--dbc", str(tmp_path / "b.dbc"), "--node", "Controller"]
    result = CliRunner().invoke(main, [*arguments, "--period-ms", "50", "-o", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    sources = [str(file) for file in (tmp_path / "out").glob("*.c")]
    includes = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{tmp_path / 'out'}"]
    subprocess.run(["gcc", "-Wall", "-Wextra", "-Werror", *includes, "-fsyntax-only", *sources], check=True)
