# SPDX-License-Identifier: MIT
"""The C plant against the paper's recursion in exact fractions, tick by tick, and Lemmas 10 and 11.

The plant is driven by the paper's policy, which sees what the robot's sensors show and nothing else.
"""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import islice

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canopy_sim.plant import Plant, PostureMode, PowerMode
from integration import paper

RUN = 2000
ROUNDING_NM = 25
"""Farthest that x1 can be from its exact value [nm] (canopy_sim/power.h)."""


def power_mode(plant: Plant) -> PowerMode:
    """Example 4's policy on what the sensors show: distance in whole mm, battery in 0.1 %."""
    at_charger = plant.distance_mm < 100
    if plant.battery >= 1000 or (not at_charger and plant.battery > 200):
        return PowerMode.DoTask
    return PowerMode.Charge if at_charger else PowerMode.DriveToCharger


def posture_mode(plant: Plant) -> PostureMode:
    """Example 5's policy."""
    if plant.head_x_mm <= 0:
        return PostureMode.Stop
    if plant.head_height_mm >= 480:
        return PostureMode.WalkHome
    return PostureMode.StandUp if plant.head_height_mm >= 300 else PostureMode.SitUp


def walk_example_4(distance_mm: int, battery: int, ticks: int) -> Fraction:
    """Compares every tick; returns the least distance of an inexact x1 from the threshold of 0.1 m [nm]."""
    plant = Plant()
    plant.set_power(distance_mm * 10**6, battery)
    margin = Fraction(10**9)
    steps = paper.example_4(Fraction(distance_mm, 1000), Fraction(battery, 10))
    for tick, step in enumerate(islice(steps, ticks)):
        mode = power_mode(plant)
        assert mode.name == paper.MODES[step.phase], (tick, step)
        assert plant.battery == step.x2 * 10, (tick, step)
        exact_nm = step.x1 * 10**9
        assert abs(plant.distance_nm - exact_nm) <= ROUNDING_NM, (tick, step)
        if plant.distance_nm != exact_nm:
            margin = min(margin, abs(exact_nm - 10**8))
        plant.step_power(mode)
    return margin


def test_example_4_from_80_m_and_50_percent_is_exact_for_2000_ticks() -> None:
    assert walk_example_4(80_000, 500, RUN) > ROUNDING_NM
    assert paper.phases(paper.example_4(Fraction(80), Fraction(50)), RUN) == [
        ("task", 300),
        ("drive", 50),
        ("charge", 85),
        ("task", 800),
        ("drive", 50),
        ("charge", 85),
        ("task", 630),
    ]


def starts_on_the_sensors_grid() -> list[tuple[int, int]]:
    """200 starts in [0, 100] m x [0, 100] %, the same ones every time, the corners among them."""
    chance = random.Random(4)
    corners = [(0, 0), (0, 1000), (100_000, 0), (100_000, 1000), (99, 200), (100, 200), (100, 201), (99, 999)]
    return corners + [(chance.randint(0, 100_000), chance.randint(0, 1000)) for _ in range(200 - len(corners))]


def test_example_4_is_exact_from_200_other_starts() -> None:
    """Up to where the paper's battery goes below 0, which from within Lemma 10's region I it never does."""
    compared = 0
    for distance_mm, battery in starts_on_the_sensors_grid():
        steps = islice(paper.example_4(Fraction(distance_mm, 1000), Fraction(battery, 10)), 1000)
        ticks = next((tick for tick, step in enumerate(steps) if step.x2 < 0), 1000)
        assert ticks == 1000 or battery < 150
        assert walk_example_4(distance_mm, battery, ticks) > ROUNDING_NM, (distance_mm, battery)
        compared += ticks == 1000
    assert compared >= 150


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 100_000), st.integers(150, 1000))
def test_example_4_is_exact_from_any_start_in_region_i(distance_mm: int, battery: int) -> None:
    assert walk_example_4(distance_mm, battery, 500) > ROUNDING_NM


def walk_example_5(head_x_mm: int, head_height_mm: int) -> int:
    """Compares every tick; returns the number of ticks until home."""
    plant = Plant()
    plant.set_posture(head_x_mm, head_height_mm)
    ticks = 0
    for ticks, step in enumerate(paper.example_5(Fraction(head_x_mm, 1000), Fraction(head_height_mm, 1000))):  # noqa: B007
        assert (Fraction(plant.head_x_mm, 1000), Fraction(plant.head_height_mm, 1000)) == (step.x1, step.x2), step
        mode = posture_mode(plant)
        assert mode.name == paper.MODES[step.phase], step
        plant.step_posture(mode)
    return ticks


def test_example_5_from_the_floor_at_half_a_metre() -> None:
    assert walk_example_5(500, 0) == 19
    assert paper.phases(paper.example_5(Fraction(1, 2), Fraction(0))) == [
        ("sit-up", 10),
        ("stand-up", 4),
        ("walk", 5),
        ("home", 1),
    ]


def test_example_5_is_exact_and_within_lemma_11_from_the_whole_grid() -> None:
    """Every 7 mm of x1 and 5 mm of x2, borders included: the paper's bound is 24 steps, the longest run takes 19."""
    heights = range(0, 551, 5)
    longest = max(walk_example_5(x, height) for x in [*range(1, 501, 7), 500] for height in heights)
    assert longest == 19


def test_binary_floating_point_would_count_other_ticks() -> None:
    """Why the plant counts in integers: with floats the walk of five steps takes six, for 0.5 - 5 * 0.1 is not 0."""
    x, steps = 0.5, 0
    while x > 0:
        x, steps = x - 0.1, steps + 1
    assert steps == 6


@pytest.mark.timeout(300)
def test_lemma_10_the_battery_is_never_empty() -> None:
    """From 600 starts in I = {0 <= x1 <= 100, 15 <= x2}, for 2,000 ticks each: more than two whole cycles."""
    chance = random.Random(10)
    starts = [(x, battery) for x in range(0, 100_001, 10_000) for battery in range(150, 1001, 50)]
    starts += [(chance.randint(0, 100_000), chance.randint(150, 1000)) for _ in range(600 - len(starts))]
    plant = Plant()
    least = 1000
    for distance_mm, battery in starts:
        plant.set_power(distance_mm * 10**6, battery)
        for _ in range(RUN):
            plant.step_power(power_mode(plant))
            least = min(least, plant.battery)
    assert least == 50  # from (100, 15): 100 steps of driving
