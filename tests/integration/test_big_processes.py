# SPDX-License-Identifier: MIT
"""The Big BT's mission on a unixbus: controller, robot, and a desk that tells it things, each a process."""

from __future__ import annotations

from pathlib import Path

import pytest

from integration import big_processes


@pytest.mark.timeout(300)
@pytest.mark.parametrize("corrected", [True, False])
def test_the_mission_is_played(build_dir: Path, bus_dir: Path, corrected: bool) -> None:
    big_processes.the_mission_is_played(build_dir, f"unixbus:{bus_dir}/bus0", corrected=corrected, factor=10)
