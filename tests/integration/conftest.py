# SPDX-License-Identifier: MIT
"""What the integration tests share: where the programs are, and a CAN bus folder of one's own."""

import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]


def pytest_configure() -> None:
    """Programs under test are ended with SIGINT; under nohup or `make test &` they would inherit that it is ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Marks every test of the folder rig/ as one that needs vcan0.

    On another build than the usual one (CANOPY_BUILD_DIR) only those tests say anything new that run its programs.
    """
    here = Path(__file__).parent
    for item in items:
        if item.path.is_relative_to(here / "rig"):
            item.add_marker(pytest.mark.rig)
    if os.environ.get("CANOPY_BUILD_DIR"):
        left_out = [
            i for i in items if i.path.is_relative_to(here) and "build_dir" not in getattr(i, "fixturenames", ())
        ]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture(scope="session")
def build_dir() -> Path:
    """The CMake build folder under test: CANOPY_BUILD_DIR, else build/host."""
    folder = Path(os.environ.get("CANOPY_BUILD_DIR") or REPOSITORY / "build" / "host").resolve()
    if not (folder / "CMakeCache.txt").is_file():
        pytest.fail(f"{folder} is not a build folder: run `cmake --preset host && cmake --build --preset host` first")
    return folder


@pytest.fixture(scope="session")
def helper(build_dir: Path) -> Callable[[str], Path]:
    """Function from the name of a program that tests/integration/CMakeLists.txt builds to its path."""

    def find(name: str) -> Path:
        program = build_dir / "tests" / "integration" / name
        if not program.is_file():
            pytest.fail(f"{program} is missing: run `cmake --build {build_dir}`")
        return program

    return find


@pytest.fixture
def bus_dir(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty folder for unixbus buses; CANOPY_BUS_DIR names it for this test and its child processes.

    Not pytest's tmp_path: a Unix socket's path has to fit into 107 bytes.
    """
    folder = Path(tempfile.mkdtemp(prefix="canopy-", dir="/tmp"))
    monkeypatch.setenv("CANOPY_BUS_DIR", str(folder))
    yield folder
    shutil.rmtree(folder)
