# SPDX-License-Identifier: MIT
"""`canopy convert`: what comes out is equal to what went in, in the model, in the engine, and where it is compiled."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from ctypes import CDLL
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from sklearn.tree import DecisionTreeClassifier, DecisionTreeRegressor

from canopy.cli import main
from canopy.compiler.errors import CompileError
from canopy.compiler.tree import Node, Script
from canopy.compiler.tree_reader import read_tree
from canopy.convert.decision_tree import Decide, Threshold, read_decision_tree, rounded
from canopy.convert.json_input import read_json
from canopy.convert.machine import AskingWorld, RunnableTree, SignalInput, ask_each
from canopy.convert.read_back import read_result
from canopy.convert.scripts import program
from canopy.convert.sklearn_export import export
from canopy.convert.subsumption import table
from canopy.semantics.spec import Spec
from integration.engine import FAILURE, NAMES, RUNNING, SUCCESS, Engine, build

REPOSITORY = Path(__file__).parents[2]
PAPERS = REPOSITORY / "examples" / "papers"
BUS = ["--dbc", str(PAPERS / "papers.dbc"), "--node", "Controller"]

FIG19 = {
    "if": "HaveTask",
    "then": {
        "if": "Urgent",
        "then": {
            "if": {"signal": "Battery.Level", "above": 10},
            "then": {"do": "PerformTask"},
            "else": {"do": "Recharge"},
        },
        "else": {
            "if": {"signal": "Battery.Level", "above": 30},
            "then": {"do": "PerformTask"},
            "else": {"do": "Recharge"},
        },
    },
    "else": {"do": "Recharge"},
}


def convert(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["convert", *map(str, arguments)])


def good(*arguments: str | Path) -> str:
    """The output of a conversion that succeeds, found equal."""
    result = convert(*arguments)
    assert result.exit_code == 0, result.output
    assert "equal to the source: " in result.stderr
    return result.stdout


def bad(*arguments: str | Path) -> str:
    """The message of a conversion that is refused."""
    result = convert(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    return result.stderr


def cases(text: str) -> int:
    return int(text.partition("equal to the source: ")[2].partition(" cases")[0])


def written(folder: Path, content: object, name: str = "in.json") -> Path:
    path = folder / name
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def levels() -> list[list[float]]:
    return [[float(Fraction(raw, 10))] for raw in range(1001)]


def takes(tree: Path, library: CDLL, conditions: Callable[[str], bool], raw: int = 0) -> str:
    """The action that the compiled engine takes."""
    read = read_result(tree)
    inputs = {"Battery.Level": SignalInput(Fraction(1, 10), Fraction(0), (raw,))}
    world = AskingWorld(RunnableTree(Spec("AlwaysSuccess", []), {}, signals=inputs), ask_each)

    def answer(index: int) -> int:
        node = engine.nodes[index]
        if node.type.name == "Condition":
            return SUCCESS if conditions(node.name) else FAILURE
        return RUNNING

    engine = Engine(library, read, answer, lambda script: int(program(script, {})(world)))
    assert engine.tick() == RUNNING
    return engine.called()[-1]


# -- decision trees


def test_fig_19_becomes_fig_21(tmp_path: Path) -> None:
    source = written(tmp_path, {"tree": FIG19})
    output = tmp_path / "fig21.xml"
    good("decision-tree", source, *BUS, "-o", output)
    ours, theirs = read_tree(output).root, read_tree(PAPERS / "trees" / "fig21.xml").root
    waiting = [(ours, theirs)]
    while waiting:
        one, other = waiting.pop()
        assert len(one.children) == len(other.children)
        if one.script is None:
            assert (one.type.name, one.leaf and one.leaf.id) == (other.type.name, other.leaf and other.leaf.id)
        else:
            assert other.leaf is not None
            assert f"BatteryAbove{one.script.text.partition('> ')[2]}" == other.leaf.id
        waiting += zip(one.children, other.children, strict=True)


@pytest.mark.parametrize("shape", ["fallback", "while"])
def test_a_decision_tree_in_the_engine(tmp_path: Path, shape: str) -> None:
    output = tmp_path / "tree.xml"
    good("decision-tree", written(tmp_path, {"tree": FIG19}), *BUS, "--shape", shape, "-o", output)
    library = build(tmp_path)
    for raw in (0, 99, 100, 101, 299, 300, 301, 1000):
        for task in (False, True):
            for urgent in (False, True):
                says = {"HaveTask": task, "Urgent": urgent}
                expected = "PerformTask" if task and raw > (100 if urgent else 300) else "Recharge"
                assert takes(output, library, says.__getitem__, raw) == expected, (raw, says)


def test_a_trained_tree_is_its_scikit_learn_estimator_at_every_raw_value(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    for depth in (1, 3, 8):
        values = levels()
        wanted = [int(np.sin(value / 20 * depth) > rng.normal(0, 0.2)) for (value,) in values]
        estimator = DecisionTreeClassifier(max_depth=depth, random_state=0).fit(values, wanted)
        exported, output = tmp_path / "trained.json", tmp_path / "trained.xml"
        export(estimator, exported, ["Battery.Level"], {0: "Recharge", 1: "PerformTask"})
        good("decision-tree", exported, *BUS, "--limit", "5000", "-o", output)
        predicted = ["PerformTask" if p else "Recharge" for p in estimator.predict(values)]
        assert [decided(read_result(output).root, Fraction(raw, 10)) for raw in range(1001)] == predicted


def decided(node: Node, level: Fraction) -> str:
    """What a tree of Lemma 7 over one signal decides, by hand: Fallback(Sequence(condition, yes), no)."""
    while node.children:
        guarded, no = node.children
        condition, yes = guarded.children
        assert isinstance(condition.script, Script)
        signal, sign, bound = condition.script.text.split(" ")
        assert (signal, sign) == ("Battery.Level", "<=")
        node = yes if level <= Fraction(bound) else no
    return node.name


def test_thresholds_between_two_floats_are_rounded_as_scikit_learn_does(tmp_path: Path) -> None:
    """A threshold just below 20.1 as a double, and above it as float32 has it, or the other way round."""
    nearest = float(np.float32(20.1))  # 20.100000381…, above 20.1
    assert nearest > 20.1
    between = (20.1 + nearest) / 2
    for comparison, limit, bound in (
        ("exact", between, "20.1"),
        ("float32", between, "20"),
        ("float32", nearest, "20.1"),
        ("float32", float(np.nextafter(nearest, 0)), "20"),
    ):
        tree = {"if": {"signal": "Battery.Level", "at_most": limit}, "then": {"do": "A"}, "else": {"do": "B"}}
        text = good("decision-tree", written(tmp_path, {"comparison": comparison, "tree": tree}), *BUS)
        assert f'code="Battery.Level &lt;= {bound}"' in text
    estimator = DecisionTreeClassifier(random_state=0).fit([[20.0], [20.2]], [0, 1])
    estimator.tree_.threshold[0] = between
    assert list(estimator.predict([[20.0], [20.1]])) == [0, 1]


def test_rounding_is_numpys() -> None:
    rng = random.Random(3)
    for _ in range(20_000):
        value = Fraction(rng.randrange(-(10**9), 10**9), 10 ** rng.randrange(12))
        assert rounded(value) == float(np.float32(float(value)))


def test_thresholds_outside_of_the_range(tmp_path: Path) -> None:
    tree = {
        "if": {"signal": "Battery.Level", "at_most": 100.5},
        "then": {"if": {"signal": "Battery.Level", "above": 200}, "then": {"do": "A"}, "else": {"do": "B"}},
        "else": {"do": "C"},
    }
    result = convert("decision-tree", written(tmp_path, {"tree": tree}), *BUS)
    assert result.exit_code == 0
    assert "Battery.Level <= 100.5 is always true in the signal's range: only whether it is fresh" in result.stderr
    assert "Battery.Level > 200 is never true" in result.stderr
    assert 'code="Battery.fresh"' in result.stdout
    assert "<A/>" not in result.stdout


def test_thresholds_far_away(tmp_path: Path) -> None:
    tree = {"if": {"signal": "Battery.Level", "at_most": 0}, "then": {"do": "A"}, "else": {"do": "B"}}
    text = json.dumps({"tree": tree}).replace('"at_most": 0', '"at_most": 1e400')
    result = convert("decision-tree", written(tmp_path, text), *BUS)
    assert result.exit_code == 0 and "is always true" in result.stderr


def test_a_large_decision_tree_is_not_called_exhaustive(tmp_path: Path) -> None:
    def grow(depth: int, number: int) -> dict[str, object]:
        if depth == 0:
            return {"do": f"Act{number % 7}"}
        return {
            "if": f"P{depth}x{number}",
            "then": grow(depth - 1, 2 * number),
            "else": grow(depth - 1, 2 * number + 1),
        }

    source = written(tmp_path, {"tree": grow(5, 0)})
    result = convert("decision-tree", source, "--limit", "500", "--seed", "7")
    assert result.exit_code == 0
    assert "1000 cases, not exhaustive: " in result.stderr and "(seed 7)" in result.stderr
    assert "exhaustive" in convert("decision-tree", source).stderr


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "in.json:1:2: error: not valid JSON"),
        ("[" * 100_000, "nested too deep"),
        ('{"tree": {"do": "A"}, "tree": {"do": "B"}}', "the key 'tree' is there twice"),
        ('{"tree": {"do": "A"}, "colour": 1}', "the file has an unknown key 'colour'"),
        ('{"tree": {"if": "P", "then": {"do": "A"}}}', "tree lacks 'else'"),
        ('{"tree": {"if": "P", "then": {"do": 3}, "else": {"do": "B"}}}', "tree.then.do must be a text"),
        ('{"tree": {"do": "Sequence"}}', "'Sequence' is the name of a built-in node"),
        ('{"tree": {"do": "no good"}}', "'no good' cannot be the ID of a leaf"),
        ('{"tree": {"if": "A", "then": {"do": "A"}, "else": {"do": "B"}}}', "used as Condition and as StatefulAction"),
        (
            '{"tree": {"if": {"signal": "Battery.Levl", "above": 1}, "then": {"do": "A"}, "else": {"do": "B"}}}',
            "did you mean 'Battery.Level'?",
        ),
        (
            '{"tree": {"if": {"signal": "Battery.Level"}, "then": {"do": "A"}, "else": {"do": "B"}}}',
            "needs either at_most or above",
        ),
        ('{"tree": {"if": {"signal": "Battery.Level", "above": NaN}}}', "NaN is not a number"),
        (
            json.dumps({"tree": FIG19})
            .replace('"above": 30', '"above": 1e400')
            .replace("{", '{"comparison": "float32", ', 1),
            "tree.then.else.if.above is too large for a double",
        ),
        ('{"comparison": "float16", "tree": {"do": "A"}}', "did you mean 'float32'?"),
    ],
)
def test_wrong_decision_trees_are_named(tmp_path: Path, content: str, message: str) -> None:
    assert message in bad("decision-tree", written(tmp_path, content), *BUS)


def test_a_signal_needs_a_bus(tmp_path: Path) -> None:
    assert "to fix: --dbc FILE --node NAME" in bad("decision-tree", written(tmp_path, {"tree": FIG19}))


def test_what_is_no_classifier_is_not_exported(tmp_path: Path) -> None:
    regressor = DecisionTreeRegressor().fit([[0.0], [1.0]], [0.0, 1.0])
    classifier = DecisionTreeClassifier().fit([[0.0], [1.0]], ["a", "b"])
    with pytest.raises(ValueError, match="fitted DecisionTreeClassifier"):
        export(regressor, tmp_path / "x.json", ["Battery.Level"])
    with pytest.raises(ValueError, match="fitted DecisionTreeClassifier"):
        export(DecisionTreeClassifier(), tmp_path / "x.json", ["Battery.Level"])
    with pytest.raises(ValueError, match="1 features, and 2 signals"):
        export(classifier, tmp_path / "x.json", ["Battery.Level", "Battery.Level"])
    with pytest.raises(ValueError, match="no entry for class 'b'"):
        export(classifier, tmp_path / "x.json", ["Battery.Level"], {"a": "A"})


# -- subsumption


def test_table_ii_has_eight_rows_and_says_what_happens_when_all_fail() -> None:
    layers = ("StopIfOverheated", "RechargeIfNeeded", "DoOtherTasks")
    result = convert("subsumption", *layers, "--table")
    assert result.exit_code == 0
    rows = [line.split(" | ") for line in result.stderr.splitlines() if line.count(" | ") == 3]
    assert len(rows) == 8
    assert [row[3] for row in rows[:4]] == ["StopIfOverheated"] * 4
    assert [row[3] for row in rows[4:7]] == ["RechargeIfNeeded"] * 2 + ["DoOtherTasks"]
    assert rows[7] == ["FAILURE"] * 3 + ["nobody: the tree fails, and every output takes its safe value"]
    assert "32 cases in 4 states, exhaustive" in result.stderr  # eight rows, whoever had control before


def test_table_ii_in_the_engine(tmp_path: Path) -> None:
    layers = ("StopIfOverheated", "RechargeIfNeeded", "DoOtherTasks")
    output = tmp_path / "layers.xml"
    good("subsumption", *layers, "-o", output)
    statuses: dict[str, int] = {}
    engine = Engine(build(tmp_path), read_tree(output), lambda index: statuses[engine.nodes[index].name])
    for before in range(8):
        for row, who in table(layers, None):
            for wants in (table(layers, None)[before][0], row):
                statuses = {name: NAMES.index(s) for name, s in zip(layers, wants, strict=True)}
                status = engine.tick()
            running = [
                engine.nodes[i].name for i in range(1, 4) if engine.status(i) == RUNNING and engine._status[i] < 8
            ]
            assert running == ([who] if who in layers else [])
            assert status == (RUNNING if running else FAILURE)


def test_somebody_may_have_control_when_no_layer_wants_it(tmp_path: Path) -> None:
    result = convert("subsumption", "A", "B", "--otherwise", "StandStill", "--table")
    assert "FAILURE | FAILURE | StandStill" in result.stderr and "the tree FAILS" not in result.stderr
    assert '<Metadata returns="RUNNING"/>' in result.stdout


def test_wrong_layers_are_named() -> None:
    assert "a layer is there twice" in bad("subsumption", "A", "B", "A")
    assert "'A-B' cannot be the ID of a leaf" in bad("subsumption", "A-B")
    assert "128 rows" in bad("subsumption", *"ABCDEFG", "--table")
    assert "more than 60 layers" in bad("subsumption", *(f"L{n}" for n in range(61)))
    assert "'my tree' cannot be the ID of a tree" in bad("subsumption", "A", "--id", "my tree")


def test_numbers_stay_as_they_are_written(tmp_path: Path) -> None:
    path = written(tmp_path, '{"comparison": "exact", "tree": {"if": {"signal": "A.B", "at_most": 0.1}, '
                             '"then": {"do": "A"}, "else": {"do": "B"}}}')  # fmt: skip
    read = read_decision_tree(path)
    assert isinstance(read, Decide) and isinstance(read.predicate, Threshold)
    assert read.predicate.limit == Fraction(1, 10)
    with pytest.raises(CompileError, match="cannot be read"):
        read_json(tmp_path / "missing.json")
