# SPDX-License-Identifier: MIT
"""Every call of the operating system that the socketcan driver makes fails once. As test_failing_calls.py, on vcan0."""

from __future__ import annotations

import errno
import os
import random
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from canopy.canbus import open_bus
from integration.can_probe import CanProbe
from integration.failing import Fault, exchange

SPEC = "socketcan:vcan0"
ERRORS = {
    "socket": (errno.EMFILE,),
    "bind": (errno.ENODEV, errno.ENOMEM),
    "setsockopt": (errno.ENOMEM,),
    "getsockopt": (errno.ENOMEM,),
    "ioctl": (errno.ENODEV, errno.EINTR),
    "if_nametoindex": (errno.ENODEV,),
    "send": (errno.ENOBUFS, errno.EAGAIN, errno.EINTR, errno.ENOMEM, errno.EIO, errno.ENETDOWN),
    "recv": (errno.EINTR, errno.ENOMEM),
    "recvmmsg": (errno.ENOMEM, errno.EINTR, errno.EIO, errno.ENETDOWN, errno.ENOBUFS),
    "recvmsg": (errno.ENOMEM, errno.EINTR),
    "ppoll": (errno.EINTR, errno.ENOMEM),
    "poll": (errno.EINTR, errno.ENOMEM),
}
CALLS_MAX = 8
SAMPLE = int(os.environ.get("CANOPY_FAULTS", "25"))


def faults() -> list[Fault]:
    every = [
        Fault(call, number, at) for call, numbers in ERRORS.items() for number in numbers for at in range(1, CALLS_MAX)
    ]
    if SAMPLE == 0 or len(every) <= SAMPLE:
        return every
    return random.Random(int(os.environ.get("CANOPY_SEED", "1"))).sample(every, SAMPLE)


@pytest.mark.parametrize("fault", faults(), ids=str)
def test_a_call_of_the_socketcan_driver_fails_once(
    build_dir: Path, helper: Callable[[str], Path], fault: Fault
) -> None:
    with open_bus(SPEC) as peer:
        try:
            probe = CanProbe(helper("can_probe"), SPEC, environment=fault.environment(build_dir, "no file"))
        except RuntimeError as error:  # it cannot begin: it says why
            assert "CAN bus" in str(error)
            assert "(" in str(error)
            return
        with probe:
            exchange(probe, peer, 0x10)
            for _ in range(20):  # as the runtime does, with its pauses
                if probe.ask("state") == "0":
                    break
                probe.ask("restart")
                time.sleep(0.05)
            probe.ask("drain")
            while peer.recv(0.02):
                pass
            assert exchange(probe, peer, 0x20) == (0, 0)
