# SPDX-License-Identifier: MIT
"""What the differential tests share: the runner, the seed, how many trees, and the figures printed at the end."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from differential.settings import SEED

REPOSITORY = Path(__file__).resolve().parents[2]
_figures: list[str] = []


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Prints what was compared, with the seed, also when everything passed."""
    if _figures:
        terminalreporter.section(f"differential, CANOPY_SEED={SEED}")
        for line in _figures:
            terminalreporter.write_line(line)


@pytest.fixture
def figure() -> Callable[[str], None]:
    """Function that keeps a line for the end of the run."""
    return _figures.append


@pytest.fixture(scope="session")
def runner() -> Path:
    """The program engine_runner of the build under test: of CANOPY_BUILD_DIR, else of build/host."""
    folder = Path(os.environ.get("CANOPY_BUILD_DIR") or REPOSITORY / "build" / "host").resolve()
    program = folder / "tests" / "differential" / "engine_runner"
    if not program.is_file():
        pytest.fail(f"{program} is missing: run `cmake --preset host && cmake --build --preset host` first")
    return program
