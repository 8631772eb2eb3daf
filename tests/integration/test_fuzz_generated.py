# SPDX-License-Identifier: MIT
"""The fuzzer of generated C finds nothing as things are, and the faults that were when their mending is taken out."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from integration.codec_harness import ROOT

SEED = 6


def fuzz(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fuzz.generated", "--seed", str(SEED), "--compilers", "gcc", "--keep", str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tests")}
    return subprocess.run([*command, *arguments], env=environment, capture_output=True, text=True, check=False)


@pytest.mark.timeout(300)
@pytest.mark.parametrize(
    ("mending", "fault"),
    [
        ("comments", "CANOPY-FUZZ-INJECTED: a text of a file has become code"),
        ("every", "runtime error: division by zero"),
    ],
)
def test_a_fault_is_found_when_its_mending_is_taken_out(tmp_path: Path, mending: str, fault: str) -> None:
    result = fuzz(tmp_path, "--cases", "150", "--unmend", mending, "--without-warnings", "--until", fault)
    assert result.returncode == 1, result.stderr
    assert fault in result.stdout
    report = next(line for line in result.stdout.splitlines() if line.startswith("again: "))
    number = report.split()[-1]
    again = fuzz(tmp_path, "--case", number, "--unmend", mending, "--without-warnings")
    assert again.returncode == 1
    assert f"FAULT in case {number} of seed {SEED}" in again.stdout


@pytest.mark.timeout(300)
def test_nothing_is_found_in_what_is_mended(tmp_path: Path) -> None:
    result = fuzz(tmp_path, "--cases", "50")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 faults" in result.stdout
