# SPDX-License-Identifier: MIT
"""How fast the robot's simulation is: `PYTHONPATH=tests build/venv/bin/python -m bench.robot`; docs/nao.md shows it.

CPU time where one process does the work, the best of several; wall time where two have to talk.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

from canopy_sim.mission import Mission, People
from canopy_sim.plant import Profile
from integration.big_mission import folder, model_file
from integration.missions import ControllerProcess
from integration.sim_peers import Simulator

BUILD = Path(os.environ.get("CANOPY_BUILD_DIR") or "build/host").resolve()
PEOPLE = People.say | People.toes | People.push | People.drop
TICKS = 360_000
"""An hour of 10 ms."""


def hour(*, corrected: bool) -> float:
    """Seconds of CPU for an hour of the Big BT with its robot and people around it; the best of five."""
    mission = Mission(model_file(BUILD), Profile.nao)
    if not corrected:
        mission.application.run_image(folder(BUILD) / "nao_big_as_printed.img", model_file(BUILD, corrected=False))
    mission.let_people(PEOPLE, 3000)
    took = []
    for _ in range(5):
        begin = time.process_time()
        mission.run(TICKS)
        took.append(time.process_time() - begin)
    return min(took)


def plant_steps() -> dict[str, float]:
    """Steps of the plant per second of CPU, by profile; the best of three."""
    best: dict[str, float] = {}
    for _ in range(3):
        out = subprocess.run(
            [str(BUILD / "tests" / "bench" / "plant_steps")], capture_output=True, text=True, check=True
        )
        for profile, steps in re.findall(r"(\w+) (\d+)", out.stdout):
            best[profile] = max(best.get(profile, 0.0), float(steps))
    return best


def lock_step(ticks: int = 10_000) -> float:
    """Ticks per second of wall time of Example 5 with canopy-sim on a unixbus; the best of three."""
    best = 0.0
    for _ in range(3):
        with tempfile.TemporaryDirectory(prefix="canopy-", dir="/tmp") as bus_dir:
            bus = f"unixbus:{bus_dir}/bus0"
            with ControllerProcess(BUILD, "nao_home", bus, "--lock-step"):
                time.sleep(0.5)
                begin = time.monotonic()
                with Simulator(bus, "--lock-step", "--no-lcm", "--steps", str(ticks)) as simulator:
                    while simulator.process.stderr and "lock-step on" not in simulator.process.stderr.readline():
                        pass
                    begin = time.monotonic()
                    simulator.wait(120)
                best = max(best, ticks / (time.monotonic() - begin))
    return best


def main() -> None:
    """Prints everything."""
    for name, corrected in (("corrected", True), ("printed", False)):
        print(f"an hour of 10 ms ticks, {name}: {hour(corrected=corrected):.3f} s")
    for profile, steps in plant_steps().items():
        print(f"plant, profile {profile}: {steps / 1e6:.1f} million steps/s")
    print(f"canopy-sim with Example 5 in lock-step on a unixbus: {lock_step():.0f} ticks/s")


if __name__ == "__main__":
    main()
