# SPDX-License-Identifier: MIT
"""Claims about leaves that measure with an error, and late: against runs by the definition, one by one."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest

from canopy.certificate.formula import RejectedError
from canopy.compiler.errors import CompileError
from canopy.verify.certify import certificate
from canopy.verify.claims import Result
from canopy.verify.run import load, recheck, verify
from canopy.verify.solvers import SOLVERS
from canopy.verify.unroll import Visit

TREE = Path(__file__).parent / "thermostat.xml"
POWER = Path(__file__).parents[2] / "examples" / "nao" / "trees" / "power_supply.xml"
POWER_MODEL = Path(__file__).parent / "sensed_power_supply.plant.toml"
TEXT = """format = 1
[variables.x]
unit = "degC"
range = [-30, 60]

[leaves.Warm]
failure = "x < {threshold}"
running = "else"
[[leaves.Warm.modes]]
when = "x >= -20"
next = {{ x = "x - {fall}" }}
[[leaves.Warm.modes]]
when = "x < -20"
next = {{ x = "x" }}

[leaves.Heat]
success = "x > 50"
running = "else"
[[leaves.Heat.modes]]
next = {{ x = "x + {rise}" }}

[[claims]]
name = "claim"
kind = "avoids"
from = "x >= {threshold} and x <= {threshold} + 5"
avoid = "{avoid}"
{more}
"""


@dataclass(frozen=True)
class Room:
    """Falls by `fall` where it measures `threshold` or more, else rises; errors and states are whole numbers."""

    threshold: int
    fall: int
    rise: int
    error: tuple[int, int]
    age: int

    def acts(self, measured: int) -> str:
        return "Heat" if measured < self.threshold else "Warm"

    def steps(self, past: tuple[int, ...]) -> Iterator[tuple[str, int]]:
        """(who acts, next state): `past` has the newest state first."""
        for age, error in product(range(self.age + 1), range(self.error[0], self.error[1] + 1)):
            who = self.acts(past[min(age, len(past) - 1)] + error)
            yield who, past[0] + (self.rise if who == "Heat" else -self.fall)

    def reached(self) -> set[int]:
        """All states of all runs from the starts, where every combination of errors and ages is tried."""
        waiting: list[tuple[int, ...]] = [(start,) for start in range(self.threshold, self.threshold + 6)]
        known = set(waiting)
        while waiting:
            past = waiting.pop()
            for _, state in self.steps(past):
                after = (state, *past)[: self.age + 1]
                if after not in known:
                    known.add(after)
                    waiting.append(after)
        return {past[0] for past in known}

    def result(self, folder: Path, avoid: str, more: str = "") -> Result:
        model = folder / "t.plant.toml"
        keys = f"error = {{ x = [{self.error[0]}, {self.error[1]}] }}\nage = {self.age}\n{more}"
        numbers = {"threshold": self.threshold, "fall": self.fall, "rise": self.rise}
        model.write_text(TEXT.format(**numbers, avoid=avoid, more=keys))
        subject = load(TREE, model)
        return verify(subject, subject.plant.claims[0], 20)

    def can_happen(self, visits: Sequence[Visit]) -> bool:
        """Is each step of a trace one that some age and some error, not only a whole one, explains?"""
        states = [visit.state[0] for visit in visits]
        for moment, visit in enumerate(visits[:-1]):
            seen = [states[moment - age] for age in range(min(self.age, moment) + 1)]
            low, high = min(seen) + self.error[0], max(seen) + self.error[1]
            possible = low < self.threshold if visit.label == "Heat" else high >= self.threshold
            step = self.rise if visit.label == "Heat" else -self.fall
            if not possible or states[moment + 1] != states[moment] + step:
                return False
        return True


def rooms() -> Iterator[Room]:
    chance = random.Random(18)
    for _ in range(60):
        error = (-chance.randint(0, 2), chance.randint(0, 2))
        yield Room(chance.randint(5, 15), chance.randint(1, 3), chance.randint(1, 4), error, chance.randint(0, 2))


def test_random_rooms_against_every_run(tmp_path: Path) -> None:
    verdicts: dict[str, int] = {}
    for room in rooms():
        reached = room.reached()
        for avoid, happens in (
            (f"x <= {min(reached)}", True),
            (f"x >= {max(reached)}", True),
            (f"x < {min(reached) - room.fall}", False),
            (f"x > {max(reached) + room.rise}", False),
        ):
            result = room.result(tmp_path, avoid)
            if happens:
                assert result.verdict != "proven", (room, avoid)
            if result.verdict == "refuted":
                assert room.can_happen(result.trace), (room, avoid, result.trace)
            if room.age == 0:
                assert result.verdict != "unknown", (room, avoid)
            verdicts[result.verdict] = verdicts.get(result.verdict, 0) + 1
    assert verdicts["proven"] > 80
    assert verdicts["refuted"] > 80


def test_without_error_and_age_it_is_as_before(tmp_path: Path) -> None:
    exact = Room(10, 1, 1, (0, 0), 0)
    assert exact.result(tmp_path, "x < 9").verdict == "proven"
    assert exact.result(tmp_path, "x <= 9").verdict == "refuted"
    late = Room(10, 1, 1, (0, 0), 1)
    assert late.result(tmp_path, "x < 8").verdict == "proven"
    assert late.result(tmp_path, "x <= 8").verdict == "refuted"
    wrong = Room(10, 1, 1, (0, 2), 0)
    assert wrong.result(tmp_path, "x < 7").verdict == "proven"
    refuted = wrong.result(tmp_path, "x <= 7.5")
    assert refuted.verdict == "refuted"
    assert refuted.trace[-1].state[0] <= Fraction(15, 2)


def test_example_4_with_wrong_and_late_measurements() -> None:
    subject = load(POWER, POWER_MODEL)
    for claim in subject.plant.claims:
        result = verify(subject, claim)
        assert result.expected, (claim.name, result.text)
        if result.verdict == "proven":
            assert {recheck(result, solver) for solver in SOLVERS} == {"agrees"}


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("error = { x = [0.1, 0.2] }", "0 is not in it"),
        ("error = { y = [0, 1] }", "no variable 'y'"),
        ("error = 3", "must be a table"),
        ("age = -1", "age of x must be a number of steps"),
        ("age = { x = 1.5 }", "age of x must be a number of steps"),
        ("age = { z = 1 }", "no variable 'z'"),
        ("error = { x = [-45, 45] }", "leaves the state space"),
    ],
)
def test_wrong_errors_and_ages(tmp_path: Path, more: str, said: str) -> None:
    model = tmp_path / "t.plant.toml"
    model.write_text(TEXT.format(threshold=10, fall=1, rise=10, avoid="x > 55", more=more))
    subject = load(TREE, model)
    with pytest.raises(CompileError) as caught:
        verify(subject, subject.plant.claims[0], 5)
    assert said in str(caught.value)


def test_such_a_claim_has_no_certificate(tmp_path: Path) -> None:
    """The checker knows nothing of errors: it must not take the claim for one without."""
    assert Room(10, 1, 1, (0, 2), 0).result(tmp_path, "x < 7").verdict == "proven"
    subject = load(TREE, tmp_path / "t.plant.toml")
    with pytest.raises(RejectedError, match="claims with the key 'error' have no certificates"):
        certificate(subject.plant.claims[0], TREE, tmp_path / "t.plant.toml")
