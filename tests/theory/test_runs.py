# SPDX-License-Identifier: MIT
"""What is proven holds in the compiled system, and what is refuted happens: controller, bus and robot in process."""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import pytest

from canopy.live.codes import Status
from canopy.verify.claims import Result
from canopy.verify.run import verify
from canopy_sim.small_mission import SmallMission
from theory.leaves import APPLICATIONS, ROOT

STARTS = 100_000
SEED = 20161130

Start = Callable[[str], SmallMission]


@pytest.fixture
def start() -> Start:
    """Starts nao_home or nao_power, as the build has made it."""
    build = Path(os.environ.get("CANOPY_BUILD_DIR") or ROOT / "build" / "host")

    def make(name: str) -> SmallMission:
        return SmallMission(build / "examples" / "nao" / "generated" / name / f"{name}.model.json")

    return make


def decided(name: str, claims: Sequence[str]) -> list[Result]:
    subject = APPLICATIONS[name].subject()
    known = {claim.name: claim for claim in subject.plant.claims}
    return [verify(subject, known[claim]) for claim in claims]


def test_100000_random_ways_home_take_no_more_steps_than_proven(start: Start) -> None:
    (proof,) = decided("nao_home", ["Lemma 11, as tight as it is true"])
    assert proof.verdict == "proven"
    assert proof.bound == Fraction(19)
    chance, mission = random.Random(SEED), start("nao_home")
    worst = 0
    for _ in range(STARTS):
        mission.set_posture(chance.randrange(1, 501), chance.randrange(551))
        worst = max(worst, mission.application.run(31, until=[Status.SUCCESS]) - 1)
    assert worst == 19


@pytest.mark.timeout(300)
def test_100000_random_starts_never_have_less_battery_than_proven(start: Start) -> None:
    proven, refuted = decided("nao_power", ["It never has less than 5 %, as tight as it is true", "5 % can happen"])
    assert (proven.verdict, refuted.verdict) == ("proven", "refuted")
    chance, mission = random.Random(SEED), start("nao_power")
    mission.least_battery(again=True)
    for _ in range(STARTS):
        mission.set_power(chance.randrange(100 * 10**9 + 1), chance.randrange(150, 1001))
        mission.application.run(110)
    assert 50 <= mission.least_battery() < 60


def test_what_is_refuted_of_the_way_home_happens(start: Start) -> None:
    """State for state, in whole millimetres."""
    for result in decided("nao_home", ["18 steps are not enough", "It does not act for 5"]):
        assert result.verdict == "refuted"
        wanted = [tuple(int(value * 1000) for value in visit.state) for visit in result.trace]
        mission = start("nao_home")
        mission.set_posture(*wanted[0])
        states = []
        for _ in wanted:
            states.append(mission.posture)
            mission.application.tick()
        assert states == wanted


def test_what_is_refuted_of_the_battery_happens(start: Start) -> None:
    (result,) = decided("nao_power", ["5 % can happen"])
    assert result.verdict == "refuted"
    wanted = [(int(visit.state[0] * 10**9), int(visit.state[1] * 10)) for visit in result.trace]
    assert all(
        visit.state[0] * 10**9 == a and visit.state[1] * 10 == b
        for visit, (a, b) in zip(result.trace, wanted, strict=True)
    )
    mission = start("nao_power")
    mission.set_power(*wanted[0])
    states = []
    for _ in wanted:
        states.append(mission.power)
        mission.application.tick()
    assert states == wanted
    assert Fraction(wanted[-1][1], 10) == 5
