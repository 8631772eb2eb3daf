# SPDX-License-Identifier: MIT
"""`canopy check`: each rule fires where it should and nowhere else; exit statuses, JSON, SARIF, markers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.check.registry import Severity
from canopy.check.rules import all_rules, table
from canopy.check.run import check
from canopy.cli import main
from canopy.compiler.errors import CompileError

REPOSITORY = Path(__file__).parents[2]
NAO = REPOSITORY / "examples" / "nao"

MODEL = """\
    <Condition ID="Ready"/>
    <Condition ID="DoorOpen"/>
    <Condition ID="BatteryOk"><MetadataFields><Metadata reads="Battery.Level"/></MetadataFields></Condition>
    <Condition ID="Rested"><MetadataFields>
      <Metadata reads="Battery.Level" hysteresis="until full"/></MetadataFields></Condition>
    <Action ID="Go"/>
    <Action ID="Speak"/>
    <Action ID="Blink"><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>
    <Action ID="Stop"><MetadataFields><Metadata returns="RUNNING SUCCESS"/></MetadataFields></Action>
    <Action ID="Track"><MetadataFields><Metadata returns="RUNNING"/></MetadataFields></Action>
    <Action ID="Fails"><MetadataFields><Metadata returns="FAILURE"/></MetadataFields></Action>
    <Action ID="Recharge"><MetadataFields><Metadata moves="Battery.Level"/></MetadataFields></Action>
    <Action ID="Charges"><MetadataFields><Metadata moves="B.L"/></MetadataFields></Action>
    <Action ID="KeepPower"><MetadataFields><Metadata safeguards="Battery.Level"/></MetadataFields></Action>
    <Action ID="OpenDoor"/>
    <Action ID="PassDoor"/>
    <Action ID="CloseDoor"/>
    <Action ID="Tidy"><MetadataFields><Metadata undoes="Go"/></MetadataFields></Action>
    <Action ID="Drive"><MetadataFields><Metadata writes="PowerCommand"/></MetadataFields></Action>
    <Action ID="Charge"><MetadataFields><Metadata writes="PowerCommand.Mode"/></MetadataFields></Action>
    <Action ID="Stand"><MetadataFields><Metadata writes="PostureCommand"/></MetadataFields></Action>
    <Action ID="Find"><output_port name="place" type="int"/></Action>
    <Action ID="GoTo"><input_port name="place" type="int"/></Action>
    <Action ID="Walk"><input_port name="speed" type="int" default="3"/></Action>"""

TREE = """\
<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    {nodes}
  </BehaviorTree>
  <TreeNodesModel>
{model}
  </TreeNodesModel>
</root>
"""

# rule, a tree in which it fires with this text, a tree like it in which it does not
CASES = [
    ("non-reactive", "<Sequence><Ready/><Go/></Sequence>", "nothing else is ticked while <Go> is RUNNING",
     "<ReactiveSequence><Ready/><Go/></ReactiveSequence>"),
    ("non-reactive", "<ReactiveSequence><Sequence><Ready/><Go/></Sequence><Blink/></ReactiveSequence>", "<Go>",
     "<Sequence _while='Battery.Level > 20'><Ready/><Go/></Sequence>"),
    ("non-reactive", "<Fallback><Ready/><Timeout msec='9'><Go/></Timeout></Fallback>", "<Go>",
     "<Fallback><Ready/><Parallel><Go/><DoorOpen/></Parallel></Fallback>"),
    ("implicit-sequence", "<ReactiveSequence><OpenDoor/><PassDoor/></ReactiveSequence>",
     "<PassDoor> runs only while <OpenDoor> succeeds again in every tick",
     "<ReactiveFallback><PassDoor/><OpenDoor/></ReactiveFallback>"),
    ("implicit-sequence", "<ReactiveSequence><Ready/><Go/><Walk/></ReactiveSequence>", "<Walk>",
     "<ReactiveSequence><Stop/><Go/></ReactiveSequence>"),
    ("implicit-sequence", "<ReactiveSequence><Go/><Speak/></ReactiveSequence>", "<Speak>",
     "<ReactiveSequence><KeepPower/><Go/></ReactiveSequence>"),
    ("unguarded-safety", "<ReactiveFallback><Recharge/><KeepPower/></ReactiveFallback>",
     "<Recharge> moves 'Battery.Level', and <KeepPower> (line 3), which keeps it safe, is not asked before it",
     "<ReactiveSequence><KeepPower/><Recharge/></ReactiveSequence>"),
    ("unguarded-safety", "<Sequence><KeepPower/><Recharge/></Sequence>", "<Recharge>",
     "<ReactiveSequence><KeepPower/><Sequence><Go/><Recharge/></Sequence></ReactiveSequence>"),
    ("unguarded-safety",
     "<ReactiveSequence><ReactiveFallback><Ready/><KeepPower/></ReactiveFallback><Recharge/></ReactiveSequence>",
     "<Recharge>",
     "<ReactiveSequence><ForceSuccess><KeepPower/></ForceSuccess><Recharge/></ReactiveSequence>"),
    ("unguarded-safety", "<ReactiveSequence><Sequence><KeepPower/></Sequence><Recharge/></ReactiveSequence>",
     "<Recharge>", "<Sequence><Recharge/><Charges/></Sequence>"),
    ("unreachable-child", "<Fallback><Stop/><Go/></Fallback>",
     "<Go> can never be ticked: <Stop> before it (line 3) only",
     "<Fallback><Go/><Stop/></Fallback>"),
    ("unreachable-child", "<Sequence><Inverter><Stop/></Inverter><Go/><Go/></Sequence>", "nor can the 1 after it",
     "<Sequence><Stop/><Go/></Sequence>"),
    ("unreachable-child", "<Repeat num_cycles='0'><Go/></Repeat>", "its parent never ticks its child",
     "<Repeat num_cycles='1'><Go/></Repeat>"),
    ("unreachable-child", "<IfThenElse><Stop/><Go/><Speak/></IfThenElse>", "<Speak> can never be ticked",
     "<IfThenElse><Ready/><Go/><Speak/></IfThenElse>"),
    ("unreachable-child", "<Sequence><KeepRunningUntilFailure><Go/></KeepRunningUntilFailure><Go/></Sequence>",
     "only returns FAILURE or RUNNING",
     "<Fallback><KeepRunningUntilFailure><Go/></KeepRunningUntilFailure><Go/></Fallback>"),
    ("parallel-write", "<Parallel><Drive/><Sequence><Ready/><Charge/></Sequence></Parallel>",
     "<Charge> writes 'PowerCommand.Mode', and <Drive> (line 3)", "<Parallel><Drive/><Stand/></Parallel>"),
    ("parallel-write", "<ReactiveParallel success_count='1'><Charge/><Charge/></ReactiveParallel>", "in parallel",
     "<ReactiveSequence><Charge/><Charge/></ReactiveSequence>"),
    ("parallel-masked", "<ReactiveParallel success_count='1'><Track/><Go/></ReactiveParallel>", "can never fail",
     "<ReactiveParallel success_count='1'><Stop/><Go/></ReactiveParallel>"),
    ("parallel-masked", "<ReactiveParallel success_count='2'><Track/><Go/></ReactiveParallel>", "can never succeed",
     "<ReactiveParallel success_count='2'><Speak/><Go/></ReactiveParallel>"),
    ("parallel-masked", "<Parallel success_count='-1'><Track/><Go/></Parallel>", "can never succeed",
     "<Parallel success_count='1'><Track/><Go/></Parallel>"),
    ("parallel-masked", "<ParallelAll><Track/><Go/></ParallelAll>", "can never succeed nor fail",
     "<ParallelAll><Timeout msec='9'><Track/></Timeout><Go/></ParallelAll>"),
    ("memory-under-reactive", "<ReactiveFallback><Sequence><Ready/><Go/></Sequence><Stop/></ReactiveFallback>",
     "while <Go> is RUNNING it does not ask <Ready> again",
     "<ReactiveFallback><ReactiveSequence><Ready/><Go/></ReactiveSequence><Stop/></ReactiveFallback>"),
    ("memory-under-reactive",
     "<ReactiveSequence><Inverter><Fallback><Ready/><Go/></Fallback></Inverter></ReactiveSequence>",
     "<Fallback> has a memory", "<ReactiveSequence><Ready/><Sequence><Go/><Speak/></Sequence></ReactiveSequence>"),
    ("several-running", "<ReactiveSequence><Go/><Speak/></ReactiveSequence>", "2 children of <ReactiveSequence>",
     "<ReactiveSequence><Ready/><Blink/><Speak/></ReactiveSequence>"),
    ("skipped-cleanup", "<Sequence><OpenDoor/><PassDoor/><CloseDoor/></Sequence>",
     "<CloseDoor> undoes 'OpenDoor' (line 3), but is skipped when <PassDoor> (line 3) fails",
     "<Sequence><OpenDoor/><Fallback><PassDoor/><ForceFailure><CloseDoor/></ForceFailure></Fallback></Sequence>"),
    ("skipped-cleanup", "<Sequence><Go/><Ready/><Tidy/></Sequence>", "<Tidy> undoes 'Go'",
     "<Sequence><Go/><Tidy/><Ready/></Sequence>"),
    ("skipped-cleanup", "<Sequence><Fallback><DoorOpen/><OpenDoor/></Fallback><PassDoor/><CloseDoor/></Sequence>",
     "undoes",
     "<TryCatch><Sequence><OpenDoor/><PassDoor/><CloseDoor/></Sequence><CloseDoor/></TryCatch>"),
    ("skipped-cleanup", "<Sequence><OpenDoor/><PassDoor/><CloseDoor/></Sequence>", "CloseDoor",
     "<Sequence><OpenDoor/><Stop/><CloseDoor/></Sequence>"),
    ("negated-guard", "<Sequence><Inverter><DoorOpen/></Inverter><OpenDoor/></Sequence>",
     "fails when <DoorOpen> is true already", "<Sequence><Fallback><DoorOpen/><OpenDoor/></Fallback></Sequence>"),
    ("negated-guard", "<Sequence><Inverter><DoorOpen/></Inverter><Timeout msec='5'><OpenDoor/></Timeout></Sequence>",
     "Fallback(DoorOpen, OpenDoor)", "<Sequence><Inverter><DoorOpen/></Inverter><CloseDoor/></Sequence>"),
    ("no-hysteresis", "<ReactiveFallback><BatteryOk/><Recharge/></ReactiveFallback>",
     "moves 'Battery.Level': chattering",
     "<ReactiveFallback><Rested/><Recharge/></ReactiveFallback>"),
    ("no-hysteresis", "<ReactiveFallback><BatteryOk/><Recharge/></ReactiveFallback>", "chattering",
     "<Fallback><BatteryOk/><Recharge/></Fallback>"),
    ("no-hysteresis",
     "<ReactiveFallback><ScriptCondition code='!Bus.fresh || Battery.Level &gt; 20'/><Recharge/></ReactiveFallback>",
     "<ScriptCondition> decides whether <Recharge> runs, which moves 'Battery.Level'",
     "<ReactiveFallback><ScriptCondition code='Battery.Level &gt; (full ? 20 : 9)'/><Recharge/></ReactiveFallback>"),
    ("no-hysteresis",
     "<ReactiveFallback><ScriptCondition code='B.L &lt; 2 || Up == B.M'/><Charges/></ReactiveFallback>",
     "moves 'B.L'",
     "<ReactiveFallback><ScriptCondition code='Battery.Level &gt; 20 || @mode == 1'/><Recharge/></ReactiveFallback>"),
    ("no-hysteresis", "<WhileDoElse><ScriptCondition code='20 &lt; Battery.Level'/><Go/><Recharge/></WhileDoElse>",
     "chattering",
     "<WhileDoElse><ScriptCondition code='Battery.Level == 20'/><Go/><Recharge/></WhileDoElse>"),
    ("no-hysteresis", "<Recharge _while='Battery.Level &lt; 20'/>",
     "_while=\"Battery.Level < 20\" decides whether <Recharge> runs",
     "<Recharge _skipIf='Battery.Level &gt; 20'/>"),
    ("no-hysteresis", "<Recharge _while='Battery.Level &lt; 20'/>", "chattering",
     "<Recharge _while='Battery.Current &lt; 20'/>"),
    ("unbounded-retry", "<RetryUntilSuccessful num_attempts='-1'><Blink/></RetryUntilSuccessful>", "has no end",
     "<RetryUntilSuccessful num_attempts='-1'><Go/></RetryUntilSuccessful>"),
    ("unbounded-retry", "<Repeat num_cycles='-1'><Ready/></Repeat>", "has no end",
     "<Timeout msec='9'><Repeat num_cycles='-1'><Ready/></Repeat></Timeout>"),
    ("unbounded-retry", "<Repeat num_cycles='-1'><Ready/></Repeat>", "has no end",
     "<Repeat num_cycles='{cycles}'><Ready/></Repeat>"),
    ("unreachable-child", "<Repeat num_cycles='0'><Go/></Repeat>", "its parent never ticks its child",
     "<Repeat num_cycles='{cycles}'><Go/></Repeat>"),
    ("hidden-failure", "<ForceSuccess><KeepPower/></ForceSuccess>", "which keeps 'Battery.Level' safe, has failed",
     "<ForceSuccess><Go/></ForceSuccess>"),
    ("hidden-failure",
     "<Sequence><ForceSuccess><Find place='{p}'/></ForceSuccess><GoTo place='{p}'/></Sequence>",
     "hides that <Find> can fail: <GoTo> reads 'p', which <Find> may not have written",
     "<ForceSuccess><Sequence><Find place='{p}'/><GoTo place='{p}'/></Sequence></ForceSuccess>"),
    ("hidden-failure", "<Fallback><KeepPower/><AlwaysSuccess/></Fallback>", "all other children",
     "<Fallback><Go/><AlwaysSuccess/></Fallback>"),
    ("root-can-fail", "<Fallback><Go/><Speak/></Fallback>", "its last resort, <Speak>, can fail",
     "<Fallback><Go/><Stop/></Fallback>"),
    ("root-can-fail", "<Inverter><Inverter><ReactiveFallback><Ready/><Go/></ReactiveFallback></Inverter></Inverter>",
     "'Main' can return FAILURE", "<Sequence><Ready/><Go/></Sequence>"),
    ("several-running", "<ReactiveSequence><Go/><Delay delay_msec='5'><Blink/></Delay></ReactiveSequence>",
     "can be RUNNING", "<ReactiveSequence><Go/><Gone/></ReactiveSequence>"),
    ("undeclared-node", "<Sequence><Gone/><Gone/></Sequence>", "no file declares 'Gone'", "<Sequence><Go/></Sequence>"),
    ("refused-name", "<Go/></BehaviorTree><BehaviorTree ID='A B'><Go/>", "refuse the name 'A B'",
     "<Go name='a.b/c d'/></BehaviorTree><BehaviorTree ID='A-B'><Go/>"),
    ("unused-tree", "<Go/></BehaviorTree><BehaviorTree ID='Spare'><Go/>",
     "tree 'Spare' is no part of the main tree 'Main'",
     "<SubTree ID='Spare'/></BehaviorTree><BehaviorTree ID='Spare'><Go/>"),
    ("unused-port", "<Sequence><Walk/><Walk/></Sequence>",
     "port 'speed' of 'Walk' is left at its default by its 2 uses",
     "<Sequence><Walk speed='5'/><Walk/></Sequence>"),
]  # fmt: skip


def write(tmp_path: Path, nodes: str, model: str = MODEL) -> Path:
    file = tmp_path / "main.xml"
    file.write_text(TREE.format(nodes=nodes, model=model))
    return file


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["check", *map(str, arguments)])


@pytest.mark.parametrize(("rule", "bad", "text", "good"), CASES, ids=[f"{case[0]}-{i}" for i, case in enumerate(CASES)])
def test_a_rule_fires_where_it_should_and_nowhere_else(
    tmp_path: Path, rule: str, bad: str, text: str, good: str
) -> None:
    rules = [all_rules()[rule]]
    messages = [f"{finding.message} {finding.help_text}" for finding in check(write(tmp_path, bad), rules).findings]
    assert len(messages) == 1
    assert text in messages[0]
    assert check(write(tmp_path, good), rules).findings == []


def test_every_rule_has_a_case() -> None:
    bus = {rule.id for rule in all_rules().values() if rule.run.__module__ == "canopy.check.rules.bus"}
    assert {case[0] for case in CASES} | {"condition-writes"} | bus == set(all_rules())  # bus: test_check_bus.py


def test_a_tree_of_every_construct_with_the_compilers_options_about_types() -> None:
    language = REPOSITORY / "tests" / "unit" / "language"
    arguments = [language / "main.xml", "--dbc", language / "language.dbc", "--node", "Controller"]
    without = run(*arguments)
    assert without.exit_code == 2
    assert "name its header with --include" in without.output
    assert run(language / "main.xml", "--include", "state.h").exit_code == 0
    result = run(*arguments, "--include", "state.h")
    assert result.exit_code == 0
    assert result.output.endswith("1 note\n")


def test_trees_that_are_not_used_are_checked_too(tmp_path: Path) -> None:
    spare = (
        "<Go/></BehaviorTree>\n<BehaviorTree ID='Inner'><ForceSuccess><KeepPower/></ForceSuccess></BehaviorTree>"
        "\n<BehaviorTree ID='Spare'><Sequence><SubTree ID='Inner'/><Walk/></Sequence></BehaviorTree>"
        "\n<BehaviorTree ID='Draft'><Gp/>"
    )
    result = run(write(tmp_path, spare), "--disable", "root-can-fail", "-q")
    hidden = "<ForceSuccess> hides that <KeepPower> can fail: <KeepPower>, which keeps 'Battery.Level' safe, has failed"
    assert [line.split(":", 1)[1] for line in result.output.splitlines()[:-1]] == [
        "4:1: note: tree 'Inner' is no part of the main tree 'Main' [unused-tree]",
        f"4:26: warning: {hidden} [hidden-failure]",
        "5:1: note: tree 'Spare' is no part of the main tree 'Main' [unused-tree]",
        "6:1: note: tree 'Draft' is no part of the main tree 'Main' [unused-tree]",
        "6:26: note: no file declares 'Gp' [undeclared-node]",
    ]
    assert run(write(tmp_path, spare), "--disable", "unused-tree", "-q").output.count("hidden-failure") == 0


def test_floating_point_and_types_of_the_users_own(tmp_path: Path) -> None:
    file = write(tmp_path, "<Script code='x := 0.5'/>")
    assert run(file).exit_code == 0, "without a bus, scripts are not compiled"
    bus = ["--dbc", NAO / "nao.dbc", "--node", "Controller"]
    assert run(file, *bus).exit_code == 2
    assert run(file, *bus, "--allow-floating-point").exit_code == 0
    typed = file.read_text().replace(
        '<Action ID="Go"/>', "<Action ID=\"Go\"><input_port name='p' type='ns::P'/></Action>"
    )
    file.write_text(typed.replace("<Script code='x := 0.5'/>", "<Go p='HOME'/>"))
    assert run(file).exit_code == 2
    assert run(file, "--type-map", "ns::P=p_t", "--include", "p.h").exit_code == 0
    wrong = run(file, "--type-map", "ns::P")
    assert wrong.exit_code == 2
    assert "is not CXX=C" in wrong.output


@pytest.mark.parametrize(
    "inside",
    ["<MetadataFields><Metadata writes='PowerCommand'/></MetadataFields>", "<output_port name='x' type='int'/>"],
)
def test_a_condition_that_writes_is_found_although_the_compiler_refuses_it(tmp_path: Path, inside: str) -> None:
    file = write(tmp_path, "<Ready/>", f"<Condition ID='Ready'>{inside}</Condition>")
    result = run(file)
    assert result.exit_code == 1
    assert f"{file}:6:" in result.output
    assert "error: condition 'Ready' " in result.output
    assert "[condition-writes]" in result.output
    assert run(file, "--disable", "condition-writes").exit_code == 0
    assert "condition-writes" not in run(write(tmp_path, "<Ready/>")).output


def test_a_leaf_with_stale_signals_can_return_what_it_declares_for_that(tmp_path: Path) -> None:
    model = "<Action ID='Ready'><MetadataFields><Metadata reads='Battery' returns='RUNNING'/></MetadataFields></Action>"
    tree = "<Fallback><AlwaysFailure/><Ready/></Fallback>"
    found = check(write(tmp_path, tree, model), all_rules().values()).findings
    assert [finding.rule.id for finding in found] == ["root-can-fail"]
    model = model.replace("returns", "stale='SUCCESS' returns")
    assert check(write(tmp_path, tree, model), all_rules().values()).findings == []


def test_exit_statuses(tmp_path: Path) -> None:
    assert run(write(tmp_path, "<Stop/>")).output == "nothing found\n"
    warning = "<Fallback><Stop/><Go/></Fallback>"
    assert run(write(tmp_path, warning)).exit_code == 0
    assert run(write(tmp_path, warning), "--strict").exit_code == 1
    assert run(write(tmp_path, "<Gone/>"), "--strict").exit_code == 0  # a note
    assert run(write(tmp_path, "<Parallel><Drive/><Drive/></Parallel>")).exit_code == 1
    assert run(write(tmp_path, "<Timeout><Go/></Timeout>")).exit_code == 2
    assert run(tmp_path / "none.xml").exit_code == 2


def test_an_unreadable_file_does_not_hide_the_others(tmp_path: Path) -> None:
    result = run(tmp_path / "none.xml", write(tmp_path, "<Parallel><Drive/><Drive/></Parallel>"))
    assert result.exit_code == 2
    assert "none.xml: error: cannot be read" in result.stderr
    assert "[parallel-write]" in result.stdout


def test_severity_and_disable_leave_rules_out(tmp_path: Path) -> None:
    file = write(tmp_path, "<ForceSuccess><Parallel><Drive/><Charge/><KeepPower/></Parallel></ForceSuccess>")
    assert run(file, "-q").output.splitlines()[-1] == "1 error, 1 warning"
    assert run(file, "-q", "--severity", "error").output.splitlines()[-1] == "1 error"
    assert run(file, "-q", "--disable", "parallel-write").output.splitlines()[-1] == "1 warning"
    result = run(file, "--disable", "parallel-writ")
    assert result.exit_code == 2
    assert "did you mean 'parallel-write'?" in result.stderr


def test_names_of_signals_are_checked_against_the_bus(tmp_path: Path) -> None:
    bus = ("--dbc", NAO / "nao.dbc", "--node", "Controller")
    assert run(write(tmp_path, "<Drive/>"), *bus).exit_code == 0
    result = run(write(tmp_path, "<Drive/>", MODEL.replace('"PowerCommand"', '"PowerComand"')), *bus)
    assert result.exit_code == 2
    assert "did you mean 'PowerCommand'?" in result.stderr
    assert run(write(tmp_path, "<Drive/>"), "--node", "Controller").exit_code == 2


def test_a_node_can_allow_a_rule(tmp_path: Path) -> None:
    allow = '_description="Only polite. canopy:allow hidden-failure, unused-port: nobody waits for it"'
    result = run(write(tmp_path, f"<ForceSuccess {allow}><KeepPower/></ForceSuccess>"))
    assert result.output == "nothing found (1 allowed)\n"
    result = run(write(tmp_path, "<ForceSuccess _description='canopy:allow hiden-failure'><Go/></ForceSuccess>"))
    assert result.exit_code == 2
    assert "canopy:allow: no rule 'hiden-failure'" in result.stderr


@pytest.mark.parametrize(
    ("metadata", "text"),
    [
        ("returns='SUCESS'", "does not return 'SUCESS'"),
        ("kind='SyncAction' returns='RUNNING'", "a SyncAction does not return 'RUNNING'"),
    ],
)
def test_a_wrong_declaration_is_an_error(tmp_path: Path, metadata: str, text: str) -> None:
    file = write(tmp_path, "<Go/>", f"<Action ID='Go'><MetadataFields><Metadata {metadata}/></MetadataFields></Action>")
    with pytest.raises(CompileError, match=text):
        check(file, all_rules().values())


def test_json(tmp_path: Path) -> None:
    file = write(tmp_path, '<Fallback name="Do it"><Stop/><Go name="Late"/></Fallback>')
    result = json.loads(run(file, "--json").output)
    help_text = result["findings"][0].pop("help")
    assert help_text.startswith("Remove it")
    assert result == {
        "format": 1,
        "findings": [
            {
                "rule": "unreachable-child",
                "severity": "warning",
                "file": str(file),
                "line": 3,
                "column": 35,
                "node": "Late",
                "message": "<Go> 'Late' can never be ticked: <Stop> before it (line 3) only returns RUNNING or SUCCESS",
            }
        ],
        "counts": {"error": 0, "warning": 1, "note": 0},
        "allowed": 0,
    }


def test_sarif_has_the_structure_of_2_1_0(tmp_path: Path) -> None:
    file = write(tmp_path, "<Parallel><Drive/><Charge name='Ω'/><ForceSuccess><KeepPower/></ForceSuccess></Parallel>")
    log = json.loads(run(file, "--sarif").output)
    assert set(log) == {"$schema", "version", "runs"}
    assert log["version"] == "2.1.0"
    assert log["$schema"].endswith("sarif-schema-2.1.0.json")
    (sarif_run,) = log["runs"]
    assert set(sarif_run) == {"tool", "columnKind", "results"}
    assert sarif_run["columnKind"] in ("utf16CodeUnits", "unicodeCodePoints")
    driver = sarif_run["tool"]["driver"]
    assert {"name", "version", "rules"} == set(driver)
    levels = {"none", "note", "warning", "error"}
    for rule in driver["rules"]:
        assert set(rule) == {"id", "shortDescription", "fullDescription", "help", "defaultConfiguration"}
        assert all(rule[part]["text"] for part in ("shortDescription", "fullDescription", "help"))
        assert rule["defaultConfiguration"]["level"] in levels
    ids = [rule["id"] for rule in driver["rules"]]
    assert ids == list(all_rules())
    assert len(sarif_run["results"]) == 2
    for result in sarif_run["results"]:
        assert set(result) == {"ruleId", "ruleIndex", "level", "message", "locations"}
        assert ids[result["ruleIndex"]] == result["ruleId"]
        assert result["level"] in levels
        assert result["message"]["text"]
        (location,) = result["locations"]
        physical = location["physicalLocation"]
        assert "\\" not in physical["artifactLocation"]["uri"]
        assert physical["region"]["startLine"] == 3
        assert physical["region"]["startColumn"] >= 1
    assert run(file, "--sarif", "--json").exit_code == 2


def test_the_documentation_has_the_table_of_rules() -> None:
    assert table() in (REPOSITORY / "docs" / "lint.md").read_text(encoding="utf-8")
    assert run("--rules").output == table()


def test_every_rule_says_what_why_and_how_out() -> None:
    for rule in all_rules().values():
        assert rule.severity in Severity
        assert all(text and "|" not in text for text in (rule.title, rule.why, rule.way_out))


@pytest.mark.timeout(30)
def test_a_deep_tree_is_checked_in_time(tmp_path: Path) -> None:
    depth = 3_000
    file = write(tmp_path, "<Sequence><Ready/>" * depth + "<Go/>" + "</Sequence>" * depth)
    assert run(file, "-q").exit_code == 0


@pytest.mark.timeout(30)
def test_a_wide_tree_is_checked_in_time(tmp_path: Path) -> None:
    siblings = "<Fallback><Ready/><Walk speed='1'/></Fallback>" * 10_000
    assert run(write(tmp_path, f"<Sequence>{siblings}</Sequence>"), "-q").exit_code == 0
