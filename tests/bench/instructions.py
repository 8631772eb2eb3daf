# SPDX-License-Identifier: MIT
"""Counts instructions: on this machine with valgrind's callgrind, exactly and repeatably, whatever else it does."""

import json
import os
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

# Set-up and what the first tick alone does cancel out in the difference of two runs.
TICKS = (2, 12)


def collected(command: Sequence[str | Path], within: Sequence[str] = ()) -> tuple[int, str]:
    """Instructions of a run of a program, and what it printed. Raises RuntimeError when it fails.

    `within` names functions that do not call each other: only they count, with all that they call.
    """
    only = [f"--toggle-collect={function}" for function in within]
    valgrind = ("valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *only)
    environment = {**os.environ, "PYTHONHASHSEED": "0"}
    try:
        done = subprocess.run((*valgrind, *command), capture_output=True, text=True, check=False, env=environment)
    except FileNotFoundError as error:
        raise RuntimeError("valgrind is missing; `make bench` installs it") from error
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or found is None:
        raise RuntimeError(f"{' '.join(map(str, command))} under callgrind failed:\n{done.stdout}{done.stderr}")
    return int(found[1]), done.stdout


def per_tick(command: Sequence[str | Path]) -> float:
    """Instructions of one tick of a program whose last argument is the number of ticks."""
    few, many = (collected((*command, str(ticks)))[0] for ticks in TICKS)
    return (many - few) / (TICKS[1] - TICKS[0])


def canopy_per_leaf(program: Path, workload: str, n: int) -> float:
    """Instructions of a tick for each leaf that it calls, all of the engine and the leaf included."""
    command = (program, "run", workload, str(n))
    counts = [
        int(json.loads(subprocess.run((*command, str(ticks)), capture_output=True, check=True).stdout)["leaf_calls"])
        for ticks in TICKS
    ]
    leaves = (counts[1] - counts[0]) / (TICKS[1] - TICKS[0])
    return per_tick(command) / leaves
