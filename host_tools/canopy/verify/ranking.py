# SPDX-License-Identifier: MIT
"""A bound on the steps to a goal, from facets: in each piece some direction grows by at least so much a step, and ends.

If the pieces that are not the goal follow each other without a cycle, the bounds along the longest way add up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor

from canopy.verify.invariant import Invariant, combined, greatest
from canopy.verify.linear import Affine, Direction


@dataclass(frozen=True)
class Leaving:
    """Why a run leaves a piece within `steps`: `direction` · x grows by `speed` or more a step, from `low` to `high`.

    A piece that no run stays in for a second step has no direction.
    """

    piece: int
    steps: int
    direction: Direction | None = None
    speed: Fraction = Fraction(0)
    low: Fraction = Fraction(0)
    high: Fraction = Fraction(0)
    open: bool = False
    """One of the ends is not reached."""


@dataclass(frozen=True)
class Ranking:
    """The pieces on the way to the goal, each before those that it leads to, and how long each lasts."""

    leaving: tuple[Leaving, ...]
    total: int


def stays(low: Fraction, high: Fraction, speed: Fraction, *, is_open: bool) -> int:
    """Most steps from `low` on before `high` is passed."""
    ratio = (high - low) / speed
    whole = floor(ratio)
    return whole if is_open and whole == ratio and whole > 0 else whole + 1


def _leaving(invariant: Invariant, index: int) -> Leaving | None:
    again = invariant.crossing(index, index)
    if again is None:
        return Leaving(index, 1)
    states = invariant.states(index)
    assert states is not None
    maps = invariant.system.open[index].maps
    width = invariant.system.width
    best: Leaving | None = None
    for direction in invariant.template:
        after = combined(direction, maps)
        padded = (*direction, *(0,) * (len(after.coefficients) - width))
        change = Affine(tuple(d - a for a, d in zip(after.coefficients, padded, strict=True)), -after.constant)
        slowest = greatest(again, change)
        if slowest is None or slowest[0] >= 0:
            continue
        speed = -slowest[0]
        top = greatest(states, Affine(tuple(map(Fraction, direction)), Fraction(0)))
        bottom = greatest(states, Affine(tuple(Fraction(-value) for value in direction), Fraction(0)))
        if top is None or bottom is None:
            continue
        is_open = top[1] or bottom[1]
        steps = stays(-bottom[0], top[0], speed, is_open=is_open)
        if best is None or steps < best.steps:
            best = Leaving(index, steps, direction, speed, -bottom[0], top[0], is_open)
    return best


def rank(invariant: Invariant, outside: Sequence[int]) -> Ranking | str:
    """A bound on the steps through the pieces `outside`, or why there is none."""
    reached = [index for index in outside if invariant.bounds[index] is not None]
    leads = {
        index: [to for to in reached if to != index and invariant.crossing(index, to) is not None] for index in reached
    }
    order = _sorted(reached, leads)
    if order is None:
        return "the pieces follow each other in a cycle"
    longest: dict[int, int] = {}
    leaving = {}
    for index in reversed(order):
        one = _leaving(invariant, index)
        if one is None:
            return f"nothing makes a run leave '{invariant.system.pieces[index].label}'"
        leaving[index] = one
        longest[index] = one.steps + max((longest[to] for to in leads[index]), default=0)
    return Ranking(tuple(leaving[index] for index in order), max(longest.values(), default=0))


def _sorted(reached: Sequence[int], leads: dict[int, list[int]]) -> list[int] | None:
    """Each before those that it leads to; None: there is a cycle."""
    order: list[int] = []
    left = list(reached)
    while left:
        first = next((i for i in left if not any(i in leads[other] for other in left if other != i)), None)
        if first is None:
            return None
        order.append(first)
        left.remove(first)
    return order
