# SPDX-License-Identifier: MIT
"""The recursions of Examples 4 and 5 in exact arithmetic, straight from the paper: the reference for all that is built.

Colledanchise & Ögren, "How Behavior Trees Modularize Hybrid Control Systems and Generalize Sequential Behavior
Compositions, the Subsumption Architecture and Decision Trees". A tree is (f, r, Δt): x' = f(x) once a tick (Defs. 1-4).

Example 4 (Eqs. 39-47): x1 distance to the charger [m], x2 battery [%], Sequence(Guarantee Power Supply, Do Other Task).
Example 5 (Eqs. 48-59): x1 position, x2 height of the head [m], Fallback(Walk Home, Sit to Stand, Lie down to Sit up).

What the paper's text does not settle:
- Example 4 leaves its state space [0, 100] x [0, 100]: x1 ends a drive at down to -0.9, x2 a charge at up to 100.9.
- Example 5 lets Walk Home be in S (x1 <= 0) and in R (x1 != 0, x2 >= 0.48) at once where x1 < 0, and in S and F where
  x1 < 0 and x2 < 0.48. S is asked first here: whoever has gone past home is home.
- Lemma 11's bound is 24 steps; the longest run is 19 (10 + 4 + 5), from (0.5, 0).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import groupby, islice
from typing import NamedTuple


class Step(NamedTuple):
    """One tick: the phase that the tree chose, and the state it chose it in."""

    phase: str
    x1: Fraction
    x2: Fraction


def example_4(x1: Fraction, x2: Fraction) -> Iterator[Step]:
    """The ticks of Example 4, without end. Phases: task, drive, charge (names of PowerCommand.Mode: MODES)."""
    while True:
        succeeded = x2 >= 100 or (x1 >= Fraction(1, 10) and x2 > 20)  # S1 of Guarantee Power Supply
        if succeeded:
            yield Step("task", x1, x2)
            x1, x2 = x1 + (50 - x1) / 50, x2 - Fraction(1, 10)  # f2
        elif x1 < Fraction(1, 10) and x2 < 100:
            yield Step("charge", x1, x2)
            x2 = x2 + 1  # f1, at the charger
        else:
            yield Step("drive", x1, x2)
            x1, x2 = x1 - 1, x2 - Fraction(1, 10)  # f1, on the way


def example_5(x1: Fraction, x2: Fraction) -> Iterator[Step]:
    """The ticks of Example 5 until home. Phases: walk, stand-up, sit-up; the last one is home."""
    while not x1 <= 0:  # S of Walk Home
        if x2 >= Fraction(48, 100):  # R of Walk Home
            yield Step("walk", x1, x2)
            x1 = x1 - Fraction(1, 10)
        elif x2 >= Fraction(3, 10):  # F of Walk Home, R of Sit to Stand
            yield Step("stand-up", x1, x2)
            x2 = x2 + Fraction(5, 100)
        else:  # F of Sit to Stand, R of Lie down to Sit up
            yield Step("sit-up", x1, x2)
            x2 = x2 + Fraction(3, 100)
    yield Step("home", x1, x2)


MODES = {
    "task": "DoTask",
    "drive": "DriveToCharger",
    "charge": "Charge",
    "walk": "WalkHome",
    "stand-up": "StandUp",
    "sit-up": "SitUp",
    "home": "Stop",
}
"""Name in the DBC's value tables of the mode that belongs to a phase."""


def phases(steps: Iterator[Step], ticks: int | None = None) -> list[tuple[str, int]]:
    """How many ticks in a row each phase lasts; `ticks` cuts an endless run."""
    return [(phase, len(list(run))) for phase, run in groupby(step.phase for step in islice(steps, ticks))]
