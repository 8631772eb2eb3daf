# SPDX-License-Identifier: MIT
"""Which part of a tree a step leads to: what Lemmas 2 to 4 ask for, in the form that is right (docs/theory.md).

A child that leaves its running region must arrive where the tree succeeds, or where another child takes over. What
arrives where the tree fails falls between two children.
"""

from __future__ import annotations

from dataclasses import dataclass

from canopy.verify.linear import Formula, State
from canopy.verify.model import FAILURE
from canopy.verify.system import System


@dataclass(frozen=True)
class Handover:
    """A step from what `source` does to what `target` does, with an example. `falls`: the tree has failed there."""

    source: str
    target: str
    falls: bool
    before: State
    after: State


def handovers(system: System) -> list[Handover]:
    """Every pair of things that follow each other, from any state of the state space."""
    found: dict[tuple[str, str], Handover] = {}
    for index, piece in enumerate(system.pieces):
        if not piece.acting:
            continue
        for other in system.pieces:
            key = (piece.label, other.label)
            if piece.acting == other.acting or key in found:
                continue
            state = Formula(system.width, (system.before(index, other.states),)).point()
            if state is not None:
                after = system.next(index, state, other.states)
                assert after is not None
                found[key] = Handover(*key, other.status == FAILURE, state, after)
    return list(found.values())
