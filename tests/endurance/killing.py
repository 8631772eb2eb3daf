# SPDX-License-Identifier: MIT
"""kill -9 of any program at random: what is started again is at work again, and nobody else notices."""

from __future__ import annotations

import random
import time
from collections import deque
from itertools import pairwise
from pathlib import Path

from canopy.can_bus.steady import SteadyBus
from canopy.process.say import Voice
from endurance.processes import commands, end, start

TICK, SENSOR, COMMAND = 0x600, 0x110, 0x210
TICK_GAP_S = 0.3
"""Longest time without a tick while somebody else dies, on a busy machine; the period is 50 ms."""
STALE_S = 0.7
"""After so long without a sensor the command must be Stop: its timeout is 0.5 s."""
RECOVERY_S = 10.0


class _Witness:
    """Hears the whole bus, and remembers when what came last."""

    def __init__(self, bus: SteadyBus) -> None:
        self._bus = bus
        self.ticks: deque[float] = deque(maxlen=1000)
        self.sensors: deque[float] = deque(maxlen=1000)
        self.commands: deque[tuple[float, int]] = deque(maxlen=1000)

    def listen(self, seconds: float) -> None:
        end_at = time.monotonic() + seconds
        while (left := end_at - time.monotonic()) > 0:
            message = self._bus.recv(left)
            now = time.monotonic()
            if message is None:
                continue
            if message.arbitration_id == TICK:
                self.ticks.append(now)
            elif message.arbitration_id == SENSOR:
                self.sensors.append(now)
            elif message.arbitration_id == COMMAND:
                self.commands.append((now, message.data[2]))


def run(build: Path, folder: Path, times: int, seed: int) -> int:
    """Kills so many programs; prints what it came to, and gives the exit status."""
    chance = random.Random(seed)
    spec = f"unixbus:{folder}/bus"
    lines = commands(build, spec, folder, "memq://")
    bad: list[str] = []
    recoveries: dict[str, list[float]] = {name: [] for name in lines}
    with SteadyBus(spec, Voice("endurance"), create=True) as bus:
        witness = _Witness(bus)
        processes = {name: start(line, folder, name) for name, line in lines.items()}
        witness.listen(5)
        for number in range(times):
            name = chance.choice([*lines, "sim", "controller"])
            bad += [f"{number}: {other} ended" for other, process in processes.items() if process.poll() is not None]
            witness.listen(chance.uniform(0.05, 0.4))
            killed_at = time.monotonic()
            processes[name].kill()
            processes[name].wait()
            witness.listen(1.0)
            bad += [f"{number}: {text}" for text in _noticed(witness, name, killed_at)]
            processes[name] = start(lines[name], folder, name)
            began = time.monotonic()
            heard = {"sim": witness.sensors, "controller": witness.ticks}.get(name)
            if heard is None:
                continue
            while not (heard and heard[-1] > began) and time.monotonic() - began < RECOVERY_S:
                witness.listen(0.01)
            recoveries[name].append(time.monotonic() - began)
            if recoveries[name][-1] >= RECOVERY_S:
                bad.append(f"{number}: {name} does not come back")
        witness.listen(5)  # who was killed last has seen something, too
        statuses = {name: end(process) for name, process in processes.items()}
        witness.listen(0.2)
    bad += [f"{name} ends with status {status}" for name, status in statuses.items() if status != 0]
    left = [path.name for path in (folder / "bus").iterdir()]
    for name, found in recoveries.items():
        if found:
            print(f"{name}: {len(found)} times, back after {max(found):.2f} s at most")
    print(f"{times} killed; sockets left behind: {len(left)}; " + ("; ".join(bad) or "nothing wrong"))
    return 1 if bad else 0


def _noticed(witness: _Witness, name: str, killed_at: float) -> list[str]:
    """What others have noticed of a death."""
    found = []
    if name != "controller":
        ticks = [tick for tick in witness.ticks if tick > killed_at - 0.2]
        longest = max((later - sooner for sooner, later in pairwise(ticks)), default=9.0)
        if longest > TICK_GAP_S:
            found.append(f"{longest:.2f} s without a tick after {name} died")
    if name == "sim":
        late = [mode for at, mode in witness.commands if at > killed_at + STALE_S and mode != 0]
        if late:
            found.append(f"{len(late)} commands other than Stop, {STALE_S} s after the robot died")
    return found
