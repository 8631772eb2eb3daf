# SPDX-License-Identifier: MIT
"""`canopy verify --never` and `--always` as they are typed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.verify.cli import command
from canopy.verify.logic import engine
from logic.bus import NODE, write_dbc
from logic.large import document, large_tree

pytestmark = pytest.mark.logic
ROOT = Path(__file__).parents[2]
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
    body = '<Sequence><Count n="{x}"/><Act name="a" _skipIf="x == 1"/><Do/></Sequence>'
    skipped = asked(tmp_path, body, "--never", "SKIPPED(a)")
    assert skipped.output.startswith("refuted")
    assert skipped.output.endswith("T/Count SUCCESS, T/Do FAILURE: the tree is FAILURE; x = 1\n")
    for formula in (
        "SKIPPED(a) and TICKED(a)",
        "SUCCESS(a) and not TICKED(a)",
        "HALTED(a) and not once(RUNNING(a), 1)",
    ):
        assert asked(tmp_path, body, "--never", formula).output.startswith("proven")
    assert asked(
        tmp_path, body, "--always", "TICKED(a) or SKIPPED(a) or FAILURE(Count) or TICKED(Do)"
    ).output.startswith("proven")


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
        '<Told speed="3"/>',
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


FAN = (
    '<Fallback><ScriptCondition code="Climate.Temperature &lt; 25.25"/>'
    '<Act name="fan" _while="Climate.Door == Open"/></Fallback>'
)


@pytest.mark.parametrize(
    ("option", "formula", "verdict"),
    [
        ("--never", "RUNNING(fan) and {Climate.Temperature < 25}", "refuted"),
        ("--never", "TICKED(fan) and not previous(RUNNING(fan)) and {Climate.Temperature <= 25}", "proven"),
        ("--never", "TICKED(fan) and not previous(RUNNING(fan)) and {Climate.Temperature <= 25.5}", "refuted"),
        ("--always", "RUNNING(fan) implies {Climate.Door == Open && Climate.fresh}", "proven"),
        ("--never", "RUNNING(fan) and not FRESH(Climate)", "proven"),
        ("--never", "SUCCESS(root) and {Climate.Temperature == 25}", "refuted"),
    ],
)
def test_signals(tmp_path: Path, option: str, formula: str, verdict: str) -> None:
    bus = ["--dbc", str(write_dbc(tmp_path)), "--node", NODE]
    assert asked(tmp_path, FAN, option, formula, *bus).output.startswith(verdict)
    with_bus = asked(tmp_path, FAN, "--never", "RUNNING(fan)", *bus)
    assert "Climate.Temperature 36, Climate.Door 1; T/fan RUNNING" in with_bus.output
    without = asked(tmp_path, FAN, "--never", "RUNNING(fan)")
    assert without.output.startswith("unknown")
    assert "--dbc and --node make scripts exact" in without.output


COUNT = (
    '<Sequence><Script code="n := 0" _skipIf="n > 0"/><Script code="n += 1; t := \'late\'"/>'
    '<Act name="a" _skipIf="n &lt; 4"/></Sequence>'
)


def test_entries(tmp_path: Path) -> None:
    late = asked(tmp_path, COUNT, "--never", "TICKED(a)")
    assert "refuted  never TICKED(a)\n         in tick 4" in late.output
    assert late.output.endswith("T/a FAILURE: the tree is FAILURE; n = 4\n")
    for proven in ("{n >= 1 && n <= 2147483647}", "TICKED(a) implies {n > 3}", "{t == 'late'}"):
        assert asked(tmp_path, COUNT, "--always", proven).output.startswith("proven")
    (answer,) = json.loads(asked(tmp_path, COUNT, "--never", "{n == 2}", "--json").output)
    assert answer["trace"][1]["entries"] == ["n = 2", "t = 'late'"]


@pytest.mark.parametrize(
    ("body", "formula", "said"),
    [
        (FAN, "{Climate.Temperature > 3}", "without the bus nothing is known"),
        (COUNT, "{m > 3}", "nothing writes entry 'm'"),
        (COUNT, "{n := 3}", "one condition is expected in braces"),
        (COUNT, "{n > 3; n > 4}", "one condition is expected in braces"),
        (COUNT, "{n > }", "column 6: a value is expected"),
        (COUNT, "{n > 3", "a brace is not closed"),
        (COUNT, "{t}", "is neither true nor false"),
        (COUNT, "FRESH(Climate)", "no leaf reads a message 'Climate'"),
        ('<Drive n="{n}"/>', "{n > 3}", "entry 'n' cannot be followed"),
        ('<LoopInt queue="1;2" value="{n}"><Act/></LoopInt>', "{n > 3}", "entry 'n' cannot be followed"),
    ],
)
def test_conditions_that_cannot_be_asked(tmp_path: Path, body: str, formula: str, said: str) -> None:
    result = asked(tmp_path, body, "--never", formula)
    assert result.exit_code == 2
    assert "--never: error: column " in result.output
    assert said in result.output


def test_what_is_written_in_a_halt_may_be_anything(tmp_path: Path) -> None:
    body = (
        '<Sequence><Script code="n := 1"/><ReactiveFallback><Check/><Act name="a" _onHalted="n := 2"/>'
        '</ReactiveFallback><ScriptCondition name="one" code="n == 1"/></Sequence>'
    )
    result = asked(tmp_path, body, "--never", "FAILURE(one)")
    assert result.output.startswith("unknown")
    assert "that the tree may not give: T/one" in result.output


@pytest.mark.parametrize(
    "script",
    [
        "f ? n := 2 : (n := 3)",
        "m := (n := 2) + 1",
        "n := t &lt; 'b' ? 2 : 3",
        "n := '2' == 2 ? 2 : 3",
    ],
)
def test_what_no_circuit_follows_may_write_anything(tmp_path: Path, script: str) -> None:
    """Assignments inside expressions, and the order and numbers of texts: no claim about what they write is proven."""
    body = f"""<Sequence><Script code="n := 0; m := 0; f := true; t := 'a'"/><Script code="{script}"/></Sequence>"""
    for formula in ("{n == 2}", "{n == 3}", "{n != 2 && n != 3 && n != 0}"):
        result = asked(tmp_path, body, "--never", formula)
        assert result.output.startswith("unknown"), (formula, result.output)


def test_test_nodes(tmp_path: Path) -> None:
    body = '<TestNode name="t" return_status="FAILURE" async_delay="100" failure_script="n := 7"/>'
    for option, formula in (
        ("--never", "SUCCESS(t) or SKIPPED(t)"),
        ("--always", "FAILURE(t) implies {n == 7}"),
        ("--never", "FAILURE(t) and not previous(previous(RUNNING(t)))"),
    ):
        assert asked(tmp_path, body, option, formula, "--period", "50").output.startswith("proven")
    assert asked(tmp_path, body, "--never", "FAILURE(t)", "--period", "50").output.startswith("refuted")
    assert asked(tmp_path, body, "--never", "FAILURE(t)").output.startswith("unknown")


OPAQUE = '<TryCatch catch_on_halt="true" name="try"><Act name="a"/><Do name="b"/></TryCatch>'


def test_what_has_no_circuit_may_return_anything(tmp_path: Path) -> None:
    body = f'<Sequence><Do name="c"/>{OPAQUE}</Sequence>'
    assert asked(tmp_path, body, "--never", "TICKED(try) and RUNNING(c)").output.startswith("proven")
    assert asked(tmp_path, body, "--never", "RUNNING(c)").output.startswith("refuted")
    result = asked(tmp_path, body, "--never", "SUCCESS(try)")
    assert result.output.startswith("unknown")
    assert 'catch_on_halt="true" is not modelled' in result.output
    below = asked(tmp_path, body, "--never", "RUNNING(a)")
    assert below.exit_code == 2
    assert "nothing is known of 'a': it lies below T/try" in below.output


def test_subtrees_have_names(tmp_path: Path) -> None:
    subtrees = '<SubTree ID="U" name="sub" _skipIf="x == 1"/><SubTree ID="U" name="last"/>'
    body = f'<Sequence><Count n="{{x}}"/>{subtrees}</Sequence>'
    text = document(body).replace(
        "</BehaviorTree>", '</BehaviorTree><BehaviorTree ID="U"><Inverter><Act name="a"/></Inverter></BehaviorTree>'
    )
    text = text.replace('BTCPP_format="4"', 'BTCPP_format="4" main_tree_to_execute="T"')
    path = tmp_path / "t.xml"
    path.write_text(text)
    for option, formula, verdict in (
        ("--never", "SKIPPED(sub)", "refuted"),
        ("--never", "SKIPPED(last)", "proven"),
        ("--never", 'SKIPPED(sub) and TICKED("T/sub/a")', "proven"),
        ("--never", "SKIPPED(sub) and TICKED(sub)", "proven"),
        ("--always", 'SUCCESS(last) implies FAILURE("T/last/a")', "proven"),
        ("--never", "RUNNING(T/sub) and RUNNING(last)", "proven"),
    ):
        assert CliRunner().invoke(command, [str(path), option, formula]).output.startswith(verdict), formula
    wrong = CliRunner().invoke(command, [str(path), "--never", "IDLE(lost)"])
    assert "did you mean 'last'?" in wrong.output


POSE = "geometry_msgs::msg::PoseStamped_<std::allocator<void>>=pose_t"
PATH = "nav_msgs::msg::Path_<std::allocator<void>>=path_t"


@pytest.mark.parametrize(
    ("tree", "dbc", "options", "runs"),
    [
        ("tests/unit/language/main.xml", "tests/unit/language/language.dbc", ["--include", "state.h"], "unknown"),
        (
            "examples/courier/trees/courier.xml",
            "examples/courier/courier.dbc",
            ["--include", "courier_types.h", "--type-map", POSE, "--type-map", PATH],
            "refuted",
        ),
    ],
)
def test_applications(tree: str, dbc: str, options: list[str], runs: str) -> None:
    """Queues, texts, numbers from entries, constants that are fractions on the way, control nodes of one's own."""
    bus = ["--dbc", str(ROOT / dbc), "--node", NODE, "--period", "10"]
    questions = ["--never", "RUNNING(root) and FAILURE(root)", "--never", "HALTED(root)", "--never", "RUNNING(root)"]
    result = CliRunner().invoke(command, [str(ROOT / tree), *bus, *options, *questions])
    assert result.exit_code == 1
    verdicts = [line.split()[0] for line in result.output.splitlines() if " never " in line[:16]]
    assert verdicts == ["proven", "proven", runs]


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
