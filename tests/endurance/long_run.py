# SPDX-License-Identifier: MIT
"""A controller at 1 ms with robot, monitor, bridge and record: memory stays flat, and what is lost is counted."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from endurance.fast import build_nao_home
from endurance.processes import commands, end, resident_kb, start

PERIOD_MS = 1
LOOK_S = 10.0
GROWTH_KB = 8192
"""From a tenth of the time on, of one program."""


def run(build: Path, folder: Path, seconds: float) -> int:
    """Runs it, prints what it came to, and gives the exit status: 0 flat memory and every loss counted."""
    program, model = build_nao_home(build, folder, PERIOD_MS)
    (folder / "bus").mkdir()
    lines = commands(build, f"unixbus:{folder}/bus", folder, "memq://")
    lines["controller"][0] = str(program)
    for line in lines.values():
        if "--model" in line:
            line[line.index("--model") + 1] = str(model)
    names = ["sim", "record", "monitor", "bridge", "controller"]
    processes = {}
    for name in names:
        processes[name] = start(lines[name], folder, name)
        _wait_for_sockets(folder / "bus", len(processes))  # the record is there before the controller's first tick
    memory: dict[str, list[int]] = {name: [] for name in names}
    began = time.monotonic()
    try:
        while time.monotonic() - began < seconds:
            time.sleep(min(LOOK_S, seconds / 20))
            for name, process in processes.items():
                if process.poll() is not None:
                    print(f"{name} ended by itself, with status {process.returncode}: {_last_words(folder, name)}")
                    return 1
                memory[name].append(resident_kb(process))
    finally:
        statuses = {name: end(process) for name, process in reversed(processes.items())}
    return _judge(folder, statuses, memory, time.monotonic() - began)


def _wait_for_sockets(bus: Path, count: int) -> None:
    end_at = time.monotonic() + 60
    while len(list(bus.glob("*.sock"))) < count:
        if time.monotonic() > end_at:
            raise TimeoutError(f"only {len(list(bus.glob('*.sock')))} of {count} programs came to the bus")
        time.sleep(0.05)


def _judge(folder: Path, statuses: dict[str, int], memory: dict[str, list[int]], seconds: float) -> int:
    grown = {}
    for name, samples in memory.items():
        early = max(samples[: max(1, len(samples) // 10)])
        grown[name] = max(samples[-max(1, len(samples) // 10) :]) - early
        print(
            f"{name}: status {statuses[name]}, {samples[-1]} KiB at the end, {grown[name]:+d} KiB since a tenth of it"
        )
    record = json.loads(_written(folder, "record").splitlines()[-1])
    bridge = json.loads(_written(folder, "bridge").splitlines()[-1])
    print(f"record: {record}")
    print(f"bridge: {bridge}")
    print(f"controller: {_written(folder, 'controller')}")
    print(f"{seconds:.0f} s at {PERIOD_MS} ms")
    whole = record["trace_lost"] == 0 or record["lost"] > 0  # what is missing in the log, somebody has counted
    good = not any(statuses.values()) and max(grown.values()) < GROWTH_KB and whole
    print("good" if good else "NOT GOOD", file=sys.stdout if good else sys.stderr)
    return 0 if good else 1


def _written(folder: Path, name: str) -> str:
    return (folder / f"{name}.out").read_text(encoding="utf-8", errors="replace").strip()


def _last_words(folder: Path, name: str) -> str:
    return (folder / f"{name}.err").read_text(encoding="utf-8", errors="replace").strip()[-500:]
