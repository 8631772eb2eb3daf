# SPDX-License-Identifier: MIT
"""Lemma 1 (exponential stability gives finite time success): two counterexamples, and the form that holds."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction

Status = Callable[[Fraction], str]


def half(x: Fraction) -> Fraction:
    """The map x/2: globally exponentially stable at 0, in the sharpest sense there is."""
    return x / 2


def steps_to_stay(start: Fraction, status: Status, most: int) -> int | None:
    """Steps until S is reached for good, within `most`; R up to then, as Definition 5 asks. None: it is not so."""
    run = [start]
    for _ in range(most):
        run.append(half(run[-1]))
    first = next((t for t, x in enumerate(run) if status(x) == "S"), None)
    if first is None or any(status(x) != "S" for x in run[first:]):
        return None
    return first


def test_there_is_no_common_bound_on_an_unbounded_region() -> None:
    """R = all but S has no border: from 2^k it takes k steps, so no τ is enough. F is empty, as printed."""

    def status(x: Fraction) -> str:
        return "S" if abs(x) <= 1 else "R"

    assert [steps_to_stay(Fraction(2**k), status, 200) for k in (1, 10, 100)] == [1, 10, 100]


def test_more_success_than_a_ball_can_be_left_again() -> None:
    """S holds the ball of radius 1, as printed, and one point more: a run passes through it, and is RUNNING again."""

    def status(x: Fraction) -> str:
        return "S" if abs(x) <= 1 or x == 8 else "R"

    assert steps_to_stay(Fraction(16), status, 200) is None
    assert steps_to_stay(Fraction(15), status, 200) == 4


def test_lemma_1_in_its_right_form() -> None:
    """From a bounded set, with S kept by f: steps <= log(distance / radius) / rate, here the number of halvings."""

    def status(x: Fraction) -> str:
        return "S" if abs(x) <= 1 else "R"

    chance = random.Random(1)
    for _ in range(2000):
        start = Fraction(chance.randint(-(2**20), 2**20), chance.randint(1, 64))
        bound = 20  # |x| <= 2^20
        steps = steps_to_stay(start, status, bound + 20)
        assert steps is not None
        assert steps <= bound
