# SPDX-License-Identifier: MIT
"""What is proven holds in the compiled system, and what is refuted happens: controller, bus and robot in process."""

from __future__ import annotations

import ctypes
import os
import shlex
import subprocess
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.verify.claims import Result
from canopy.verify.run import verify
from theory.leaves import APPLICATIONS, NAO, ROOT, Application

STARTS = 100_000
SEED = 20161130


def build(application: Application, folder: Path) -> ctypes.CDLL:
    """runs.c with everything that it needs, as one library."""
    arguments = ["--name", application.name, "--dbc", str(NAO / "nao.dbc"), "--node", "Controller", "-o", str(folder)]
    for command in (
        ["compile", str(application.tree), *arguments, "--period-ms", "50"],
        ["codec", str(NAO / "nao.dbc"), "--node", "Robot", "-o", str(folder)],
    ):
        result = CliRunner().invoke(main, command)
        assert result.exit_code == 0, result.output
    sources = [Path(__file__).parent / "runs.c", NAO / "in_process.c", application.leaves, folder / "nao_codec.c"]
    sources += [folder / f"{application.name}_{part}.c" for part in ("app", "bus")]
    sources += [*(ROOT / "sim/plant/src").glob("*.c"), *(ROOT / "runtime/src").glob("*.c")]
    sources += (ROOT / "drivers/can/loopback").glob("*.c")
    includes = [folder, NAO, *(ROOT / place / "include" for place in ("runtime", "drivers", "sim/plant"))]
    library = folder / "runs.so"
    compiler = [*shlex.split(os.environ.get("CC", "cc")), "-std=c11", "-O2", "-fPIC", "-shared"]
    compiler += [f"-DRUNS_APP={application.name}_app", *(f"-I{one}" for one in includes)]
    subprocess.run([*compiler, *map(str, sources), "-o", str(library)], check=True)
    loaded = ctypes.CDLL(str(library))
    assert loaded.runs_init()
    return loaded


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ctypes.CDLL]:
    return {name: build(one, tmp_path_factory.mktemp(name)) for name, one in APPLICATIONS.items()}


def decided(name: str, claims: Sequence[str]) -> list[Result]:
    subject = APPLICATIONS[name].subject()
    known = {claim.name: claim for claim in subject.plant.claims}
    return [verify(subject, known[claim]) for claim in claims]


def test_100000_random_ways_home_take_no_more_steps_than_proven(libraries: dict[str, ctypes.CDLL]) -> None:
    (proof,) = decided("nao_home", ["Lemma 11, as tight as it is true"])
    assert proof.verdict == "proven"
    assert proof.bound == Fraction(19)
    worst = libraries["nao_home"].runs_worst_way_home(STARTS, ctypes.c_uint64(SEED), 30)
    assert worst == 19


@pytest.mark.timeout(300)
def test_100000_random_starts_never_have_less_battery_than_proven(libraries: dict[str, ctypes.CDLL]) -> None:
    proven, refuted = decided("nao_power", ["It never has less than 5 %, as tight as it is true", "5 % can happen"])
    assert (proven.verdict, refuted.verdict) == ("proven", "refuted")
    least = libraries["nao_power"].runs_least_battery(STARTS, ctypes.c_uint64(SEED), 110)
    assert 50 <= least < 60


def test_what_is_refuted_of_the_way_home_happens(libraries: dict[str, ctypes.CDLL]) -> None:
    """State for state, in whole millimetres."""
    for result in decided("nao_home", ["18 steps are not enough", "It does not act for 5"]):
        assert result.verdict == "refuted"
        wanted = [tuple(int(value * 1000) for value in visit.state) for visit in result.trace]
        states = (ctypes.c_int32 * (2 * len(wanted)))()
        libraries["nao_home"].runs_posture(*wanted[0], len(wanted), states)
        assert list(zip(states[::2], states[1::2], strict=True)) == wanted


def test_what_is_refuted_of_the_battery_happens(libraries: dict[str, ctypes.CDLL]) -> None:
    (result,) = decided("nao_power", ["5 % can happen"])
    assert result.verdict == "refuted"
    wanted = [(int(visit.state[0] * 10**9), int(visit.state[1] * 10)) for visit in result.trace]
    assert all(
        visit.state[0] * 10**9 == a and visit.state[1] * 10 == b
        for visit, (a, b) in zip(result.trace, wanted, strict=True)
    )
    states = (ctypes.c_int64 * (2 * len(wanted)))()
    libraries["nao_power"].runs_power(ctypes.c_int64(wanted[0][0]), wanted[0][1], len(wanted), states)
    assert list(zip(states[::2], states[1::2], strict=True)) == wanted
    assert Fraction(wanted[-1][1], 10) == 5
