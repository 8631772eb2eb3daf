# SPDX-License-Identifier: MIT
"""Claims that one step decides: given invariants, and Lemma 6's borders, against runs of small models."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest

from canopy.compiler.errors import CompileError
from canopy.verify.claims import Result
from canopy.verify.run import load, recheck, verify
from canopy.verify.solvers import SOLVERS
from theory.test_lemma_6 import SPEEDS, chatter_free, chatters

TREE = Path(__file__).parent / "thermostat.xml"
MODEL = """format = 1
[variables.x]
unit = "degC"
range = [-100, 100]

[leaves.Warm]
failure = "x < 0"
running = "else"
[[leaves.Warm.modes]]
when = "x <= 90"
next = {{ x = "x + {warm}" }}
{more}
[[leaves.Warm.modes]]
when = "x > 90"
next = {{ x = "x" }}

[leaves.Heat]
running = "true"
[[leaves.Heat.modes]]
when = "x >= -90 and x < 90"
next = {{ x = "x + {heat}" }}
[[leaves.Heat.modes]]
when = "x < -90 or x >= 90"
next = {{ x = "x" }}

[[claims]]
name = "claim"
{claim}
"""
BORDER = 'kind = "border"\ninside = "x > -80 and x < 80"'


def result(folder: Path, warm: Fraction, heat: Fraction, claim: str, more: str = "") -> Result:
    model = folder / "t.plant.toml"
    model.write_text(MODEL.format(warm=float(warm), heat=float(heat), claim=claim, more=more))
    subject = load(TREE, model)
    return verify(subject, subject.plant.claims[0], 20)


def test_a_border_is_free_where_lemma_6_in_its_right_form_says_so(tmp_path: Path) -> None:
    for warm, heat in product(SPEEDS, SPEEDS):
        verdict = result(tmp_path, warm, heat, BORDER).verdict
        assert verdict == ("proven" if chatter_free(warm, heat) else "refuted"), (warm, heat)
        if verdict == "proven":
            assert not chatters(warm, heat)


def test_standing_still_on_a_border_says_nothing(tmp_path: Path) -> None:
    """Who does not move is no reason not to chatter: the other one may lead back."""
    zero, one = Fraction(0), Fraction(1)
    assert result(tmp_path, zero, one, BORDER).verdict == "refuted"
    assert result(tmp_path, one, zero, BORDER).verdict == "proven"
    assert result(tmp_path, zero, zero, BORDER).verdict == "refuted"


def test_a_disturbance_may_turn_a_step_back(tmp_path: Path) -> None:
    speeds = (Fraction(1), Fraction(1))
    assert result(tmp_path, *speeds, BORDER, "disturbance = { x = [-0.5, 0] }").verdict == "proven"
    assert result(tmp_path, *speeds, BORDER, "disturbance = { x = [-1.5, 0] }").verdict == "refuted"
    assert result(tmp_path, *speeds, BORDER + "\ndisturbance = { x = [-1, 1] }").verdict == "refuted"


def step(x: Fraction, warm: Fraction, heat: Fraction) -> Fraction:
    if x >= 0:
        return x + warm if x <= 90 else x
    return x + heat if x >= -90 else x


def test_given_invariants_against_single_steps(tmp_path: Path) -> None:
    chance = random.Random(6)
    verdicts = []
    for _ in range(80):
        warm, heat = -abs(chance.choice(SPEEDS)), chance.choice(SPEEDS)
        low, high = Fraction(chance.randint(-8, 0), 2), Fraction(chance.randint(0, 8), 2)
        claim = f'kind = "invariant"\nholds = "x >= {float(low)} and x <= {float(high)}"\n'
        claim += f'from = "x >= {float(low)} and x <= {float(high)}"'
        found = result(tmp_path, warm, heat, claim)
        samples = [low + (high - low) * Fraction(k, 64) for k in range(65)]
        leaks = [x for x in samples if not low <= step(x, warm, heat) <= high]
        if found.verdict == "proven":
            assert not leaks
            assert {recheck(found, solver) for solver in SOLVERS} == {"agrees"}
        else:
            before, after = (visit.state[0] for visit in found.trace)
            assert low <= before <= high
            assert after == step(before, warm, heat)
            assert not low <= after <= high
        verdicts.append(found.verdict)
    assert verdicts.count("proven") > 10
    assert verdicts.count("refuted") > 10


@pytest.mark.parametrize(
    ("claim", "said"),
    [
        ('holds = "x >= 0"\nfrom = "x >= -1 and x <= 1"', "the start x = -1 degC is not in it"),
        ('holds = "x >= -90"\nfrom = "x >= 0"\navoid = "x < -80"', "which is to be avoided"),
    ],
)
def test_a_set_that_is_none_of_these(tmp_path: Path, claim: str, said: str) -> None:
    found = result(tmp_path, Fraction(1), Fraction(1), f'kind = "invariant"\n{claim}')
    assert found.verdict == "refuted"
    assert said in found.text


@pytest.mark.parametrize("claim", ['kind = "invariant"', BORDER + "\nage = 1", 'kind = "border"\nwithin = 3'])
def test_wrong_keys(tmp_path: Path, claim: str) -> None:
    with pytest.raises(CompileError, match=r"needs the key 'holds'|has no key"):
        result(tmp_path, Fraction(1), Fraction(1), claim)
