# SPDX-License-Identifier: MIT
"""Nodes and trees that the tree's own file does not have: named all at once, searched for, and guessed."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main

NAO = Path(__file__).parents[2] / "examples" / "nao"
HEAD = '<root BTCPP_format="4">'


def run(folder: Path, files: dict[str, str], *arguments: str) -> Result:
    """Writes the files and compiles the first; arguments may name paths with {}."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    first = str(folder / next(iter(files)))
    bus = ["--dbc", str(NAO / "nao.dbc"), "--node", "Controller", "--period-ms", "50", "--name", "robot"]
    more = [argument.format(folder) for argument in arguments]
    return CliRunner().invoke(main, ["compile", first, *bus, "-o", str(folder / "out"), *more])


def tree(name: str, nodes: str, more: str = "") -> str:
    """A file with one tree."""
    return f'{HEAD}<BehaviorTree ID="{name}">{nodes}</BehaviorTree>{more}</root>'


def models(text: str) -> str:
    """A <TreeNodesModel>."""
    return f"<TreeNodesModel>{text}</TreeNodesModel>"


# Several errors


def test_all_nodes_that_nobody_declared_are_named_at_once_with_the_way_out(tmp_path: Path) -> None:
    result = run(tmp_path, {"m.xml": tree("M", "<Sequence><Grip/><Lift/><Grip/><Turn/></Sequence>")})
    assert result.exit_code == 2
    assert "3 nodes that no file declares: 'Grip' (line 1, 2 times), 'Lift' (line 1), 'Turn' (line 1)" in result.stderr
    assert f"canopy model {tmp_path / 'm.xml'} -o nodes.xml" in result.stderr


def test_errors_of_one_step_are_named_together(tmp_path: Path) -> None:
    nodes = "<Sequence><Timeout msec='x'><A p='300'/></Timeout><Sequense/><SubTree ID='N'/><A q='1'/></Sequence>"
    text = tree("M", nodes, models('<Action ID="A"><input_port name="p" type="uint8_t"/></Action>'))
    result = run(tmp_path, {"m.xml": text})
    assert result.exit_code == 2
    for part in ("msec='x'", "did you mean 'Sequence'?", "names no tree: 'N'", "has no attribute 'q'"):
        assert part in result.stderr, result.stderr
    assert result.stderr.count(": error: ") == 4


def test_errors_of_ports_and_scripts_are_named_together(tmp_path: Path) -> None:
    nodes = "<Sequence><A p='300'/><A p='x'/><Script code='a := 1.5'/><A p='{b}'/></Sequence>"
    text = tree("M", nodes, models('<Action ID="A"><input_port name="p" type="uint8_t"/></Action>'))
    first = run(tmp_path, {"m.xml": text})
    assert "nothing writes entry 'b'" in first.stderr and "would hold fractions" in first.stderr
    second = run(tmp_path, {"m.xml": text.replace("{b}", "7").replace("1.5", "2")})
    assert second.stderr.count(": error: ") == 2, second.stderr


def test_many_errors_are_counted(tmp_path: Path) -> None:
    nodes = "".join(f"<Timeout msec='x{number}'><AlwaysSuccess/></Timeout>" for number in range(30))
    result = run(tmp_path, {"m.xml": tree("M", f"<Sequence>{nodes}</Sequence>")})
    assert result.stderr.count(": error: ") == 20
    assert "and 10 more errors" in result.stderr


@pytest.mark.parametrize(
    ("node", "text"),
    [
        ("SequenceStar", "write <SequenceWithMemory>"),
        ("RetryUntilSuccesful", "write <RetryUntilSuccessful>"),
        ("SubTreePlus", "_autoremap"),
        ("Selector", "write <Fallback>"),
        ("BlackboardCheckInt", "write <Precondition"),
    ],
)
def test_renamed_nodes_of_older_versions_are_known(tmp_path: Path, node: str, text: str) -> None:
    result = run(tmp_path, {"m.xml": tree("M", f"<{node}><AlwaysSuccess/></{node}>")})
    assert result.exit_code == 2
    assert f"unknown node '{node}'" in result.stderr and text in result.stderr
    assert "did you mean" not in result.stderr


def test_the_main_tree_is_asked_for_by_a_list(tmp_path: Path) -> None:
    trees = "".join(f'<BehaviorTree ID="{name}"><SubTree ID="Part"/></BehaviorTree>\n' for name in ("A", "B"))
    text = f'{HEAD}{trees}<BehaviorTree ID="Part"><AlwaysSuccess/></BehaviorTree></root>'
    result = run(tmp_path, {"m.xml": text})
    assert result.exit_code == 2
    assert "--main-tree A (line 1), --main-tree B (line 2); 1 more are parts of these" in result.stderr
    assert run(tmp_path, {"m.xml": text}, "--main-tree", "B").exit_code == 0


# --search

OTHER = tree("N", "<Grip force='3'/>", models('<Action ID="Grip"><input_port name="force" type="int"/></Action>'))


@pytest.mark.parametrize("search", ["{}", "{}/lib", "{}/lib/deep/n.xml", "{}/p.btproj"])
def test_trees_and_models_of_other_files_are_found(tmp_path: Path, search: str) -> None:
    files = {
        "m.xml": tree("M", "<SubTree ID='N'/>"),
        "lib/deep/n.xml": OTHER,
        "p.btproj": f'{HEAD}<include path="lib/deep/n.xml"/></root>',
    }
    missing = run(tmp_path, files)
    assert missing.exit_code == 2 and "--search DIR" in missing.stderr
    result = run(tmp_path, files, "--search", search, "--depfile", "{}/d")
    assert result.exit_code == 0, result.output
    assert "n.xml" in (tmp_path / "d").read_text()


def test_a_project_compiles_as_a_tree_file(tmp_path: Path) -> None:
    files = {
        "p.btproj": f'{HEAD[:-1]} main_tree_to_execute="M"><include path="m.xml"/><include path="n.xml"/></root>',
        "m.xml": tree("M", "<SubTree ID='N'/>"),
        "n.xml": OTHER,
    }
    assert run(tmp_path, files).exit_code == 0


def test_a_model_is_found_for_one_node(tmp_path: Path) -> None:
    files = {
        "m.xml": tree("M", "<Grip force='4'/>"),
        "lib/n.xml": OTHER,
        "lib/broken.xml": "<root",
        "lib/old.xml": "<root/>",
    }
    assert run(tmp_path, files, "--search", "{}/lib").exit_code == 0


def test_the_nearest_file_wins_and_two_that_differ_are_named(tmp_path: Path) -> None:
    other = OTHER.replace('type="int"', 'type="uint8_t"')
    files = {"a/m.xml": tree("M", "<SubTree ID='N'/>"), "a/near.xml": OTHER, "b/far.xml": other.replace("'3'", "'300'")}
    assert run(tmp_path, files, "--search", "{}").exit_code == 0
    files = {"a/m.xml": tree("M", "<SubTree ID='N'/>"), "a/near.xml": OTHER, "a/too.xml": OTHER.replace("'3'", "'300'")}
    result = run(tmp_path, files, "--search", "{}")
    assert result.exit_code == 2
    assert "tree 'N' is in two files" in result.stderr
    files = {"c/m.xml": tree("M", "<Grip force='1'/>"), "c/x.xml": OTHER, "c/y.xml": other}
    result = run(tmp_path, files, "--search", "{}/c")
    assert result.exit_code == 2
    assert "node 'Grip' is declared in two files" in result.stderr
    assert "x.xml" in result.stderr and "y.xml" in result.stderr


def test_the_same_said_twice_is_no_conflict(tmp_path: Path) -> None:
    files = {"m.xml": tree("M", "<SubTree ID='N'/>"), "x.xml": OTHER, "y.xml": OTHER}
    assert run(tmp_path, files, "--search", "{}").exit_code == 0


def test_what_is_not_there_cannot_be_searched(tmp_path: Path) -> None:
    result = run(tmp_path, {"m.xml": tree("M", "<AlwaysSuccess/>")}, "--search", "{}/nowhere")
    assert result.exit_code == 2 and "is not there" in result.stderr


# canopy model

WILD = """\
<root BTCPP_format="4" main_tree_to_execute="M">
  <BehaviorTree ID="M"><Sequence>
    <IsReady level="3"/>
    <ComputePath goal="{goal}" path="{path}" planner="Grid" safe="true"/>
    <Rate hz="1.5"><FollowPath path="{path}"/></Rate>
    <Recover n="{n}"><AlwaysSuccess/><Action ID="Wait" msec="{w}"/></Recover>
    <SubTree ID="T" x="{y}" lit="5"/>
    <Script code="w := 7"/>
  </Sequence></BehaviorTree>
  <BehaviorTree ID="T"><Sequence>
    <UseX v="{x}"/><UseLit v="{lit}"/><Look found="{it}"/><Take it="{it}"/>
  </Sequence></BehaviorTree>
</root>
"""


def guessed(tmp_path: Path, *files: str, more: tuple[str, ...] = ()) -> dict[str, ElementTree.Element]:
    """Runs `canopy model`, and gives the models by ID."""
    output = tmp_path / "nodes.xml"
    result = CliRunner().invoke(main, ["model", *(str(tmp_path / file) for file in files), "-o", str(output), *more])
    assert result.exit_code == 0, result.output
    (model,) = ElementTree.parse(output).getroot()
    return {element.attrib["ID"]: element for element in model}


def port(element: ElementTree.Element, name: str) -> tuple[str, str | None]:
    """A port's direction and type."""
    (found,) = [child for child in element if child.attrib["name"] == name]
    assert "CONFIRM" in (found.text or "")
    return found.tag, found.attrib.get("type")


def test_a_model_is_guessed_from_use_and_makes_the_tree_compile(tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_text(WILD, encoding="utf-8")
    found = guessed(tmp_path, "m.xml")
    tags = {name: element.tag for name, element in found.items()}
    assert tags == {
        "ComputePath": "Action",
        "FollowPath": "Action",
        "IsReady": "Condition",
        "Look": "Action",
        "M": "SubTree",
        "Rate": "Decorator",
        "Recover": "Control",
        "Take": "Action",
        "UseLit": "Action",
        "UseX": "Action",
        "Wait": "Action",
    }
    assert port(found["IsReady"], "level") == ("input_port", "int32_t")
    assert port(found["ComputePath"], "path")[0] == "output_port"
    assert port(found["ComputePath"], "goal")[0] == "input_port"
    assert port(found["ComputePath"], "planner") == ("input_port", "std::string")
    assert port(found["ComputePath"], "safe") == ("input_port", "bool")
    assert port(found["FollowPath"], "path")[0] == "input_port"
    assert port(found["Rate"], "hz") == ("input_port", "double")
    assert {child.attrib["name"] for child in found["M"]} == {"goal", "n", "y"}
    result = run(tmp_path, {"m.xml": WILD}, "--search", "{}/nodes.xml", "--allow-floating-point")
    assert result.exit_code == 0, result.output
    assert (
        run(tmp_path, {"m.xml": WILD}, "--search", "{}", "--allow-floating-point").exit_code == 2
    )  # of the program's inputs


def test_one_model_serves_a_folder_of_files(tmp_path: Path) -> None:
    files = {"a.xml": tree("A", "<Grip force='3'/>"), "b.xml": tree("B", "<Grip force='2.5' slow='true'/>")}
    run(tmp_path, files)
    found = guessed(tmp_path, "a.xml", "b.xml")
    assert list(found) == ["Grip"]
    assert port(found["Grip"], "force") == ("input_port", "double")
    for name, text in files.items():
        result = run(tmp_path, {name: text}, "--search", "{}/nodes.xml", "--allow-floating-point")
        assert result.exit_code == 0, result.output


def test_what_is_declared_is_not_guessed_again_and_gives_types(tmp_path: Path) -> None:
    declared = models('<Action ID="Find"><output_port name="pose" type="uint8_t"/></Action>')
    run(tmp_path, {"m.xml": tree("M", "<Sequence><Find pose='{p}'/><Go to='{p}'/></Sequence>", declared)})
    found = guessed(tmp_path, "m.xml")
    assert list(found) == ["Go"]
    assert port(found["Go"], "to") == ("input_port", "uint8_t")


def test_the_guess_is_the_same_each_time(tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_text(WILD, encoding="utf-8")
    texts = set()
    for _ in range(3):
        guessed(tmp_path, "m.xml")
        texts.add((tmp_path / "nodes.xml").read_text())
    assert len(texts) == 1


def test_model_needs_files_or_builtin(tmp_path: Path) -> None:
    assert CliRunner().invoke(main, ["model"]).exit_code == 2
    assert CliRunner().invoke(main, ["model", "--builtin", str(tmp_path)]).exit_code == 2
    result = CliRunner().invoke(main, ["model", str(tmp_path / "none.xml")])
    assert result.exit_code == 2 and "none.xml" in result.stderr
