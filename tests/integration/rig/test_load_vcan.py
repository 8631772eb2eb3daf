# SPDX-License-Identifier: MIT
"""Age of data and time to the safe value on a loaded vcan0."""

from collections.abc import Callable
from pathlib import Path

import pytest

from integration import load


@pytest.mark.parametrize("percent", load.LOADS)
def test_age_and_time_to_the_safe_value(helper: Callable[[str], Path], percent: int) -> None:
    measured = load.measure(helper, "socketcan:vcan0", percent)
    print(measured.row("vcan"))
    load.check(measured, load.ROUNDING_US)
