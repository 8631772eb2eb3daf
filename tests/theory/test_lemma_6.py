# SPDX-License-Identifier: MIT
"""Lemma 6 (chattering): its sign is the wrong way round, and a slope of 0 says nothing.

One dimension is enough. s(x) = x: T1 succeeds where x <= 0, so T2 acts there, and T1 where x > 0. Each has a constant
speed.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import pytest

from canopy.verify.solvers import SOLVERS, decide

SPEEDS = [Fraction(n, 2) for n in range(-6, 7) if n]
STEP = Fraction(1, 1000)


def acting(x: Fraction) -> int:
    return 2 if x <= 0 else 1


def chatters(one: Fraction, other: Fraction) -> bool:
    """Does the run from the border switch in at least a third of its steps for as long as it is watched?"""
    x, switches, last = Fraction(0), 0, 2
    for _ in range(600):
        x += STEP * (other if acting(x) == 2 else one)
        switches += acting(x) != last
        last = acting(x)
    return switches >= 100


def chatter_free_as_printed(slope_1: Fraction, slope_2: Fraction) -> bool:
    return slope_1 < 0 or slope_2 > 0


def chatter_free(slope_1: Fraction, slope_2: Fraction) -> bool:
    """Canopy's form: on one side at least the field points away from the border."""
    return slope_1 > 0 or slope_2 < 0


def test_the_printed_signs_call_the_worst_case_free_and_the_best_one_not() -> None:
    one, other = Fraction(-1), Fraction(1)  # both push onto the border
    assert chatters(one, other)
    assert chatter_free_as_printed(one, other)
    assert not chatters(Fraction(1), Fraction(-1))  # both push away from it
    assert not chatter_free_as_printed(Fraction(1), Fraction(-1))


def test_the_right_signs_are_right_for_every_pair_of_speeds() -> None:
    for one, other in product(SPEEDS, SPEEDS):
        ratio = max(abs(one), abs(other)) / min(abs(one), abs(other))
        if ratio > 2 and not chatter_free(one, other):
            continue  # it slides along the border, with fewer switches than one step in three
        assert chatters(one, other) is not chatter_free(one, other), (one, other)


def alternates(steps: int, extra: str, solver: str) -> str:
    """Is there a start, and speeds with `extra`, with a switch at every one of `steps` steps? By solver."""
    script = f"(declare-const one Real) (declare-const other Real) (declare-const x0 Real)\n(assert {extra})\n"
    script += "(assert (<= x0 0))\n"
    for number in range(steps):
        speed, there = ("other", ">") if number % 2 == 0 else ("one", "<=")
        script += f"(define-fun x{number + 1} () Real (+ x{number} {speed}))\n(assert ({there} x{number + 1} 0))\n"
    return decide(script, solver)


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_right_signs_by_solver_for_all_speeds_at_once(solver: str) -> None:
    assert alternates(2, "(or (> one 0) (< other 0))", solver) == "unsat"
    assert alternates(6, "(or (< one 0) (> other 0))", solver) == "sat"
    assert alternates(6, "(and (< one 0) (> other 0))", solver) == "sat"


def test_a_flat_s_makes_the_slopes_say_nothing() -> None:
    """s(x) = x^3 has the same sign as x, and the slope 0 at the border: both forms fail, whatever the tree does."""
    slope = Fraction(0)  # ds/dx at 0
    for one, other in product(SPEEDS, SPEEDS):
        assert not chatter_free_as_printed(slope * one, slope * other)
        assert not chatter_free(slope * one, slope * other)
    assert not chatters(Fraction(1), Fraction(1))
