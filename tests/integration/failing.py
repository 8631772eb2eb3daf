# SPDX-License-Identifier: MIT
"""Programs of which one call of the operating system fails (tests/integration/faults/failing_calls.c)."""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass
from pathlib import Path

import can

from integration.can_probe import CanProbe

LIBRARY = Path("tests") / "integration" / "libfailing_calls.so"


@dataclass(frozen=True)
class Fault:
    """The calls `at`, … of a function, counted from 1, fail with `number`."""

    call: str
    number: int
    at: int = 1
    times: int = 1

    def __str__(self) -> str:
        return f"{self.call}-{errno.errorcode[self.number]}-{self.at}" + (f"x{self.times}" if self.times > 1 else "")

    def environment(self, build_dir: Path, path: str, count: Path | None = None) -> dict[str, str]:
        """For the program in which it happens; of files only those with `path` in their path count."""
        assert (build_dir / LIBRARY).is_file(), "run cmake --build"
        return {
            **os.environ,
            "LD_PRELOAD": str(build_dir / LIBRARY),
            "ASAN_OPTIONS": "verify_asan_link_order=0",
            "FAIL_CALL": self.call,
            "FAIL_ERRNO": str(self.number),
            "FAIL_AT": str(self.at),
            "FAIL_FOR": str(self.times),
            "FAIL_PATH": path,
            **({"FAIL_COUNT": str(count)} if count else {}),
        }


def exchange(probe: CanProbe, peer: can.BusABC, first: int) -> tuple[int, int]:
    """Three frames each way; returns how many did not arrive: at the peer, at the probe. What failed was said."""
    missing_at_peer = missing_at_probe = 0
    for number in range(first, first + 3):
        if probe.send(f"{number:03X}#") == 1:
            message = peer.recv(1.0)
            missing_at_peer += message is None or message.arbitration_id != number
        peer.send(can.Message(arbitration_id=0x400 + number, is_extended_id=False))
        answer = probe.receive(1000)
        if answer.startswith("-") or answer == "none":  # an error, or a signal's EINTR: the frame comes after it
            answer = probe.receive(1000)
        missing_at_probe += answer != f"{0x400 + number:03X}#"
    return missing_at_peer, missing_at_probe
