# SPDX-License-Identifier: MIT
"""What the paper prints about Examples 4 to 6, number by number, in its own recursion (docs/theory.md)."""

from __future__ import annotations

from fractions import Fraction
from math import ceil

from integration import paper

TENTH = Fraction(1, 10)
State = tuple[Fraction, Fraction]


def success_1(x: State) -> bool:
    """Eq. 39."""
    return x[1] >= 100 or (x[0] >= TENTH and x[1] > 20)


def f_1(x: State) -> State:
    """Eqs. 42 and 43, with "else" everywhere else."""
    return (x[0], x[1] + 1) if x[0] < TENTH and x[1] < 100 else (x[0] - 1, x[1] - TENTH)


def regions_4(x: State) -> set[str]:
    """Eqs. 48 to 50."""
    found = {"S"} if x[0] <= 0 else set()
    if x[0] != 0:
        found.add("R" if x[1] >= Fraction(48, 100) else "F")
    return found


def test_example_4_guarantee_power_supply_is_not_finite_time_successful_as_defined() -> None:
    """F1 is empty and it reaches S1, but f1 goes on in S1 and leaves it: Definition 5 asks it to stay."""
    x = (Fraction(0), Fraction(99))
    x = f_1(x)
    assert success_1(x)
    x = f_1(x)
    assert not success_1(x)
    outside = (TENTH, Fraction(201, 10))
    assert success_1(outside)
    assert not success_1(f_1(outside))


def test_example_4_leaves_its_state_space() -> None:
    assert f_1((TENTH, Fraction(20)))[0] == Fraction(-9, 10)
    assert f_1((Fraction(0), Fraction(999, 10)))[1] == Fraction(1009, 10)


def test_example_4_an_empty_battery_can_be_stepped_over() -> None:
    """O = {x2 = 0} is never met from x2 = 0.05, and the battery is below 0 all the same."""
    x = (Fraction(100), Fraction(5, 100))
    levels = []
    for _ in range(3):
        x = f_1(x)
        levels.append(x[1])
    assert 0 not in levels
    assert min(levels) < 0


def test_lemma_10_starts_outside_the_running_region() -> None:
    """Definition 6 wants I within R; I = {x2 >= 15} has states of S1."""
    assert success_1((Fraction(50), Fraction(50)))


def test_example_5_regions_overlap_as_printed() -> None:
    assert regions_4((Fraction(-5, 100), Fraction(1, 2))) == {"S", "R"}
    assert regions_4((Fraction(-5, 100), Fraction(1, 10))) == {"S", "F"}


def test_example_5_leaves_its_state_space() -> None:
    """From 0.05 m the last step ends at -0.05 m; x1 is said to be in [0, 0.5]."""
    steps = list(paper.example_5(Fraction(5, 100), Fraction(1, 2)))
    assert steps[-1].x1 == Fraction(-5, 100)


def test_example_5_arithmetic() -> None:
    walk, stand, sit = (
        Fraction(1, 2) / TENTH,
        ceil(Fraction(18, 100) / Fraction(5, 100)),
        Fraction(3, 10) / Fraction(3, 100),
    )
    assert [walk, stand, sit] == [5, 4, 10]  # the paper has 10, 4, 10
    assert walk + stand + sit == 19  # and 24
    worst = max(
        len(list(paper.example_5(Fraction(x, 100), Fraction(y, 100)))) - 1 for x in range(1, 51) for y in range(56)
    )
    assert worst == 19


def test_lemma_11_breaks_the_premise_of_lemma_3() -> None:
    """S6 within R5, and S5 within R4, are printed; the right form has what has succeeded already, too."""
    standing = (Fraction(1, 4), Fraction(1, 2))
    assert standing[1] >= Fraction(3, 10)  # S6
    assert not Fraction(3, 10) <= standing[1] < Fraction(48, 100)  # R5
    assert standing[1] >= Fraction(48, 100)  # but S5
    home = (Fraction(0), Fraction(1, 2))
    assert home[1] >= Fraction(48, 100)  # S5
    assert regions_4(home) == {"S"}  # not R4, but S4


def test_lemma_11_regions_of_attraction_differ_between_lemma_and_proof() -> None:
    """The proof has 0 <= x1: at x1 = 0 the tree has succeeded, so this is no state of R."""
    assert regions_4((Fraction(0), Fraction(1, 10))) == {"S"}


def test_example_5_the_text_fails_at_03_and_the_formula_does_not() -> None:
    """The text under Eq. 55 has x2 <= 0.3 for lying; Eq. 54 has x2 < 0.3. Only the formula leaves no gap to S6."""
    x2 = Fraction(3, 10)
    assert x2 >= Fraction(3, 10)  # S6: Lie down to Sit up has done its work
    assert Fraction(3, 10) <= x2 < Fraction(48, 100)  # R5: Sit to Stand goes on


def parallel(statuses: str, needed: int) -> str:
    """Algorithm 3."""
    if statuses.count("S") >= needed:
        return "S"
    return "F" if statuses.count("F") > len(statuses) - needed else "R"


def test_example_6_play_ball_game_cannot_fail() -> None:
    """M = 1, and the Ball Tracker is always RUNNING: then it never fails, and what follows it never has its turn."""
    assert {parallel("R" + right, 1) for right in "SRF"} == {"S", "R"}
    assert {parallel("F" + right, 1) for right in "SRF"} == {"S", "R", "F"}  # a tracker that may fail
    assert {parallel("S" + right, 2) for right in "SRF"} == {"S", "R", "F"}  # or M = 2 and one that succeeds
