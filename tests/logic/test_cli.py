# SPDX-License-Identifier: MIT
"""`canopy verify --never` and `--always` as they are typed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.verify.cli import command
from canopy.verify.logic import engine
from logic.large import document, large_tree

pytestmark = pytest.mark.logic
WORK = '<Sequence><Act name="first"/><Act name="Go home"/></Sequence>'
BODY = f'<ReactiveFallback><ReactiveSequence><Check/><Do name="fan"/></ReactiveSequence>{WORK}</ReactiveFallback>'


def asked(folder: Path, body: str, *options: str) -> Result:
    path = folder / "t.xml"
    path.write_text(document(body))
    return CliRunner().invoke(command, [str(path), *options])


@pytest.mark.parametrize(
    ("option", "formula", "verdict"),
    [
        ("--never", 'RUNNING(first) and RUNNING("Go home")', "proven"),
        ("--never", 'RUNNING("Go home")', "refuted"),
        ("--always", 'RUNNING("T/Go home") implies once(SUCCESS(first))', "proven"),
        ("--always", "responds(SUCCESS(Check), TICKED(fan), 3)", "proven"),
        ("--always", "responds(SUCCESS(Check), RUNNING(fan), 3)", "refuted"),
        ("--always", "since(true, TICKED(root))", "proven"),
        ("--never", "HALTED(first) and not previous(RUNNING(first))", "proven"),
        ("--never", "true", "refuted"),
    ],
)
def test_verdicts(tmp_path: Path, option: str, formula: str, verdict: str) -> None:
    result = asked(tmp_path, BODY, option, formula)
    assert result.output.startswith(verdict)
    assert result.exit_code == (0 if verdict == "proven" else 1)


@pytest.mark.parametrize(
    ("formula", "column", "said"),
    [
        ("RUNING(first)", 1, "did you mean 'RUNNING'?"),
        ("RUNNING(frist)", 9, "did you mean 'first'?"),
        ("RUNNING(first", 14, "expected ')', not the end"),
        ("RUNNING(first) RUNNING(fan)", 16, "join formulas with"),
        ("once(RUNNING(first), 1001)", 22, "0 to 1000"),
        ('RUNNING("Go home)', 9, "a quote is not closed"),
        ("(" * 61 + "true" + ")" * 61, 61, "nested more than 60 deep"),
        ("", 1, "expected a formula"),
        ("RUNNING($)", 9, "unexpected '$'"),
    ],
)
def test_wrong_formulas(tmp_path: Path, formula: str, column: int, said: str) -> None:
    result = asked(tmp_path, BODY, "--never", formula)
    assert result.exit_code == 2
    assert f"--never: error: column {column}: " in result.output
    assert said in result.output


def test_a_name_that_two_nodes_have(tmp_path: Path) -> None:
    body = '<Sequence><Act name="a"/><Inverter name="a"><Do/></Inverter></Sequence>'
    result = asked(tmp_path, body, "--never", "IDLE(a)")
    assert result.exit_code == 2
    assert "the tree has 2 nodes 'a'" in result.output
    assert "give the path of one" in result.output


def test_a_node_with_attributes_has_the_statuses_that_its_parent_sees(tmp_path: Path) -> None:
    body = '<Sequence><Act name="a" _skipIf="x == 1"/><Do/></Sequence>'
    skipped = asked(tmp_path, body, "--never", "SKIPPED(a)")
    assert skipped.output.startswith("unknown")  # the script may say so, or not
    assert skipped.output.endswith("T/Do FAILURE: the tree is FAILURE\n")
    for formula in (
        "SKIPPED(a) and TICKED(a)",
        "SUCCESS(a) and not TICKED(a)",
        "HALTED(a) and not once(RUNNING(a), 1)",
    ):
        assert asked(tmp_path, body, "--never", formula).output.startswith("proven")
    assert asked(tmp_path, body, "--always", "TICKED(a) or SKIPPED(a) or TICKED(Do)").output.startswith("proven")


@pytest.mark.parametrize(
    "node",
    [
        '<Script code="x := Climate.Temperature"/>',
        '<Script code="x := 1; Fan.Speed := x; y := x + Climate.Temperature"/>',
        '<Told speed="{Climate.Temperature}"/>',
        '<SetBlackboard value="{Climate.Temperature}" output_key="x"/>',
    ],
)
def test_a_script_fails_while_a_signal_that_it_reads_is_stale(tmp_path: Path, node: str) -> None:
    assert not asked(tmp_path, node, "--never", "FAILURE(root)").output.startswith("proven")
    for other in (
        '<Script code="x := 1; Fan.Speed := x"/>',
        '<Told speed="{x}"/>',
        '<SetBlackboard value="1" output_key="x"/>',
    ):
        assert asked(tmp_path, other, "--never", "FAILURE(root)").output.startswith("proven")


@pytest.mark.parametrize(
    "kind", ["Parallel", 'Parallel success_count="300"', "ParallelAll", 'ReactiveParallel success_count="2"']
)
def test_a_node_with_too_many_children_to_count(tmp_path: Path, kind: str) -> None:
    element = kind.split()[0]
    for count, verdict in ((500, "refuted"), (501, "unknown")):
        body = f"<{kind}>" + "<Act/>" * count + f"</{element}>"
        result = asked(tmp_path, body, "--never", "RUNNING(root)")
        assert result.output.startswith(verdict)
    assert f"<{element}> with more than 500 children is not modelled" in result.output


def test_entries_are_set_and_unset(tmp_path: Path) -> None:
    body = '<Sequence><SetBlackboard value="1" output_key="x"/><UnsetBlackboard key="x"/><Act name="a"/></Sequence>'
    result = asked(tmp_path, body, "--never", "FAILURE(UnsetBlackboard) or FAILURE(SetBlackboard) or RUNNING(a)")
    assert result.output.startswith("refuted")
    assert result.output.endswith("T/a RUNNING: the tree is RUNNING\n")


def test_timers_are_exact_with_a_period(tmp_path: Path) -> None:
    body = '<Sleep name="wait" msec="120"/>'
    early = "SUCCESS(wait) and not previous(previous(previous(TICKED(wait))))"
    assert asked(tmp_path, body, "--never", early, "--period", "50").output.startswith("proven")
    free = asked(tmp_path, body, "--never", early)
    assert free.output.startswith("unknown")
    assert "--period makes timers exact" in free.output
    late = "SUCCESS(wait) and previous(previous(previous(TICKED(wait))))"
    assert asked(tmp_path, body, "--never", late, "--period", "50").output.startswith("refuted")


def test_what_has_no_circuit_is_named(tmp_path: Path) -> None:
    result = asked(tmp_path, '<Sequence><Do/><TestNode name="x"/></Sequence>', "--never", "RUNNING(Do)")
    assert result.exit_code == 1
    assert result.output.startswith("unknown")
    assert "<TestNode> is not modelled" in result.output


def test_options_that_do_not_go_together(tmp_path: Path) -> None:
    assert "--period goes with" in asked(tmp_path, BODY, "--period", "5").output
    assert "--handover needs a model" in asked(tmp_path, BODY, "--never", "true", "--handover").output


def test_json(tmp_path: Path) -> None:
    (answer,) = json.loads(asked(tmp_path, BODY, "--never", "RUNNING(first)", "--json").output)
    assert answer["verdict"] == "refuted"
    assert answer["trace"][-1]["statuses"]["T/first"] == "RUNNING"
    (answer,) = json.loads(asked(tmp_path, BODY, "--never", "HALTED(first)", "--json").output)
    assert [one["halted"] for one in answer["trace"]] == [[], ["T/Sequence", "T/first"]]


def test_without_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "PROGRAM", "no-such-program")
    result = asked(tmp_path, BODY, "--never", "RUNNING(first)")
    assert result.exit_code == 2
    assert "is not installed" in result.output


def test_two_thousand_nodes(tmp_path: Path) -> None:
    path = tmp_path / "large.xml"
    path.write_text(large_tree(2000))
    question = ["--never", "RUNNING(first) and RUNNING(second)", "--period", "50"]
    assert CliRunner().invoke(command, [str(path), *question]).output.startswith("proven")
