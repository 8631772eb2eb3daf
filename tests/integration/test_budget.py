# SPDX-License-Identifier: MIT
"""The printed budget against a real compiler for a 32-bit target."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from integration.codec_harness import BARE_LIBC

ROOT = Path(__file__).parents[2]
APPLICATIONS = {
    "nao_home": ("examples/nao/trees/get_home.xml", "examples/nao/nao.dbc", 50),
    "nao_power": ("examples/nao/trees/power_supply.xml", "examples/nao/nao.dbc", 50),
    "features": ("tests/unit/features/tree.xml", "tests/unit/features/features.dbc", 10),
    "exchange": ("tests/unit/exchange/main.xml", "tests/unit/exchange/exchange.dbc", 10),
}
OPTIONS = {
    "features": ["--include", str(ROOT / "tests/unit/features/state.h")],
    "exchange": ["--include", str(ROOT / "tests/unit/exchange/state.h"), "--image-nodes", "33", "--image-uses", "5"],
}
# The compiler does not know the user's types: 6 bytes of state in each of two uses of CoolDown; 2 and 1 in each of five
# that an image may have of Drive and Gate, and 8 in the entry {pose}. Padding may add 7.
USER_STATE = {"features": 2 * 6, "exchange": 5 * (2 + 1) + 8}


@pytest.mark.parametrize("name", APPLICATIONS)
def test_the_static_object_is_as_large_as_the_budget_says(tmp_path: Path, name: str) -> None:
    tree, dbc, period = APPLICATIONS[name]
    arguments = [str(ROOT / tree), "--name", name, "--dbc", str(ROOT / dbc), "--node", "Controller"]
    result = CliRunner().invoke(
        main, ["compile", *arguments, "--period-ms", str(period), "-o", str(tmp_path), *OPTIONS.get(name, [])]
    )
    assert result.exit_code == 0, result.output
    budget = re.search(r"RAM +(\d+) bytes", result.output)
    assert budget is not None
    objects = tmp_path / "app.o"
    target = ["arm-none-eabi-gcc", "-mcpu=cortex-m0plus", "-mthumb", "-std=c11", "-Os", "-ffreestanding"]
    includes = [f"-I{ROOT / 'runtime/include'}", f"-I{BARE_LIBC}", f"-I{tmp_path}"]
    subprocess.run([*target, *includes, "-c", str(tmp_path / f"{name}_app.c"), "-o", str(objects)], check=True)
    symbols = subprocess.run(
        ["arm-none-eabi-nm", "--print-size", "--radix=d", str(objects)], check=True, stdout=subprocess.PIPE, text=True
    ).stdout
    memory = re.search(r"^\d+ (\d+) b memory$", symbols, re.MULTILINE)
    assert memory is not None, symbols
    assert int(memory[1]) - USER_STATE.get(name, 0) == pytest.approx(int(budget[1]), abs=7)


def test_room_for_the_trace_is_stated_in_ticks(tmp_path: Path) -> None:
    tree, dbc, period = APPLICATIONS["nao_home"]
    arguments = ["compile", str(ROOT / tree), "--name", "nao_home", "--dbc", str(ROOT / dbc), "--node", "Controller"]
    arguments += ["--period-ms", str(period), "-o", str(tmp_path)]
    printed = CliRunner().invoke(main, [*arguments, "--trace", "0x600"]).output
    assert re.search(r"^  trace .* bytes of RAM, room for 4 ticks without a bus$", printed, re.MULTILINE)
    sizes = {}
    for ticks in (1, 2, 4, 20, 21):
        options = [*arguments, "--json", "--trace", "0x600", "--trace-ticks", str(ticks)]
        budget = json.loads(CliRunner().invoke(main, options).output)
        assert f".trace_ticks = {ticks}u," in (tmp_path / "nao_home_app.c").read_text(encoding="utf-8")
        model = json.loads((tmp_path / "nao_home.model.json").read_text(encoding="utf-8"))
        assert model["trace"]["ticks"] == ticks
        sizes[ticks] = budget["trace_ram_bytes"]
    rings = {ticks: size - sizes[1] for ticks, size in sizes.items()}
    # 12 frames in a full tick and four in each other one, each of 24 bytes; a power of two of them.
    assert rings == {1: 0, 2: 0, 4: 16 * 24, 20: 112 * 24, 21: 112 * 24}
    refused = CliRunner().invoke(main, [*arguments, "--trace", "0x600", "--trace-ticks", "0"])
    assert refused.exit_code == 2
    assert "--trace-ticks" in refused.output


def test_each_kind_of_node_has_a_price(tmp_path: Path) -> None:
    tree, dbc, period = APPLICATIONS["features"]
    arguments = ["compile", str(ROOT / tree), "--name", "features", "--dbc", str(ROOT / dbc), "--node", "Controller"]
    arguments += ["--period-ms", str(period), "-o", str(tmp_path), "--include", "state.h", "--trace", "0x600"]
    budget = json.loads(CliRunner().invoke(main, [*arguments, "--json"]).output)
    assert sum(cost["nodes"] for cost in budget["kinds"]) == budget["nodes"]
    timeout = next(cost for cost in budget["kinds"] if cost["kind"] == "Timeout")
    assert (timeout["ram_each"], timeout["flash_each"]) == (2 + 4 * 2, 12)  # a deadline of 64 bits
    totals = [cost["nodes"] * cost["flash_each"] for cost in budget["kinds"]]
    assert totals == sorted(totals, reverse=True)
    assert sum(totals) < budget["flash_bytes"]
    printed = CliRunner().invoke(main, [*arguments, "--costs"]).output
    assert re.search(r"^  Timeout +\d+ +10 +12$", printed, re.MULTILINE)
