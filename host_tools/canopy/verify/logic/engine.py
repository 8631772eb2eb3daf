# SPDX-License-Identifier: MIT
"""Asks berkeley-abc whether a circuit's output can ever be 1.

First the first ticks are searched (bmc3), which finds most of what can be refuted at once. Then the circuit is made
smaller (scorr, dc2), and property directed reachability (pdr) decides it for any number of ticks.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from canopy.files import read_text, write_files
from canopy.verify.logic.circuit import FALSE, TRUE, Circuit

PROGRAM = "berkeley-abc"
GRACE = 10.0
"""Seconds beyond its own limit after which the program is ended."""
SEARCHED = 20
"""Ticks that are searched first."""
SEARCH_SECONDS = 2
_LONGEST_TRACE = 64 * 1024 * 1024


class EngineError(Exception):
    """The program is not there, or did not do what it should; `help_text` says what to do."""

    def __init__(self, message: str, help_text: str = "") -> None:
        super().__init__(message)
        self.help_text = help_text


@dataclass(frozen=True)
class Answer:
    """`verdict`: proven, refuted or unknown. `ticks`: the inputs that are 1 or 0 in each tick, if it is refuted."""

    verdict: str
    ticks: tuple[dict[int, bool], ...] = ()
    reason: str = ""


def _trace(text: str, inputs: tuple[int, ...], count: int) -> tuple[dict[int, bool], ...]:
    """The counterexample as AIGER writes it: the latches' first values, then one line of inputs a tick."""
    if not inputs:
        return ({},) * count
    lines = text.partition("#")[0].split()[-count:]
    if len(lines) != count or any(len(line) != len(inputs) or set(line) - set("01x") for line in lines):
        raise EngineError(f"{PROGRAM} wrote a trace that cannot be read")
    return tuple({literal: value == "1" for literal, value in zip(inputs, line, strict=True)} for line in lines)


def _run(folder: Path, commands: str, seconds: float) -> str:
    """What the program says to commands on the question; empty if it takes too long."""
    path = shutil.which(PROGRAM)
    if path is None:
        raise EngineError(f"{PROGRAM} is not installed", f"apt-get install {PROGRAM}")
    try:
        done = subprocess.run(
            [path, "-c", f"read_aiger question.aig; {commands}; write_cex -a trace.txt"],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=seconds + GRACE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return ""
    if done.returncode != 0:
        raise EngineError(f"{PROGRAM} ended with status {done.returncode}")
    return done.stdout.decode(errors="replace")


def decide(circuit: Circuit, bad: int, seconds: float) -> Answer:
    """Can a literal ever be 1?

    Raises:
        EngineError: The program is missing, or its answer cannot be read.
    """
    if bad == FALSE:
        return Answer("proven")
    if bad == TRUE:
        return Answer("refuted", ({},))
    aiger = circuit.aiger(bad)
    with tempfile.TemporaryDirectory(prefix="canopy-") as name:
        folder = Path(name)
        write_files({folder / "question.aig": aiger.content})
        said = _run(folder, f"bmc3 -F {SEARCHED} -T {SEARCH_SECONDS}", seconds)
        if "was asserted in frame" not in said:
            said = _run(folder, f"&get; &scorr; &put; dc2; pdr -T {max(1, round(seconds))}", seconds)
        if "Property proved" in said:
            return Answer("proven")
        found = re.search(r"was asserted in frame (\d{1,9})", said)
        if found is None:
            return Answer(
                "unknown", reason=f"{PROGRAM} did not decide it within {seconds:g} s; --timeout gives it more"
            )
        text = read_text(folder / "trace.txt", _LONGEST_TRACE) if aiger.inputs else ""
    return Answer("refuted", _trace(text, aiger.inputs, int(found[1]) + 1))
