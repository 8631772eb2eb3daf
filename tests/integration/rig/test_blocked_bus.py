# SPDX-License-Identifier: MIT
"""A bus that lets nothing through for a while: what leaves afterwards, and how old it is. In tests/rig/with-vcan."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from integration.rig.vcan import IS_GUEST, Queue, Wire, age_ms, load_vcan, vxcan_pair

PERIOD_MS = 50
SLACK_MS = 40
"""The guest has one processor."""

needs_own_kernel = pytest.mark.skipif(not IS_GUEST, reason="loads a module anew, which is others' on this kernel")


@pytest.fixture
def echo() -> Iterator[None]:
    """vcan0 tells when a frame is out."""
    load_vcan(echo=True)
    yield
    load_vcan(echo=False)


@pytest.fixture
def pair() -> Iterator[None]:
    with vxcan_pair():
        yield


class Sender:
    """A running stamped_sender."""

    def __init__(self, program: Path, interface: str) -> None:
        self._process = subprocess.Popen(
            [program, f"socketcan:{interface}", str(PERIOD_MS)], stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        self.advice = []
        while (line := self._process.stdout.readline().strip()) != "ready":
            assert line, "stamped_sender ended"
            self.advice.append(line.removeprefix("advice "))

    def stop(self) -> tuple[list[str], dict[str, int]]:
        """Changes of state, and the counters."""
        self._process.terminate()
        output, _ = self._process.communicate(timeout=10)
        assert self._process.returncode == 0
        *states, counters = output.splitlines()
        return states, {name: int(value) for name, value in (pair.split("=") for pair in counters.split())}

    def __enter__(self) -> Sender:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()


@dataclass
class Blocked:
    """What a run on a bus came to that was blocked for a while."""

    ages: list[float]
    """Of the frames that were seen after the bus was released [ms]."""
    advice: list[str]
    states: list[str]
    counters: dict[str, int]

    def late(self, limit_ms: float) -> list[float]:
        return [age for age in self.ages if age > limit_ms + SLACK_MS]


def run_blocked(program: Path, interface: str, wire_at: str, length: int, seconds: float) -> Blocked:
    """Sends for a second, is blocked for `seconds`, and sends on for a second."""
    with Queue(interface, length) as queue, Sender(program, interface) as sender, Wire(wire_at) as wire:
        time.sleep(1)
        assert len(wire.frames) >= 20
        assert all(age_ms(frame) <= PERIOD_MS + SLACK_MS for frame in wire.frames)
        queue.block()
        blocked = time.monotonic()
        time.sleep(seconds)
        assert not [frame for frame in wire.frames if frame[0] > blocked + 0.02], "the bus was not blocked"
        released = time.monotonic()
        queue.release()
        time.sleep(1)
        states, counters = sender.stop()
        return Blocked([age_ms(f) for f in wire.frames if f[0] >= released], sender.advice, states, counters)


@needs_own_kernel
@pytest.mark.parametrize("length", [10, 1000])
@pytest.mark.parametrize("seconds", [1, 8])
def test_with_an_echo_only_the_frame_that_was_handed_over_leaves_late(
    echo: None, helper: Callable[[str], Path], length: int, seconds: int
) -> None:
    blocked = run_blocked(helper("stamped_sender"), "vcan0", "vcan0", length, seconds)
    assert len(blocked.late(PERIOD_MS)) <= 1, blocked.ages
    assert len(blocked.ages) >= 30  # and it goes on
    assert blocked.advice == []
    assert blocked.states == ["state 3", "state 0"]  # blocked, and back
    # Of each message one frame a period: all that did not leave are counted.
    assert blocked.counters["expired"] + blocked.counters["replaced"] >= 2 * (seconds * 1000 // PERIOD_MS - 3)
    assert blocked.counters["driver_dropped"] == 0


@pytest.mark.parametrize("length", [10, 1000])
def test_without_an_echo_one_frame_waits_in_the_queue(pair: None, helper: Callable[[str], Path], length: int) -> None:
    blocked = run_blocked(helper("stamped_sender"), "vxcan0", "vxcan1", length, 2)
    assert len(blocked.late(PERIOD_MS)) <= 1, blocked.ages
    assert len(blocked.ages) >= 30
    assert blocked.states == ["state 3", "state 0"]
    assert "one frame in the kernel's queue and those in the adapter" in blocked.advice[0]
    assert blocked.counters["expired"] + blocked.counters["replaced"] >= 2 * (2000 // PERIOD_MS - 3)


def test_what_has_no_queue_is_out_at_once(helper: Callable[[str], Path]) -> None:
    with Sender(helper("stamped_sender"), "vcan0") as sender, Wire() as wire:
        time.sleep(1)
        _, counters = sender.stop()
    assert sender.advice == []
    assert len(wire.frames) >= 30
    assert counters["sent"] == counters["driver_sent"] >= len(wire.frames)
    assert counters["expired"] == counters["replaced"] == 0
