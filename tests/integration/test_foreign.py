# SPDX-License-Identifier: MIT
"""What other tools keep in tree files is left alone and noted once; a misspelt name of ours is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.tree.built_in import built_in_models, built_in_xml
from canopy.tree.foreign import misspelt

NAO = Path(__file__).parents[2] / "examples" / "nao"


def compiled(tmp_path: Path, text: str, *more: str) -> Result:
    """Runs `canopy compile` on this text."""
    file = tmp_path / "main.xml"
    file.write_text(text, encoding="utf-8")
    arguments = ["compile", str(file), "--dbc", str(NAO / "nao.dbc"), "--node", "Controller", "--period-ms", "50"]
    return CliRunner().invoke(main, [*arguments, "-o", str(tmp_path / "out"), *more])


def tree(nodes: str, model: str = "", attributes: str = "") -> str:
    """A file with one tree."""
    models = f"<TreeNodesModel>{model}</TreeNodesModel>" if model else ""
    return f'<root BTCPP_format="4"><BehaviorTree ID="M"{attributes}>{nodes}</BehaviorTree>{models}</root>'


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (tree("<AlwaysSuccess/>", attributes=' group="arm" _favorite="true"'), ["group", "_favorite"]),
        (tree('<AlwaysSuccess _collapsed="true"/>'), ["_collapsed"]),
        (
            tree('<Sequence><A _onTick="x"/><A _onTick="y"/></Sequence>', '<Action ID="A"/>'),
            ["_onTick (2 times, first"],
        ),
        (tree("<A/>", '<Action ID="A" colour="red"/>'), ["colour"]),
        (tree("<A/>", '<Action ID="A"><MetadataFields><Metadata foo="1"/></MetadataFields></Action>'), ["foo"]),
        (tree("<A/>", '<Action ID="A"><MetadataFields><Icon path="a.svg"/></MetadataFields></Action>'), ["Icon"]),
        (tree("<A/>", '<Action ID="A"/><MetadataFields><Metadata x="1"/></MetadataFields>'), ["MetadataFields"]),
        (tree('<A p="1"/>', '<Action ID="A"><input_port name="p" type="int" unit="m"/></Action>'), ["unit"]),
        (tree('<Script code="a := 1" _breakpoint="1"/>'), ["_breakpoint"]),
        (
            tree('<AlwaysSuccess/></BehaviorTree><BehaviorTree ID="N"><SubTree ID="M" _collapsed="1"/>').replace(
                "<root ", '<root main_tree_to_execute="N" '
            ),
            ["_collapsed"],
        ),
    ],
)
def test_what_is_not_ours_is_left_alone_and_noted_once(tmp_path: Path, text: str, names: list[str]) -> None:
    result = compiled(tmp_path, text)
    assert result.exit_code == 0, result.output
    (note,) = [line for line in result.stderr.splitlines() if line.startswith("note: left alone")]
    for name in names:
        assert name in note


@pytest.mark.parametrize(
    ("text", "wrong", "meant"),
    [
        (tree('<AlwaysSuccess _whlie="true"/>'), "_whlie", "_while"),
        (tree('<AlwaysSuccess _skip="true"/>'), "_skip", "_skipIf"),
        (tree('<AlwaysSuccess _onsuccess="a := 1"/>'), "_onsuccess", "_onSuccess"),
        (
            tree("<A/>", '<Action ID="A"><MetadataFields><Metadata read="Battery"/></MetadataFields></Action>'),
            "read",
            "reads",
        ),
        (tree("<A/>", '<Action ID="A" edittable="1"/>'), "edittable", "editable"),
        (
            tree('<AlwaysSuccess/></BehaviorTree><BehaviorTree ID="N"><SubTree ID="M" _autormap="1"/>').replace(
                "<root ", '<root main_tree_to_execute="N" '
            ),
            "_autormap",
            "_autoremap",
        ),
    ],
)
def test_a_misspelt_name_of_ours_is_an_error_unless_it_is_said_to_be_foreign(
    tmp_path: Path, text: str, wrong: str, meant: str
) -> None:
    result = compiled(tmp_path, text)
    assert result.exit_code == 2, result.output
    assert f"'{wrong}'" in result.stderr and f"did you mean '{meant}'?" in result.stderr
    assert f"--foreign {wrong}" in result.stderr
    meant_so = compiled(tmp_path, text, "--foreign", wrong)
    assert meant_so.exit_code == 0, meant_so.output
    assert wrong in meant_so.stderr


def test_metadata_in_the_wrong_place_is_an_error(tmp_path: Path) -> None:
    result = compiled(tmp_path, tree("<A/>", '<Action ID="A" kind="SyncAction"/>'))
    assert result.exit_code == 2
    assert "<Metadata kind=" in result.stderr


def test_an_attribute_that_a_built_in_node_does_not_have_stays_an_error(tmp_path: Path) -> None:
    result = compiled(tmp_path, tree('<Timeout msec="5" colour="red"><AlwaysSuccess/></Timeout>'))
    assert result.exit_code == 2
    assert "<Timeout> has no attribute 'colour'" in result.stderr


def test_the_distance_counts_letters() -> None:
    assert misspelt("_while", ["_while"]) == "_while"
    assert misspelt("_wihle", ["_while"]) == "_while"
    assert misspelt("_whilee", ["_while"]) == "_while"
    assert misspelt("foo", ["kind", "ID"]) is None
    assert misspelt("x", ["ID"]) is None
    assert misspelt("w" * 100_000, ["_while"]) is None


# The names that only Canopy has


PARALLEL = '<ReactiveParallel success_count="1"{}><A/><A/></ReactiveParallel>'
CONTROL = '<Control ID="ReactiveParallel">{}</Control>'
PORT = '<input_port name="{}" type="int"/>'


@pytest.mark.parametrize(
    ("nodes", "model", "function"),
    [
        (
            PARALLEL.format(' failure_count="1"'),
            CONTROL.format(PORT.format("success_count") + PORT.format("failure_count")),
            "reactive_parallel_enter",
        ),
        (PARALLEL.format(""), CONTROL.format(PORT.format("success_count")).replace("Control", "Decorator"), None),
        ("<TestNode/>", '<Action ID="TestNode"/>', "test_node_on_start"),
    ],
)
def test_the_users_node_wins_over_one_that_only_canopy_has(
    tmp_path: Path, nodes: str, model: str, function: str | None
) -> None:
    result = compiled(tmp_path, tree(nodes, model + '<Action ID="A"/>'))
    if function is None:  # the user's decorator has one child, whatever Canopy's control node has
        assert result.exit_code == 2 and "needs exactly 1 child" in result.stderr
        return
    assert result.exit_code == 0, result.output
    assert function in (tmp_path / "out" / "main_leaves.h").read_text()


@pytest.mark.parametrize("marked", [True, False])
def test_a_declaration_just_like_ours_means_ours(tmp_path: Path, marked: bool) -> None:
    model = '<Control ID="ReactiveParallel"><input_port name="success_count" type="int"/></Control>'
    if marked:
        start = built_in_xml().index('<Control ID="ReactiveParallel">')
        model = built_in_xml()[start : built_in_xml().index("</Control>", start)] + "</Control>"
    result = compiled(tmp_path, tree(PARALLEL.format(""), model + '<Action ID="A"/>'))
    assert result.exit_code == 0, result.output
    assert "reactive_parallel" not in (tmp_path / "out" / "main_leaves.h").read_text()


def test_the_built_in_models_compile_as_what_they_are(tmp_path: Path) -> None:
    file = tmp_path / "built_in.xml"
    result = CliRunner().invoke(main, ["model", "--builtin", "-o", str(file)])
    assert result.exit_code == 0, result.output
    text = tree('<Sequence><TestNode return_status="FAILURE"/><Sleep msec="5"/></Sequence>').replace(
        "<BehaviorTree", '<include path="built_in.xml"/><BehaviorTree', 1
    )
    assert compiled(tmp_path, text).exit_code == 0
    assert {"LoopInt", "Switch2", "ReactiveParallel", "Script", "Timeout"} <= set(built_in_models())
