# SPDX-License-Identifier: MIT
"""The Big BT's mission on vcan0."""

from __future__ import annotations

from pathlib import Path

import pytest

from integration import big_processes


@pytest.mark.timeout(600)  # one shared CPU in the guest
def test_the_mission_is_played(build_dir: Path) -> None:
    big_processes.the_mission_is_played(build_dir, "socketcan:vcan0", corrected=True, factor=10)
