# SPDX-License-Identifier: MIT
"""`canopy fmt --simplify`: Fig. 21 becomes Fig. 22, and nothing that matters is lost, in the model and the engine."""

from __future__ import annotations

import ctypes
import random
import shutil
from collections.abc import Hashable
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.tree import Node
from canopy.compiler.tree_reader import read_tree
from canopy.fmt.application_facts import ClauseRules, Threshold, derived, read_threshold
from integration.engine import FAILURE, RUNNING, SUCCESS, Engine, build

TREES = Path(__file__).parents[2] / "examples" / "papers" / "trees"
FACTS = """\
# what the paper assumes of Fig. 21
BatteryAbove30 implies BatteryAbove10   # of one signal
PerformTask returns RUNNING
Recharge returns RUNNING
PerformTask is memoryless
Recharge is memoryless
"""
MODEL = """\
<Action ID="Go"/><Action ID="Stay"/>
<Action ID="Do"><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>
<Action ID="Endless"><MetadataFields><Metadata returns="RUNNING"/></MetadataFields></Action>
<Condition ID="Ready"/><Condition ID="Warm"/>
<Condition ID="Near"><input_port name="limit" type="int" default="3"/></Condition>
<Condition ID="Counts"><MetadataFields><Metadata state="counter_t"/></MetadataFields></Condition>
"""


def fmt(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["fmt", *map(str, arguments)])


def write(folder: Path, root: str, model: str = MODEL) -> Path:
    path = folder / "tree.xml"
    tree = f'<BehaviorTree ID="Main">{root}</BehaviorTree><TreeNodesModel>{model}</TreeNodesModel>'
    path.write_text(f'<root BTCPP_format="4">{tree}</root>', encoding="utf-8")
    return path


def simplified(folder: Path, root: str, facts: str = "") -> str:
    """The tree after simplifying, in a line."""
    path = write(folder, root)
    known = folder / "app.facts"
    known.write_text(facts, encoding="utf-8")
    result = fmt("--simplify", "--facts", known, path)
    assert result.exit_code == 0, result.output
    text = path.read_text(encoding="utf-8")
    inside = text.partition('<BehaviorTree ID="Main">')[2].partition("</BehaviorTree>")[0]
    return "".join(line.strip() for line in inside.splitlines())


def shape(node: Node) -> object:
    """A tree as nested tuples."""
    return (node.leaf.id if node.leaf else node.type.name, node.name, *(shape(child) for child in node.children))


def test_fig_21_becomes_fig_22(tmp_path: Path) -> None:
    path, facts = tmp_path / "fig21.xml", tmp_path / "robot.facts"
    shutil.copy(TREES / "fig21.xml", path)
    facts.write_text(FACTS, encoding="utf-8")
    assert fmt("--simplify", "--facts", facts, "--check", path).exit_code == 1
    assert path.read_bytes() == (TREES / "fig21.xml").read_bytes()
    result = fmt("--simplify", "--facts", facts, path)
    assert "17 nodes, 10 after 7 proved steps" in result.stderr and "exhaustive" in result.stderr
    assert shape(read_tree(path).root) == shape(read_tree(TREES / "fig22.xml").root)
    assert fmt("--simplify", "--facts", facts, "--check", path).exit_code == 0


@pytest.mark.parametrize("without", range(1, 6))
def test_fig_22_needs_every_fact(tmp_path: Path, without: int) -> None:
    path, facts = tmp_path / "fig21.xml", tmp_path / "robot.facts"
    shutil.copy(TREES / "fig21.xml", path)
    lines = FACTS.splitlines()
    facts.write_text("\n".join(lines[:without] + lines[without + 1 :]), encoding="utf-8")
    assert fmt("--simplify", "--facts", facts, path).exit_code == 0
    assert shape(read_tree(path).root) != shape(read_tree(TREES / "fig22.xml").root)


def test_declared_thresholds_say_what_implies_what(tmp_path: Path) -> None:
    path, facts = tmp_path / "fig21.xml", tmp_path / "robot.facts"
    text = (TREES / "fig21.xml").read_text(encoding="utf-8")
    for limit in ("10", "30"):
        head, found, tail = text.partition(f'<Condition ID="BatteryAbove{limit}">')
        tail = tail.replace('reads="Battery.Level"', f'reads="Battery.Level" holds="Battery.Level &gt; {limit}"', 1)
        text = head + found + tail
    path.write_text(text, encoding="utf-8")
    facts.write_text("\n".join(FACTS.splitlines()[2:]), encoding="utf-8")
    assert fmt("--simplify", "--facts", facts, path).exit_code == 0
    assert shape(read_tree(path).root) == shape(read_tree(TREES / "fig22.xml").root)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("<Sequence><Sequence><Go/><Do/></Sequence><Stay/></Sequence>", "<Sequence><Go/><Do/><Stay/></Sequence>"),
        ("<ReactiveFallback><ReactiveFallback><Go/></ReactiveFallback><Stay/></ReactiveFallback>",
         "<ReactiveFallback><Go/><Stay/></ReactiveFallback>"),
        ("<ReactiveSequence><Ready/><AlwaysSuccess/><Go/></ReactiveSequence>",
         "<ReactiveSequence><Ready/><Go/></ReactiveSequence>"),
        ("<ReactiveSequence><Ready/><Ready/><Go/></ReactiveSequence>",
         "<ReactiveSequence><Ready/><Go/></ReactiveSequence>"),
        ("<Inverter><Inverter><Go/></Inverter></Inverter>", "<Go/>"),
        ("<ForceSuccess><Endless/></ForceSuccess>", "<Endless/>"),
        ("<ReactiveFallback><Endless/><Go/></ReactiveFallback>", "<Endless/>"),
        ("<WhileDoElse><AlwaysSuccess/><Go/><Stay/></WhileDoElse>", "<Go/>"),
        ("<ReactiveFallback><ReactiveSequence><Ready/><Warm/></ReactiveSequence><Warm/></ReactiveFallback>", "<Warm/>"),
        ("<ReactiveFallback><ReactiveSequence><Near/><Do/></ReactiveSequence><Warm/></ReactiveFallback>", None),
        # what has a memory, or another parameter, is not one
        ("<ReactiveSequence><Go/><Go/></ReactiveSequence>", None),
        ("<ReactiveSequence><Do/><Do/></ReactiveSequence>", None),
        ("<ReactiveSequence><Counts/><Counts/><Go/></ReactiveSequence>", None),
        ('<ReactiveSequence><Near limit="1"/><Near limit="2"/><Go/></ReactiveSequence>', None),
        ("<Sequence><Ready/><Go/><Ready/><Stay/></Sequence>", None),
        ("<Sequence><ReactiveSequence><Ready/><Go/></ReactiveSequence><Stay/></Sequence>", None),
        # what somebody has named or remarked on stays
        ('<Sequence><Sequence name="Get there"><Go/><Do/></Sequence><Stay/></Sequence>', None),
        ('<Sequence><Sequence _description="why"><Go/><Do/></Sequence><Stay/></Sequence>', None),
        ('<Sequence><Sequence _uid="3"><Go/><Do/></Sequence><Stay/></Sequence>',
         "<Sequence><Go/><Do/><Stay/></Sequence>"),
        # scripts and SKIPPED are not looked into, but what stands inside is
        ('<Sequence><Sequence _skipIf="x"><Sequence><Go/></Sequence></Sequence><Script code="x := true"/></Sequence>',
         '<Sequence><Sequence _skipIf="x"><Go/></Sequence><Script code="x := true"/></Sequence>'),
        ('<Parallel><Inverter><Inverter><Go/></Inverter></Inverter><Stay/></Parallel>',
         "<Parallel><Go/><Stay/></Parallel>"),
        ("<RunOnce><Sequence><Sequence><Go/></Sequence><AlwaysSuccess/></Sequence></RunOnce>",
         "<RunOnce><Go/></RunOnce>"),
        # the explicit form stays explicit
        ('<Control ID="Sequence"><Control ID="Sequence"><Go/></Control><Action ID="Stay"/></Control>',
         '<Control ID="Sequence"><Go/><Action ID="Stay"/></Control>'),
    ],
)  # fmt: skip
def test_what_is_simplified_and_what_is_not(tmp_path: Path, before: str, after: str | None) -> None:
    assert simplified(tmp_path, before) == (before if after is None else after)


def test_scripts_over_one_signal(tmp_path: Path) -> None:
    above, below = '<ScriptCondition code="B.L &gt; 30"/>', '<ScriptCondition code="B.L &gt;= 10"/>'
    assert simplified(tmp_path, f"<ReactiveSequence>{above}{below}<Go/></ReactiveSequence>") == (
        f"<ReactiveSequence>{above}<Go/></ReactiveSequence>"
    )
    entry = '<ScriptCondition code="n &gt; 30"/>'
    both = f'<ReactiveSequence>{entry}<Script code="n := 3"/>{entry}<Go/></ReactiveSequence>'
    assert simplified(tmp_path, both) == both


def test_facts_of_a_file(tmp_path: Path) -> None:
    tree = "<ReactiveSequence><Ready/><Warm/><Go/></ReactiveSequence>"
    assert simplified(tmp_path, tree, "Ready implies Warm") == "<ReactiveSequence><Ready/><Go/></ReactiveSequence>"
    assert (
        simplified(tmp_path, tree, "not Warm implies not Ready") == "<ReactiveSequence><Ready/><Go/></ReactiveSequence>"
    )
    assert simplified(tmp_path, tree, "Warm implies Near(limit=2)") == tree
    fallback = "<ReactiveFallback><ReactiveSequence><Ready/><Warm/><Go/></ReactiveSequence><Stay/></ReactiveFallback>"
    assert simplified(tmp_path, fallback, "never Ready and Warm") == "<Stay/>"
    assert (
        simplified(tmp_path, "<ReactiveFallback><Go/><Stay/></ReactiveFallback>", "Go returns RUNNING SUCCESS")
        == "<Go/>"
    )


def test_comments_are_kept(tmp_path: Path) -> None:
    tree = "<Sequence><!-- first --><Sequence><Go/><!-- then --></Sequence><Stay/></Sequence>"
    assert simplified(tmp_path, tree) == "<!-- first --> <!-- then --><Sequence><Go/><Stay/></Sequence>"


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ("\n\nReady implise Warm", "app.facts:3: error: not a fact: Ready implise Warm"),
        ("Redy implies Warm", "app.facts:1: error: no leaf 'Redy'\n  help: did you mean 'Ready'?"),
        ("Go implies Warm", "'Go' is not a Condition"),
        ("Go returns WALKING", "'WALKING' is not a status"),
        ("Gone is memoryless", "no leaf 'Gone'"),
        ("Ready implies not Ready\nnot Ready implies Ready", "the facts contradict each other"),
    ],
)
def test_wrong_facts_are_named(tmp_path: Path, facts: str, message: str) -> None:
    path = write(tmp_path, "<Go/>")
    (tmp_path / "app.facts").write_text(facts, encoding="utf-8")
    before = path.read_bytes()
    result = fmt("--simplify", "--facts", tmp_path / "app.facts", path)
    assert result.exit_code == 2 and message in result.output
    assert path.read_bytes() == before


def test_facts_against_a_declaration_are_named(tmp_path: Path) -> None:
    metadata = '<MetadataFields><Metadata returns="SUCCESS"/></MetadataFields>'
    model = f'<Action ID="Go"/><Condition ID="Yes">{metadata}</Condition>'
    path = write(tmp_path, "<Sequence><Yes/><Yes/><Go/></Sequence>", model)
    (tmp_path / "app.facts").write_text("Yes implies not Yes", encoding="utf-8")
    result = fmt("--simplify", "--facts", tmp_path / "app.facts", path)
    assert result.exit_code == 2 and "the facts leave no answer for" in result.output


def test_a_part_that_is_too_large_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, f"<Sequence>{'<Go/>' * 300}</Sequence>")
    result = fmt("--simplify", path)
    assert result.exit_code == 2 and "has 301 nodes, too many to be simplified" in result.output


def test_options_that_do_not_go_together(tmp_path: Path) -> None:
    assert "--facts goes with --simplify" in fmt("--facts", tmp_path / "x", tmp_path / "y").output
    assert "--simplify needs files" in fmt("--simplify", "-").output
    assert "cannot be read" in fmt("--simplify", "--facts", tmp_path / "none", write(tmp_path, "<Go/>")).output


def test_a_wrong_holds_is_named(tmp_path: Path) -> None:
    model = (
        '<Condition ID="Full"><MetadataFields><Metadata reads="B.L" holds="C.L &gt; 3"/></MetadataFields></Condition>'
    )
    result = fmt("--simplify", write(tmp_path, "<Full/>", model))
    assert result.exit_code == 2 and "holds='C.L > 3' of 'Full' is not a comparison of a signal" in result.output


def test_what_follows_from_thresholds_is_what_holds_for_every_value() -> None:
    texts = [f"B.L {sign} {limit}" for sign in ("<", "<=", ">", ">=", "==", "!=") for limit in ("-1.5", "2", "2.5")]
    thresholds: dict[Hashable, Threshold] = {
        text: threshold for text in texts if (threshold := read_threshold(text)) is not None
    }
    assert len(thresholds) == len(texts)
    rules = ClauseRules(derived(thresholds))
    values = [Fraction(value, 4) for value in range(-12, 16)]
    for one, first in thresholds.items():
        for other, second in thresholds.items():
            possible = {(first.holds(v), second.holds(v)) for v in values} | {(False, False)}
            for pair in ((True, True), (True, False), (False, True), (False, False)):
                given = {one: SUCCESS if pair[0] else FAILURE}
                if one != other:
                    assert rules.allows(given, other, SUCCESS if pair[1] else FAILURE) == (pair in possible)


CONTROLS = ["Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback"]


def random_tree(rng: random.Random, repeat: bool = False) -> tuple[str, str]:
    """A tree in which each action stands once (with `repeat`, often), and conditions often; and its model."""
    actions = [f"A{number}" for number in range(6)]
    left = list(actions)
    size = rng.randint(4, 16)

    def make(depth: int) -> str:
        nonlocal size
        size -= 1
        if depth == 0 or size <= 0 or rng.random() < 0.25:
            choice = rng.random()
            if choice < 0.5 and left:
                return f"<{rng.choice(left[:3]) if repeat else left.pop(0)}/>"
            return rng.choice(["<P/>", "<Q/>", "<AlwaysSuccess/>", "<AlwaysFailure/>", "<P/>", "<Q/>"])
        kind = rng.choice([*CONTROLS, *CONTROLS, "Inverter", "ForceSuccess", "ForceFailure", "WhileDoElse"])
        if kind == "WhileDoElse":
            return f"<{kind}><P/>{make(depth - 1)}{make(depth - 1)}</{kind}>"
        count = rng.randint(1, 4) if kind in CONTROLS else 1
        return f"<{kind}>{''.join(make(depth - 1) for _ in range(count))}</{kind}>"

    model = '<Condition ID="P"/><Condition ID="Q"/>'
    for action in actions:
        returns = rng.choice(["RUNNING", "RUNNING SUCCESS", "RUNNING SUCCESS FAILURE", "RUNNING FAILURE"])
        model += f'<Action ID="{action}"><MetadataFields><Metadata returns="{returns}"/></MetadataFields></Action>'
    return make(4), model


class Run:
    """A tree in the engine, whose leaves answer by name."""

    def __init__(self, library: ctypes.CDLL, path: Path) -> None:
        self.answers: dict[str, int] = {}
        self.engine = Engine(library, read_tree(path), lambda index: self.answers[self.engine.nodes[index].name])

    def tick(self, answers: dict[str, int]) -> tuple[int, list[tuple[str, str]]]:
        self.answers = answers
        status = self.engine.tick()
        names = [(self.engine.nodes[index].name, what) for index, what in self.engine.calls]
        return status, [call for call in names if call[0] not in ("P", "Q")]


def test_random_trees_do_the_same_in_the_engine(tmp_path: Path) -> None:
    rng = random.Random(4)
    library = build(tmp_path)
    words = {"RUNNING": RUNNING, "SUCCESS": SUCCESS, "FAILURE": FAILURE}
    smaller = 0
    for _ in range(150):
        root, model = random_tree(rng)
        before, after = write(tmp_path, root, model), tmp_path / "after.xml"
        shutil.copy(before, after)
        assert fmt("--simplify", after).exit_code == 0
        one, other = Run(library, before), Run(library, after)
        assert len(other.engine.nodes) <= len(one.engine.nodes)
        smaller += len(other.engine.nodes) < len(one.engine.nodes)
        leaves = read_tree(before).leaves.values()
        for _ in range(200):
            answers = {leaf.id: words[rng.choice(leaf.returns or ("SUCCESS", "FAILURE"))] for leaf in leaves}
            assert one.tick(answers) == other.tick(answers), (before.read_text(), after.read_text())
    assert smaller > 80


def test_random_trees_with_facts_do_the_same_in_the_engine(tmp_path: Path) -> None:
    """Actions without memory stand several times; P implies Q. Seen are the status, and which actions are ticked."""
    rng = random.Random(8)
    library = build(tmp_path)
    words = {"RUNNING": RUNNING, "SUCCESS": SUCCESS, "FAILURE": FAILURE}
    facts = tmp_path / "app.facts"
    facts.write_text("\n".join(["P implies Q", *(f"A{n} is memoryless" for n in range(6))]), encoding="utf-8")
    merged = 0
    for _ in range(150):
        root, model = random_tree(rng, repeat=True)
        before, after = write(tmp_path, root, model), tmp_path / "after.xml"
        shutil.copy(before, after)
        assert fmt("--simplify", "--facts", facts, after).exit_code == 0
        one, other = Run(library, before), Run(library, after)
        merged += len(other.engine.nodes) < len(one.engine.nodes) - 3
        leaves = read_tree(before).leaves.values()
        for _ in range(200):
            answers = {leaf.id: words[rng.choice(leaf.returns or ("SUCCESS", "FAILURE"))] for leaf in leaves}
            if answers["P"] == SUCCESS:
                answers["Q"] = SUCCESS
            seen = []
            for run in (one, other):
                status, calls = run.tick(answers)
                seen.append((status, [name for name, what in calls if what != "halt"]))
            assert seen[0] == seen[1], (before.read_text(), after.read_text())
    assert merged > 40
