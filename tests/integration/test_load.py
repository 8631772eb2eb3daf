# SPDX-License-Identifier: MIT
"""Age of data and time to the safe value on a loaded unixbus."""

from collections.abc import Callable
from pathlib import Path

import pytest

from integration import load

SENDER_QUEUE_US = 20_000
"""Where a socket is full a thread of the sender's driver sends later, and the frame is stamped then."""
RECEIVE_THREAD_US = 20_000
"""A frame is stamped when it is sent, but a thread of the driver takes it, and may be late unseen by the loop."""


@pytest.mark.parametrize("percent", load.LOADS)
def test_age_and_time_to_the_safe_value(helper: Callable[[str], Path], bus_dir: Path, percent: int) -> None:
    measured = load.measure(helper, "unixbus:loaded", percent, SENDER_QUEUE_US)
    print(measured.row("unixbus"))
    load.check(measured, load.ROUNDING_US + RECEIVE_THREAD_US)
