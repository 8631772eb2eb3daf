# SPDX-License-Identifier: MIT
"""Other traffic on a real bus: how old the data is that a leaf sees, and how long the safe value takes after a cut.

Measured with nao_power (load_probe.c) and its robot (load_peer.c), whose frames the kernel stamps when they are on the
bus, and compared with the compiler's bounds. These buses have no bit rate, so what is seen is the software's part.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from canopy.compiler.bounds import Others
from canopy.compiler.emit import load_application
from canopy.compiler.trace import TraceOptions

NAO = Path(__file__).resolve().parents[2] / "examples" / "nao"
PERIOD_MS, BITRATE, BURST, LATENCY_US = 50, 500_000, 10, 50
TIMEOUT_US = 500_000
LOADS = (0, 30, 60, 90)
CUTS = 3
ROUNDING_US = 2000
"""Ages are whole milliseconds, rounded up, once when a frame is taken and once in the tick."""


@dataclass(frozen=True)
class Bounds:
    """What the compiler promises at a load [us]."""

    age: int
    safe: int


@dataclass(frozen=True)
class Measured:
    """Times [us]."""

    load: int  # of the others [%]
    bounds: Bounds
    age_mean: int
    age_max: int
    safe_max: int
    """From the last message to the safe value on the bus."""
    loop_late: int
    """Most late start of a cycle, and the longest cycle, as the loop counted."""
    peer_late: int
    """Of the robot's messages."""

    def row(self, bus: str) -> str:
        """For docs/safety.md."""
        values = (self.age_mean, self.age_max, self.bounds.age, self.safe_max, self.bounds.safe, self.loop_late)
        cells = " | ".join(f"{value / 1000:.1f}" for value in values)
        return f"| {bus} | {self.load} % | {cells} |"


def bounds_at(load: int) -> Bounds:
    """The compiler's bounds for nao_power's Battery and PowerCommand."""
    tree, dbc = NAO / "trees" / "power_supply.xml", NAO / "nao.dbc"
    others, trace = Others(load, BURST if load else 0, LATENCY_US), TraceOptions(0x600)
    application = load_application("nao_power", tree, dbc, "Controller", PERIOD_MS, BITRATE, others=others, trace=trace)
    bounds = application.budget.bounds
    age = next(bound.age_us for bound in bounds.inputs if bound.name == "Battery")
    safe = next(bound.safe_us for bound in bounds.outputs if bound.name == "PowerCommand")
    assert age is not None
    assert safe is not None
    return Bounds(age, safe)


@dataclass(frozen=True)
class _Sent:
    level: int
    after: int


@dataclass
class _Seen:
    """What both programs have told."""

    sent: list[_Sent]
    commands: list[tuple[int, int]]  # time, mode
    ticks: list[tuple[int, int, int, bool]]  # now, level, age_ms, fresh
    loop_late: int
    peer_late: int


def _parse(probe: str, peer: str) -> _Seen:
    seen = _Seen([], [], [], 0, 0)
    for word, *values in (line.split() for line in (*probe.splitlines(), *peer.splitlines())):
        numbers = [int(value) for value in values]
        if word == "tick":
            seen.ticks.append((numbers[0], numbers[1], numbers[2], numbers[3] == 1))
        elif word == "loop":
            seen.loop_late = sum(numbers)
        elif word == "sent":
            seen.sent.append(_Sent(numbers[0], numbers[2]))
        elif word == "got":
            seen.commands.append((numbers[1], numbers[0]))
        elif word == "peer":
            seen.peer_late = numbers[0]
    return seen


def _run(helper: Callable[[str], Path], bus: str, load: int) -> _Seen:
    with subprocess.Popen([helper("load_probe"), bus], stdout=subprocess.PIPE, text=True) as probe:
        try:
            assert probe.stdout is not None
            assert probe.stdout.readline() == "ready\n"
            time.sleep(0.2)
            peer = subprocess.run(
                [helper("load_peer"), bus, str(load), str(CUTS)], stdout=subprocess.PIPE, text=True, check=True
            ).stdout
            probe.terminate()
            told = probe.stdout.read()
        finally:
            probe.kill()
    assert probe.returncode == 0
    return _parse(told, peer)


def _ages(seen: _Seen, queue_us: int) -> list[int]:
    """How old the Battery message is at each tick while the robot keeps to its cycle. No tick is told a wrong age."""
    sent = {message.level: message for message in seen.sent}
    ends = [message.after for message in seen.sent]
    ages = []
    for now, level, told_ms, fresh in seen.ticks:
        if not fresh:
            continue
        age = now - sent[level].after
        assert age < TIMEOUT_US, f"{age} us old data was called fresh"
        assert age <= told_ms * 1000 + queue_us, f"{age} us old data was called {told_ms} ms old"
        if any(0 <= now - end <= PERIOD_MS * 1000 for end in ends):
            ages.append(age)
    return ages


def _times_to_safe(seen: _Seen) -> list[int]:
    """From the last message before each silence to the first safe value after it."""
    following = [*(message.after for message in seen.sent[1:]), 1 << 62]
    times = []
    for message, after in zip(seen.sent, following, strict=True):
        if after - message.after < TIMEOUT_US:
            continue
        safe = next((at for at, mode in seen.commands if mode == 0 and message.after < at < after), None)
        assert safe is not None, "a safe value was never sent"
        times.append(safe - message.after)
    return times


def measure(helper: Callable[[str], Path], bus: str, load: int, queue_us: int = 0) -> Measured:
    """Runs both programs, some five seconds. Asserts that no age told is too young, and that nothing old is fresh.

    `queue_us`: how long a frame may wait at its sender, behind the call that sends it and before its stamp.
    """
    seen = _run(helper, bus, load)
    ages, safe = _ages(seen, queue_us), _times_to_safe(seen)
    assert len(ages) > CUTS * 15
    assert len(safe) == CUTS
    mean = sum(ages) // len(ages)
    return Measured(load, bounds_at(load), mean, max(ages), max(safe), seen.loop_late, seen.peer_late)


def check(measured: Measured, slack_us: int) -> None:
    """Within the bounds, plus the lateness that the loop and the robot have counted."""
    late = measured.loop_late + measured.peer_late + slack_us
    assert measured.age_max <= measured.bounds.age + late, measured
    assert measured.safe_max <= measured.bounds.safe + late, measured
