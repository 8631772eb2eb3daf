# SPDX-License-Identifier: MIT
"""What the compiler writes is C that was reviewed: tests/golden/ holds it, byte for byte.

A change of the output is meant to be seen in a diff. `make golden` writes the files anew; read them, and commit them
with the change that they come from. `make lint` holds them to the house's layout, like all C here.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from integration.compilers import COMPILERS
from integration.language import ROOT, WARNINGS
from integration.test_readme import blocks

GOLDEN = ROOT / "tests" / "golden"
COURIER = ROOT / "examples" / "courier"
TYPE_MAP = [
    *("--type-map", "geometry_msgs::msg::PoseStamped_<std::allocator<void>>=pose_t"),
    *("--type-map", "nav_msgs::msg::Path_<std::allocator<void>>=path_t"),
]

# Name -> the command's arguments after the input, folders with headers of the user's.
OUTPUTS: dict[str, tuple[list[str], list[Path]]] = {
    "room": (["--node", "Controller", "--period-ms", "100"], []),
    "cooler": (["--node", "Controller", "--period-ms", "100", "--include", "cooler_state.h"], [GOLDEN]),
    "courier": (
        ["--node", "Controller", "--period-ms", "50", "--include", "courier_types.h", "--trace", "0x600", *TYPE_MAP],
        [COURIER],
    ),
    "gripper": ([], []),
}

# clang: every warning that it has, but for those that object to the language or to the platform's own layout.
EVERYTHING = [
    *("-Weverything", "-Werror", "-Wno-padded", "-Wno-declaration-after-statement", "-Wno-unsafe-buffer-usage"),
    *("-Wno-unknown-warning-option", "-Wno-pre-c11-compat", "-Wno-documentation"),
]


def command(name: str, folder: Path) -> list[str]:
    """The command line that makes the output `name`. The README's application is written to `folder` first."""
    more, _ = OUTPUTS[name]
    if name == "gripper":
        return ["codec", str(ROOT / "tests" / "unit" / "codec" / "gripper.dbc")]
    trees = {"cooler": GOLDEN / "cooler.xml", "courier": COURIER / "trees" / "courier.xml", "room": folder / "room.xml"}
    buses = {"cooler": GOLDEN / "cooler.dbc", "courier": COURIER / "courier.dbc", "room": folder / "room.dbc"}
    if name == "room":
        for file in (trees[name], buses[name]):
            file.write_text(blocks()[file.name], encoding="utf-8")
    return ["compile", str(trees[name]), "--dbc", str(buses[name]), *more]


def generate(name: str, folder: Path) -> dict[str, bytes]:
    """File name -> content of what the compiler makes; the copy of the DBC is left out."""
    result = CliRunner().invoke(main, [*command(name, folder), "-o", str(folder / "out")])
    assert result.exit_code == 0, result.output
    return {file.name: file.read_bytes() for file in sorted((folder / "out").iterdir()) if file.suffix != ".dbc"}


@pytest.mark.parametrize("name", OUTPUTS)
def test_the_output_is_the_one_that_was_reviewed(name: str, tmp_path: Path) -> None:
    made = generate(name, tmp_path)
    kept = GOLDEN / name
    if os.environ.get("CANOPY_UPDATE_GOLDEN") == "1":
        shutil.rmtree(kept, ignore_errors=True)
        kept.mkdir(parents=True)
        for file, content in made.items():
            (kept / file).write_bytes(content)
    golden = {file.name: file.read_bytes() for file in sorted(kept.iterdir())}
    assert sorted(made) == sorted(golden)
    for file, content in made.items():
        assert content.decode() == golden[file].decode(), f"{file} has changed; if that is right: make golden"


@pytest.mark.parametrize("name", OUTPUTS)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_output_has_no_warning(name: str, compiler: str) -> None:
    include = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{GOLDEN / name}", *(f"-I{x}" for x in OUTPUTS[name][1])]
    for file in sorted((GOLDEN / name).glob("*.c")):
        for warnings in [WARNINGS, EVERYTHING] if compiler == "clang" else [WARNINGS]:
            subprocess.run(
                [compiler, "-std=c11", "-O2", *warnings, *include, "-c", str(file), "-o", "/dev/null"], check=True
            )
