# SPDX-License-Identifier: MIT
"""The README's five-minute example, as it stands there: it builds, runs, and does what the text says."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import can
import pytest

from canopy.canbus import open_bus

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks() -> dict[str, str]:
    """The files of the example, by name: the block that follows the first mention of the name in bold's paragraph."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    files = {}
    for name in ("room.dbc", "room.xml", "leaves.c", "main.c", "CMakeLists.txt"):
        match = FENCE.search(text, text.index(f"`{name}`"))
        assert match is not None, name
        files[name] = match[2]
    return files


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The built program, and what the build printed."""
    folder = tmp_path_factory.mktemp("room")
    for name, content in blocks().items():
        (folder / name).write_text(content, encoding="utf-8")
    (folder / "canopy").symlink_to(ROOT)
    environment = {**os.environ, "CFLAGS": "-Wall -Wextra -Werror"}
    options = [f"-DCANOPY_PYTHON={sys.executable}", "-DCANOPY_WERROR=ON"]
    subprocess.run(["cmake", "-S", folder, "-B", folder / "build", *options], check=True, env=environment)
    built = subprocess.run(
        ["cmake", "--build", folder / "build", "--parallel", "2"], check=True, stdout=subprocess.PIPE, text=True
    )
    return folder / "build" / "room", built.stdout


def test_the_budget_is_the_one_the_readme_shows(room: tuple[Path, str]) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"^room: 3 nodes.*?(?=^```)", text, re.MULTILINE | re.DOTALL)
    assert shown is not None
    assert shown[0] in room[1]


def test_the_fan_runs_while_it_is_warm_and_stops_on_silence(room: tuple[Path, str], bus_dir: Path) -> None:
    bus_name = f"unixbus:{bus_dir}/bus0"
    program = subprocess.Popen([room[0], bus_name])
    try:
        with open_bus(bus_name) as bus:

            def speed_after(temperature: float | None) -> int:
                """Sends this temperature (or nothing) for a while; gives the speed commanded then."""
                speed, end = -1, time.monotonic() + 0.9
                while time.monotonic() < end:
                    if temperature is not None:
                        raw = round(temperature * 10).to_bytes(2, "little", signed=True)
                        bus.send(can.Message(arbitration_id=0x100, is_extended_id=False, data=raw))
                    frame = bus.recv(0.05)
                    if frame is not None and frame.arbitration_id == 0x200:
                        speed = frame.data[0]
                return speed

            assert speed_after(25.0) == 0
            assert speed_after(25.1) == 80
            assert speed_after(-3.0) == 0
            assert speed_after(30.0) == 80
            assert speed_after(None) == 0
    finally:
        program.send_signal(signal.SIGINT)
        assert program.wait(10) == 0
