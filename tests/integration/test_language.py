# SPDX-License-Identifier: MIT
"""The tree language through `canopy compile`: subtrees and includes, entries, scripts, and what is refused by name."""

# ruff: noqa: E501
# In the tables, one line is one case.

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import Result

from canopy.compiler.script.syntax import parse
from integration.language import MODEL, compile_files, tree


def expect(tmp_path: Path, result: Result, place: str, *texts: str) -> None:
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(f"{tmp_path / place}: error: "), result.stderr
    for text in texts:
        assert text in result.stderr
    assert not (tmp_path / "out").exists()


def test_the_model_file_knows_each_nodes_path(tmp_path: Path) -> None:
    more = '<BehaviorTree ID="Dock"><Sequence name="Dock"><AlwaysSuccess/><AlwaysSuccess/></Sequence></BehaviorTree>'
    nodes = '<Sequence><SubTree ID="Dock"/><SubTree ID="Dock"/><SubTree ID="Dock" name="last"/></Sequence>'
    assert compile_files(tmp_path, {"main.xml": tree(nodes, more)}).exit_code == 0
    model = json.loads((tmp_path / "out" / "main.model.json").read_text())
    assert [node["path"] for node in model["tree"]["nodes"]] == [
        "Main/Sequence",
        *(
            f"Main/{name}/{node}"
            for name in ("Dock", "Dock::2", "last")
            for node in ("Dock", "AlwaysSuccess", "AlwaysSuccess::2")
        ),
    ]


def test_a_subtree_costs_no_node_and_its_attributes_one(tmp_path: Path) -> None:
    more = '<BehaviorTree ID="A"><SubTree ID="B" _skipIf="false"/></BehaviorTree><BehaviorTree ID="B"><AlwaysSuccess/></BehaviorTree>'
    assert compile_files(tmp_path, {"main.xml": tree('<SubTree ID="A"/>', more)}).exit_code == 0
    model = json.loads((tmp_path / "out" / "main.model.json").read_text())
    assert [node["type"] for node in model["tree"]["nodes"]] == ["Attributes", "AlwaysSuccess"]


INNER = '<root BTCPP_format="4"><BehaviorTree ID="Inner"><AlwaysSuccess/></BehaviorTree>{}</root>'


def test_each_file_is_included_once_and_named_in_the_model(tmp_path: Path) -> None:
    files = {
        "main.xml": tree('<SubTree ID="Inner"/>').replace(
            "<BehaviorTree", '<include path="a/b.xml"/><include path="a/c.xml"/><BehaviorTree', 1
        ),
        "a/b.xml": '<root BTCPP_format="4"><include path="../a/c.xml"/></root>',
        "a/c.xml": INNER.format(f"<TreeNodesModel>{MODEL}</TreeNodesModel>"),
    }
    result = compile_files(tmp_path, files, "--depfile", str(tmp_path / "main.d"))
    assert result.exit_code == 0, result.output
    model = json.loads((tmp_path / "out" / "main.model.json").read_text())
    assert model["tree"]["nodes"][0]["file"] == "c.xml"
    assert all(name in (tmp_path / "main.d").read_text() for name in ("main.xml", "b.xml", "c.xml", "language.dbc"))


@pytest.mark.parametrize(
    ("files", "place", "texts"),
    [
        ({"a.xml": INNER.format('<include path="main.xml"/>')}, "a.xml:1:", ["in a loop: main.xml -> a.xml -> main.xml"]),
        ({"a.xml": INNER.format('<include path="a.xml"/>')}, "a.xml:1:", ["in a loop"]),
        ({"a.xml": INNER.format('<include ros_pkg="x" path="y"/>')}, "a.xml:1:",
         ["<include ros_pkg='x'>: the folder of this package is not known", "--ros-package x=DIR"]),
        ({"a.xml": INNER.format('<include pat="y"/>')}, "a.xml:1:", ["<include> has no attribute 'pat'", "did you mean 'path'?"]),
        ({"a.xml": INNER.format("<include/>")}, "a.xml:1:", ["needs the attribute path"]),
        ({"a.xml": INNER.format('<BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree>')}, "main.xml:2:", ["not 'Main'", "the other one:"]),
        ({"a.xml": INNER.format('<TreeNodesModel><Action ID="Go"/></TreeNodesModel>')}, "main.xml:6:", ["'Go' is declared again"]),
        ({}, "main.xml:1:", ["a.xml' is not there", "relative to this file"]),
    ],
)  # fmt: skip
def test_wrong_includes_are_named(tmp_path: Path, files: dict[str, str], place: str, texts: list[str]) -> None:
    text = tree("<AlwaysSuccess/>").replace("\n<BehaviorTree", '<include path="a.xml"/>\n<BehaviorTree', 1)
    result = compile_files(tmp_path, {"main.xml": text, **files})
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(str(tmp_path / place)), result.stderr
    for part in texts:
        assert part in result.stderr


def test_trees_of_a_ros_package_are_found_where_its_folder_is(tmp_path: Path) -> None:
    text = tree('<SubTree ID="Inner"/>').replace(
        "<BehaviorTree", '<include ros_pkg="lib" path="a/b.xml"/><BehaviorTree', 1
    )
    (tmp_path / "share").mkdir()
    files = {
        "main.xml": text,
        "share/c.xml": INNER.format(""),
        "share/a/b.xml": '<root BTCPP_format="4"><include path="../c.xml"/></root>',
    }
    result = compile_files(tmp_path, files, "--ros-package", f"lib={tmp_path / 'share'}")
    assert result.exit_code == 0, result.output
    misnamed = compile_files(tmp_path, files, "--ros-package", f"lip={tmp_path / 'share'}")
    assert "did you mean 'lip'?" in misnamed.stderr
    assert "'lib' is not NAME=DIR" in compile_files(tmp_path, files, "--ros-package", "lib").stderr


@pytest.mark.parametrize(
    ("right", "wrong", "place", "texts"),
    [
        ("main_tree_to_execute", "main_tree_to_exec", "1:43", ["<root> has no attribute 'main_tree_to_exec'", "did you mean 'main_tree_to_execute'?"]),
        ("<BehaviorTree ID", "<BehaviorTree Id='x' ID", "2:19", ["<BehaviorTree> has no attribute 'Id'", "did you mean 'ID'?"]),
        ('default="3"', 'defualt="3"', "9:94", ["<input_port> has no attribute 'defualt'", "did you mean 'default'?"]),
        ('<Decorator ID="Guard"', '<Decorator ID="Guard" kind="x"', "17:29", ["<Decorator> has no attribute 'kind'"]),
    ],
)  # fmt: skip
def test_attributes_that_nobody_knows_are_refused(
    tmp_path: Path, right: str, wrong: str, place: str, texts: list[str]
) -> None:
    text = tree("<AlwaysSuccess/>")
    kept = '<root xmlns:x="urn:x" x:y="1" project_name="Mine" ' + text.removeprefix("<root ").replace(
        "<BehaviorTree", "<BehaviorTree _fullpath='a'", 1
    )
    assert compile_files(tmp_path, {"main.xml": kept}).exit_code == 0
    assert right in text
    result = compile_files(tmp_path, {"main.xml": text.replace(right, wrong, 1)})
    assert result.exit_code == 2, result.output
    assert f"main.xml:{place}: error:" in result.stderr, result.stderr
    for part in texts:
        assert part in result.stderr


SUBTREE = '<BehaviorTree ID="Sub">{}</BehaviorTree>'


@pytest.mark.parametrize(
    ("nodes", "more", "place", "texts"),
    [
        ("<SubTree ID='Sup'/>", SUBTREE.format("<AlwaysSuccess/>"), "3:14", ["names no tree: 'Sup'", "did you mean 'Sub'?"]),
        ("<SubTree ID='Sub'/>", SUBTREE.format("<SubTree ID='Main'/>"), "5:24", ["in a cycle: Main -> Sub -> Main"]),
        ("<Sub/>", SUBTREE.format("<AlwaysSuccess/>"), "3:1", ["unknown node 'Sub'", '<SubTree ID="Sub"/>']),
        ("<SubTree ID='Sub'><Go/></SubTree>", SUBTREE.format("<AlwaysSuccess/>"), "3:19", ["cannot have children"]),
        ("<SubTree ID='Sub' _autoremap='maybe'/>", SUBTREE.format("<AlwaysSuccess/>"), "3:31", ["neither true nor false"]),
        ("<SubTree ID='Sub' _autoremp='1'/>", SUBTREE.format("<AlwaysSuccess/>"), "3:30",
         ["has no attribute '_autoremp'", "did you mean '_autoremap'?"]),
        ("<Sequence><Find goal='{x}'/><Go speed='{x}'/></Sequence>", "", "3:40",
         ["port 'speed' of 'Go' is int32_t, but entry 'x' is int16_t", "the other end is port 'goal' of 'Find'", "3:23"]),
        ("<Sequence><Measure level='{x}'/><Fine level='{x}'/></Sequence>", "", "3:46",
         ["port 'level' of 'Fine' is int16_t in steps of 0.01, but entry 'x' is int16_t in steps of 0.1", "the other end is port 'level' of 'Measure'"]),
        ("<Fine level='1.005'/>", "", "3:14", ["port 'level' of 'Fine': 1.005 lies between two steps of 0.01", "write 1 or 1.01"]),
        ("<Fine level='327.68'/>", "", "3:14", ["327.68 is outside int16_t in steps of 0.01 [-327.68, 327.67]"]),
        ("<Fine level='1e9999'/>", "", "3:14", ["'1e9999' is not a number"]),
        ("<Fine level='1/2'/>", "", "3:14", ["'1/2' is not a number"]),
        ("<Fine level='much'/>", "", "3:14", ["'much' is not a number (int16_t in steps of 0.01)"]),
        ("<Tenth level='{Climate.Temperature}'/>", "", "3:15", ["a number in steps of 0.5 would lose precision as int16_t in steps of 0.3"]),
        ("<Sequence><Measure level='{x}'/><Script code='x := 1.25'/></Sequence>", "", "3:52", ["1.25 is no multiple of the step", "int16_t in steps of 0.1 is wanted"]),
        ("<Sequence><Measure level='{x}'/><Script code='x := 4000'/></Sequence>", "", "3:52", ["4000 is outside int16_t in steps of 0.1 [-3276.8, 3276.7]"]),
        ("<Sequence><Measure level='{x}'/><Script code='y := x'/></Sequence>", "", "3:47", ["entry 'y' would hold fractions", "type=\"int32_t*0.01\"/>"]),
        ("<Go speed='{x}'/>", "", "3:12", ["nothing writes entry 'x'", "ports of the main tree"]),
        ("<Find goal='5'/>", "", "3:13", ["'5' is a literal", "give an entry: {name}"]),
        ("<Go speed='{a;b}'/>", "", "3:12", ["'a;b' is not the name of an entry"]),
        ("<Say text='{t}'/>", "", "3:12", ["nothing writes entry 't'"]),
        ("<Sequence><Script code='t := true'/><Say text='{t}'/></Sequence>", "", "3:30", ["the number 1 cannot be stored as a text"]),
        ("<Go speed='{Climate.Temperature}'/>", "", "3:12", ["port 'speed' of 'Go': a number in steps of 0.5 would lose precision"]),
        ("<Go speed='{Climat.Temperature}'/>", "", "3:12", ["does not receive 'Climat'", "did you mean 'Climate'?"]),
        ("<Go speed='{Climate.Temprature}'/>", "", "3:12", ["has no signal 'Temprature'", "did you mean 'Temperature'?"]),
        ("<Go><Go speed='1'/></Go>", "", "3:1", ["needs a value for its port 'speed'"]),
        ("<Pick/>", "", "3:1", ["<Pick> needs at least 1 child"]),
        ("<Guard><AlwaysSuccess/><AlwaysSuccess/></Guard>", "", "3:1", ["<Guard> needs exactly 1 child"]),
        ("<Control ID='Guard'><AlwaysSuccess/></Control>", "", "3:1", ["'Guard' is declared as Decorator"]),
        ("<Action/>", "", "3:1", ["<Action> needs the attribute ID"]),
        ("<ManualSelector><AlwaysSuccess/></ManualSelector>", "", "3:1", ["<ManualSelector> is not supported"]),
        ("<TestNode return_status='RUNNING'/>", "", "3:26", ["would never be done", "<KeepRunningUntilFailure>"]),
        ("<TestNode return_status='IDLE'/>", "", "3:26", ["return_status='IDLE' is no status"]),
        ("<TestNode async_delay='-1'/>", "", "3:24", ["async_delay='-1' is no time in ms"]),
        ("<TestNode script='x := 1'/>", "", "3:19", ["<TestNode> has no attribute 'script'"]),
        ("<TestNode post_script='x := '/>", "", "3:29", ["a value is expected here"]),
        ("<TestNode><AlwaysSuccess/></TestNode>", "", "3:1", ["<TestNode> needs exactly 0 child node(s)"]),
        ("<TryCatch catch_on_halt='true'><AlwaysSuccess/><Sequence><Go speed='1'/></Sequence></TryCatch>", "", "3:48",
         ["the last child of <TryCatch> must be a leaf", "do the clean-up in one leaf"]),
        ("<TryCatch catch_on_halt='{n}'><AlwaysSuccess/><Go speed='1' _skipIf='true'/></TryCatch>", "", "3:47", ["must be a leaf of yours or a Script"]),
        ("<TryCatch catch_on_halt='perhaps'><AlwaysSuccess/><Go speed='1'/></TryCatch>", "", "3:1", ["'perhaps' is not a whole number"]),
        ("<Sequence><Name it='{x}'/><LoopInt queue='{x}' value='{v}'><AlwaysSuccess/></LoopInt></Sequence>", "", "3:43",
         ["entry 'x' is canopy_queue_text_3_t, and a queue of int32_t is needed"]),
        ("<Sequence><Find goal='{q}'/><LoopString queue='{q}' value='{v}'><AlwaysSuccess/></LoopString></Sequence>", "", "3:48",
         ["a queue of texts is needed", "type='std::string[8]'"]),
        ("<Repeat num_cycles='{n}'><AlwaysSuccess/></Repeat>", "", "3:21", ["nothing writes entry 'n'"]),
        ("<Switch2 variable='{x}' case_1='1'><AlwaysSuccess/></Switch2>", "", "3:1", ["needs the attribute case_2"]),
        ("<Switch2 variable='1' case_1='1' case_2='2'><AlwaysSuccess/></Switch2>", "", "3:1", ["needs exactly 3 child nodes"]),
        ("<LoopInt queue='{q}' value='{v}'><AlwaysSuccess/></LoopInt>", "", "3:17", ["nothing writes entry 'q'"]),
        ("<Sequence><Find goal='{q}'/><LoopInt queue='{q}' value='{v}'><AlwaysSuccess/></LoopInt></Sequence>", "", "3:45",
         ["entry 'q' is int16_t, and a queue of int32_t is needed", "type='int32_t[8]'"]),
        ("<LoopInt queue='1;x' value='{v}'><AlwaysSuccess/></LoopInt>", "", "3:17", ["'x' is not a whole number"]),
        ("<LoopDouble queue='1' value='{v}'><AlwaysSuccess/></LoopDouble>", "", "3:1", ["--allow-floating-point"]),
        ("<Precondition if='1' else='MAYBE'><AlwaysSuccess/></Precondition>", "", "3:28", ["else='MAYBE' is no status"]),
        ("<SkipUnlessUpdated entry='{Climate.Door}'><AlwaysSuccess/></SkipUnlessUpdated>", "", "3:27", ["is a signal"]),
    ],
)  # fmt: skip
def test_wrong_subtrees_and_ports_are_named(
    tmp_path: Path, nodes: str, more: str, place: str, texts: list[str]
) -> None:
    expect(tmp_path, compile_files(tmp_path, {"main.xml": tree(nodes, more)}), f"main.xml:{place}", *texts)


@pytest.mark.parametrize(
    ("script", "index", "texts"),
    [
        ("", 0, ["needs the attribute code"]),
        ("x :=", 4, ["a value is expected here, not the end"]),
        ("x := (1", 7, ["')' is missing"]),
        ("1 +* 2", 3, ["a value is expected here, not '*'"]),
        ("x := 1 x := 2", 7, ["'x' does not belong here", "separated by ';'"]),
        ("5 := x", 0, ["the left side of ':=' must be a name"]),
        ("y := 1; x := y + (y := 3)", 18, ["an assignment inside an expression that reads the entry before"]),
        ("y := 1; x := y == 1 ? (y := 3) : 2", 23, ["that is not always reached"]),
        ("1 + y := 2", 0, ["the left side of ':=' must be a name"]),
        ("x := 'abc", 5, ["a text without its closing '"]),
        ("x := 12abc", 5, ["is neither a number nor a name"]),
        ("x := $", 5, ["'$' has no meaning in a script"]),
        ("x := 1 ? 2", 10, ["':' is missing after '?'"]),
        ("x = 1", 0, ["'=' needs an entry that is there", "write x := "]),
        ("x += 1", 0, ["'+=' needs an entry that is there"]),
        ("y > 1", 0, ["nothing writes entry 'y'"]),
        ("total := 1; totl > 1", 12, ["nothing writes entry 'totl'", "did you mean 'total'?"]),
        ("x := 1e9999", 5, ["a number that is too long"]),
        ("x := " + "9" * 5000, 5, ["a number that is too long"]),
        ("x := 1e400 / 3", 0, ["entry 'x' would hold fractions"]),
        ("x := 0.5", 0, ["entry 'x' would hold fractions", "--allow-floating-point"]),
        ("x := 1; y := 6 / x", 15, ["a division by what is no constant would be rounded"]),
        ("x := 1 / 0", 7, ["a division by 0"]),
        ("x := 'a'; x := 1", 10, ["is written as int32_t here, and as a constant text elsewhere"]),
        ("x := 'a'; y := x + 1", 17, ["'+' needs numbers, and one side is a text"]),
        ("x := 'a'; x < 1", 14, ["a text cannot be compared with the number 1"]),
        ("x := 'a' ; y := x .. 'b'", 18, ["only constant texts can be joined"]),
        ("x := 1.5 & 1", 9, ["'&' needs whole numbers, not the number 1.5"]),
        ("Climate.Temperature == 10.3", 23, ["can never be equal: 10.3 is no multiple of the step 0.5"]),
        ("Climate.Door == 'Opn'", 16, ["'Opn' is no value of this signal", "did you mean 'Open'?"]),
        ("Climate.Temprature > 1", 0, ["has no signal 'Temprature'", "did you mean 'Temperature'?"]),
        ("Climate.Door := 1", 0, ["does not send 'Climate'"]),
        ("Fan.Speed > 3", 0, ["does not receive 'Fan'"]),
        ("Fan.Speed += 3", 0, ["is an output: it is written, not read"]),
        ("Fan.Speed := 9000", 13, ["outside the range of 'Fan.Speed' [0, 8000]"]),
        ("Fan.Speed := 15", 13, ["is in steps of 10: this value lies between two"]),
        ("Fan.Mode := 'Ful'", 12, ["'Ful' is no value of 'Fan.Mode'", "did you mean 'Full'?"]),
        ("x := 99999999999999999999", 5, ["is outside int64_t"]),
        ("(" * 150 + "1", 100, ["nested more than 100 deep"]),
    ],
)
def test_wrong_scripts_are_named_with_the_character(tmp_path: Path, script: str, index: int, texts: list[str]) -> None:
    text = script.replace("&", "&amp;").replace("<", "&lt;")
    result = compile_files(tmp_path, {"main.xml": tree(f'<Script code="{text}"/>')})
    column = 1 if not script else 15 + len(script[:index].replace("&", "&amp;").replace("<", "&lt;"))
    expect(tmp_path, result, f"main.xml:3:{column}", *texts)


@pytest.mark.parametrize(
    ("script", "shape"),
    [
        ("a + b * c", "Binary(+,Name,Binary(*,Name,Name))"),
        ("a - b - c", "Binary(-,Binary(-,Name,Name),Name)"),
        ("-a * b", "Binary(*,Unary(-,Name),Name)"),
        ("a | b & c ^ d", "Binary(^,Binary(|,Name,Binary(&,Name,Name)),Name)"),
        ("a < b <= c", "Comparison(<,<=)"),
        ("!a == b", "Comparison(==)"),
        ("a && b && c", "Binary(&&,Binary(&&,Name,Name),Name)"),
        ("a || b && c", "Binary(||,Name,Binary(&&,Name,Name))"),
        ("a & b + 1 | c", "Binary(|,Binary(&,Name,Binary(+,Name,Number)),Name)"),
        ("a == b & c", "Comparison(==)"),
        ("a := b := 1", "Assignment(:=,Assignment(:=,Number))"),
        ("a ? b := 1 : c", "Conditional(Name,Assignment(:=,Number),Name)"),
        ("a := b ? 1 : 2", "Assignment(:=,Conditional(Name,Number,Number))"),
        ("a ? b : c ? d : e", "Conditional(Name,Name,Conditional(Name,Name,Name))"),
        ("x := a == b ? 1 : 2", "Assignment(:=,Conditional(Comparison(==),Number,Number))"),
        ("x += 0x1F", "Assignment(+=,Number)"),
        ("x := 1.5e3", "Assignment(:=,Number)"),
        ("'a' .. 'b'", "Binary(..,Text,Text)"),
        ("@root == Battery.Level", "Comparison(==)"),
        (";; a ;", "Name"),
    ],
)
def test_the_grammar(script: str, shape: str) -> None:
    def draw(part: object) -> str:
        kind = type(part).__name__
        if kind == "Binary":
            return f"Binary({part.operator},{draw(part.left)},{draw(part.right)})"  # type: ignore[attr-defined]
        if kind == "Unary":
            return f"Unary({part.operator},{draw(part.operand)})"  # type: ignore[attr-defined]
        if kind == "Comparison":
            return f"Comparison({','.join(part.operators)})"  # type: ignore[attr-defined]
        if kind == "Conditional":
            return f"Conditional({draw(part.condition)},{draw(part.yes)},{draw(part.no)})"  # type: ignore[attr-defined]
        if kind == "Assignment":
            return f"Assignment({part.operator},{draw(part.value)})"  # type: ignore[attr-defined]
        return kind

    assert draw(parse(script)[0]) == shape
