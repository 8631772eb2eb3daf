# SPDX-License-Identifier: MIT
"""Every claim of the paper on Examples 1 to 6, from the models in examples/: as expected, checked by both solvers."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.verify.run import hand_over, load, model_path, recheck, verify
from canopy.verify.solvers import SOLVERS

ROOT = Path(__file__).parents[2]
TREES = {
    "Example 1": ROOT / "examples/papers/trees/fig3.xml",
    "Example 2": ROOT / "examples/papers/trees/fig14.xml",
    "Example 3": ROOT / "examples/papers/trees/fig16.xml",
    "Example 4": ROOT / "examples/nao/trees/power_supply.xml",
    "Example 5": ROOT / "examples/nao/trees/get_home.xml",
    "Example 6": ROOT / "examples/papers/trees/fig34.xml",
}
SECONDS = 60


def claims() -> list[tuple[str, str]]:
    return [
        (example, claim.name) for example, tree in TREES.items() for claim in load(tree, model_path(tree)).plant.claims
    ]


@pytest.mark.parametrize(("example", "name"), claims())
def test_a_claim_comes_out_as_expected_and_solvers_agree(example: str, name: str) -> None:
    subject = load(TREES[example], model_path(TREES[example]))
    claim = next(one for one in subject.plant.claims if one.name == name)
    result = verify(subject, claim, SECONDS)
    assert result.expected, result.text
    assert result.verdict != "unknown"
    if result.verdict == "proven" and claim.kind not in ("dwell", "border"):
        assert result.steps
        for solver in SOLVERS:
            assert recheck(result, solver) == "agrees"


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_solver_disagrees_with_a_wrong_step(solver: str) -> None:
    subject = load(TREES["Example 5"], model_path(TREES["Example 5"]))
    result = verify(subject, subject.plant.claims[0])
    result.steps.append("(and true (< v0 1.0))")
    assert recheck(result, solver) == "disagrees"


def test_the_headline_bounds_take_less_than_2_seconds_each() -> None:
    for example, name in (
        ("Example 5", "Lemma 11, as tight as it is true"),
        ("Example 4", "The battery is never empty"),
        ("Example 4", "Lemma 10: whatever the other task is, if its steps are shorter than 5"),
    ):
        subject = load(TREES[example], model_path(TREES[example]))
        begin = time.process_time()
        result = verify(subject, next(one for one in subject.plant.claims if one.name == name))
        assert result.verdict == "proven"
        assert time.process_time() - begin < 2


def test_nothing_falls_between_the_postures() -> None:
    found = hand_over(load(TREES["Example 5"], model_path(TREES["Example 5"])))
    assert [(one.source, one.target, one.falls) for one in found] == [
        ("Walk Home", "SUCCESS", False),
        ("Sit to Stand", "Walk Home", False),
        ("Lie down to Sit up", "Sit to Stand", False),
    ]


def test_a_gap_between_two_subtrees_is_found(tmp_path: Path) -> None:
    """Sit to Stand from 0.35 m on only: who has sat up below that falls between the two."""
    text = model_path(TREES["Example 5"]).read_text()
    text = text.replace('failure = "x2 < 0.3"', 'failure = "x2 < 0.35"')
    text = text.replace(
        'success = "x2 >= 0.3"\nrunning', 'success = "x2 >= 0.48"\nfailure = "x2 >= 0.3 and x2 < 0.48"\nrunning'
    )
    model = tmp_path / "gap.toml"
    model.write_text(text)
    falls = [one for one in hand_over(load(TREES["Example 5"], model)) if one.falls]
    assert [one.source for one in falls] == ["Lie down to Sit up"]
    assert falls[0].before[1] < falls[0].after[1] < 0.35


def test_the_command_prints_verdicts_and_traces() -> None:
    result = CliRunner().invoke(main, ["verify", str(TREES["Example 5"]), "--handover"])
    assert result.exit_code == 0, result.output
    assert (
        "proven   Lemma 11, as tight as it is true\n         within 19 steps, and 19 are needed (ranking"
        in result.output
    )
    assert "       0  x1 = 0.5 m, x2 = 0 m  Lie down to Sit up" in result.output
    assert "hand-over: no step leads to where the tree fails" in result.output


def test_the_command_speaks_json_and_exits_with_1_when_a_claim_fails(tmp_path: Path) -> None:
    model = tmp_path / "m.toml"
    model.write_text(model_path(TREES["Example 5"]).read_text().replace("within = 5", "within = 4"))
    arguments = ["--model", str(model), "--claim", "Walk Home alone: 5 steps, not the paper's 10", "--json"]
    result = CliRunner().invoke(main, ["verify", str(TREES["Example 5"]), *arguments])
    assert result.exit_code == 1
    (found,) = json.loads(result.output)
    assert (found["verdict"], found["expected"]) == ("refuted", False)
    assert [step["state"]["x1"] for step in found["trace"]] == ["0.5", "0.4", "0.3", "0.2", "0.1", "0"]
