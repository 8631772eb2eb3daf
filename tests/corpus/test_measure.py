# SPDX-License-Identifier: MIT
"""The measurement of docs/xml.md, on a small corpus of our own, of which it is known what becomes of each file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from corpus.measure import STEPS, measure, tree_files

HERE = Path(__file__).parent
WHAT = {
    "warehouse/trees/blink.xml": (0, ""),
    "warehouse/trees/warn.xml": (1, ""),
    "warehouse/trees/fetch.xml": (2, ""),
    "warehouse/trees/drive.xml": (2, ""),
    "arm/pick.xml": (3, "not well-formed XML"),
    "arm/wrong.xml": (3, "wrong number of children"),
}


def test_what_becomes_of_each_file(tmp_path: Path) -> None:
    found = {}
    for repository in sorted((HERE / "small").iterdir()):
        for path in tree_files(repository):
            result = measure(repository, path, tmp_path)
            found[str(path.relative_to(HERE / "small"))] = result
    assert set(found) == set(WHAT), "a file of format 3 is not counted"
    for name, (step, reason) in WHAT.items():
        assert found[name].step == STEPS[step], (name, found[name].message)
        assert not reason or reason in found[name].classes, name


def test_the_command_makes_the_table() -> None:
    command = [sys.executable, str(HERE / "measure.py"), str(HERE / "small"), "--draw", "2"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "| all others | 6 | 1 (17 %) | 2 (33 %) | 4 (67 %) | 2 |" in result.stdout
    assert "| not well-formed XML | 1 |" in result.stdout
    assert "arm at `small`" in result.stdout
    assert "a raw '&'" in result.stdout and "<Inverter> needs exactly 1 child" in result.stdout
