# SPDX-License-Identifier: MIT
"""The tree language through `canopy compile`: subtrees and includes, entries, scripts, and what is refused by name."""

# ruff: noqa: E501
# In the tables, one line is one case.

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.script.syntax import parse

ROOT = Path(__file__).parents[2]
DBC = ROOT / "tests" / "unit" / "language" / "language.dbc"
WARNINGS = [
    *("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef", "-Wswitch-enum", "-Wcast-align"),
    *("-Wdouble-promotion", "-Wmissing-prototypes", "-Wvla", "-Werror"),
]

MODEL = """\
<Action ID="Go"><input_port name="speed" type="int"/><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>
<Action ID="Find"><output_port name="goal" type="int16_t"/></Action>
<Action ID="Say"><input_port name="text" type="std::string"/><input_port name="any" default="3"/></Action>
<Control ID="Pick"><input_port name="first" type="uint8_t" default="0"/></Control>
<Decorator ID="Guard"/>"""


def compile_files(tmp_path: Path, files: dict[str, str], *more: str) -> Result:
    """Compiles main.xml of these files into tmp_path/out."""
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    arguments = ["compile", str(tmp_path / "main.xml"), "--dbc", str(DBC), "--node", "Controller", "--period-ms", "10"]
    return CliRunner().invoke(main, [*arguments, "-o", str(tmp_path / "out"), *more])


def tree(nodes: str, more: str = "", model: str = MODEL) -> str:
    """A file whose tree begins in line 3."""
    return (
        f'<root BTCPP_format="4" main_tree_to_execute="Main">\n<BehaviorTree ID="Main">\n{nodes}\n</BehaviorTree>\n{more}\n'
        f"<TreeNodesModel>{model}</TreeNodesModel></root>"
    )


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
        ({"a.xml": INNER.format('<include ros_pkg="x" path="y"/>')}, "a.xml:1:", ["ros_pkg=…> is not supported"]),
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


SUBTREE = '<BehaviorTree ID="Sub">{}</BehaviorTree>'


@pytest.mark.parametrize(
    ("nodes", "more", "place", "texts"),
    [
        ("<SubTree ID='Sup'/>", SUBTREE.format("<AlwaysSuccess/>"), "3:14", ["names no tree: 'Sup'", "did you mean 'Sub'?"]),
        ("<SubTree ID='Sub'/>", SUBTREE.format("<SubTree ID='Main'/>"), "5:24", ["in a cycle: Main -> Sub -> Main"]),
        ("<Sub/>", SUBTREE.format("<AlwaysSuccess/>"), "3:1", ["unknown node 'Sub'", '<SubTree ID="Sub"/>']),
        ("<SubTree ID='Sub'><Go/></SubTree>", SUBTREE.format("<AlwaysSuccess/>"), "3:19", ["cannot have children"]),
        ("<SubTree ID='Sub' _autoremap='maybe'/>", SUBTREE.format("<AlwaysSuccess/>"), "3:31", ["neither true nor false"]),
        ("<SubTree ID='Sub' _x='1'/>", SUBTREE.format("<AlwaysSuccess/>"), "3:23", ["has no attribute '_x'"]),
        ("<Sequence><Find goal='{x}'/><Go speed='{x}'/></Sequence>", "", "3:40",
         ["port 'speed' of 'Go' is int32_t, but entry 'x' is int16_t", "the other end is port 'goal' of 'Find'", "3:23"]),
        ("<Go speed='{x}'/>", "", "3:12", ["nothing writes entry 'x'", "ports of the main tree"]),
        ("<Find goal='5'/>", "", "3:13", ["'5' is a literal", "give an entry: {name}"]),
        ("<Go speed='{a b}'/>", "", "3:12", ["'a b' is not the name of an entry"]),
        ("<Say text='{t}'/>", "", "3:12", ["nothing writes entry 't'"]),
        ("<Sequence><Script code='t := 5'/><Say text='{t}'/></Sequence>", "", "3:30", ["the number 5 cannot be stored as a text"]),
        ("<Go speed='{Climate.Temperature}'/>", "", "3:12", ["port 'speed' of 'Go': a number in steps of 0.5 would lose precision"]),
        ("<Go speed='{Climat.Temperature}'/>", "", "3:12", ["does not receive 'Climat'", "did you mean 'Climate'?"]),
        ("<Go speed='{Climate.Temprature}'/>", "", "3:12", ["has no signal 'Temprature'", "did you mean 'Temperature'?"]),
        ("<Go><Go speed='1'/></Go>", "", "3:1", ["needs a value for its port 'speed'"]),
        ("<Pick/>", "", "3:1", ["<Pick> needs at least 1 child"]),
        ("<Guard><AlwaysSuccess/><AlwaysSuccess/></Guard>", "", "3:1", ["<Guard> needs exactly 1 child"]),
        ("<Control ID='Guard'><AlwaysSuccess/></Control>", "", "3:1", ["'Guard' is declared as Decorator"]),
        ("<Action/>", "", "3:1", ["<Action> needs the attribute ID"]),
        ("<TestNode/>", "", "3:1", ["<TestNode> is not supported"]),
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
        ("x := (y := 3)", 8, ["an assignment inside an expression"]),
        ("x := 'abc", 5, ["a text without its closing '"]),
        ("x := 12abc", 5, ["is neither a number nor a name"]),
        ("x := $", 5, ["'$' has no meaning in a script"]),
        ("1 || 0 && 1", 7, ["&& and || in one row", "use parentheses"]),
        ("1 + 2 & 3", 6, ["+ - * / and & | ^ in one row"]),
        ("x := 1 ? 2", 10, ["':' is missing after '?'"]),
        ("x = 1", 0, ["'=' needs an entry that is there", "write x := "]),
        ("x += 1", 0, ["'+=' needs an entry that is there"]),
        ("y > 1", 0, ["nothing writes entry 'y'"]),
        ("total := 1; totl > 1", 12, ["nothing writes entry 'totl'", "did you mean 'total'?"]),
        ("x := 0.5", 0, ["entry 'x' would hold fractions", "--allow-floating-point"]),
        ("x := 1; y := 6 / x", 15, ["a division by what is no constant would be rounded"]),
        ("x := 1 / 0", 7, ["a division by 0"]),
        ("x := 'a'; x := 1", 10, ["is written as int32_t here, and as a constant text elsewhere"]),
        ("x := 'a'; y := x + 1", 17, ["'+' needs numbers, and one side is a text"]),
        ("x := 'a'; x < 'b'", 14, ["texts have no order"]),
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
        ("a ? b : c ? d : e", "Conditional(Name,Name,Conditional(Name,Name,Name))"),
        ("x := a == b ? 1 : 2", "Assignment(:=,Conditional(Comparison(==),Number,Number))"),
        ("x += 0x1F", "Assignment(+=,Number)"),
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


def test_stubs_compile_and_are_never_overwritten(tmp_path: Path) -> None:
    nodes = "<Pick><Guard><Find goal='{g}'/></Guard><Go speed='1'/><Say text='hello'/></Pick>"
    stubs = tmp_path / "nodes.c"
    assert compile_files(tmp_path, {"main.xml": tree(nodes)}, "--stubs", str(stubs)).exit_code == 0
    text = stubs.read_text()
    for name in ("pick_enter", "pick_child", "pick_halt", "guard_enter", "find_on_start", "go_tick", "say_on_halted"):
        assert f"{name}(" in text
    for compiler in ("gcc", "clang"):
        for file in (stubs, *(tmp_path / "out").glob("*.c")):
            include = ["-I", str(ROOT / "runtime" / "include"), "-I", str(tmp_path / "out")]
            subprocess.run([compiler, "-std=c11", *WARNINGS, *include, "-c", str(file), "-o", "/dev/null"], check=True)
    again = compile_files(tmp_path, {"main.xml": tree(nodes)}, "--stubs", str(stubs))
    assert again.exit_code == 2
    assert "is there already, and is not overwritten" in again.stderr
    assert stubs.read_text() == text


@pytest.mark.parametrize(
    ("name", "c_type"),
    [
        ("std::chrono::milliseconds", "uint32_t"),
        ("unsigned   int", "uint32_t"),
        (
            "std::__cxx11::basic_string&lt;char, std::char_traits&lt;char&gt;, std::allocator&lt;char&gt; &gt;",
            "const char *",
        ),
        ("nav_msgs::msg::Path", "const path_t *"),
        ("std::vector&amp;lt;int&amp;gt;", "const list_t *"),
        ("double", "double"),
        ("pose_t", "const pose_t *"),
    ],
)
def test_types_of_models(tmp_path: Path, name: str, c_type: str) -> None:
    model = f"<Action ID='A'><input_port name='p' type='{name}'/></Action><SubTree ID='Main'><input_port name='e' type='{name}'/></SubTree>"
    options = [
        "--type-map",
        "nav_msgs::msg::Path=path_t",
        "--type-map",
        "std::vector<int>=list_t",
        "--include",
        "mine.h",
    ]
    result = compile_files(
        tmp_path, {"main.xml": tree("<A p='{e}'/>", model=model)}, *options, "--allow-floating-point"
    )
    assert result.exit_code == 0, result.output
    spaced = c_type if c_type.endswith("*") else f"{c_type} "
    assert f"    {spaced}p;" in (tmp_path / "out" / "main_leaves.h").read_text()


def test_floating_point_only_where_it_is_allowed(tmp_path: Path) -> None:
    nodes = "<Sequence><Script code='x := 0.5; n := 3; y := x / n; z := y > 0.1'/><ScriptCondition code='x + n &gt;= 2'/></Sequence>"
    result = compile_files(tmp_path, {"main.xml": tree(nodes)}, "--allow-floating-point")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "out" / "main_app.c").read_text()
    assert "canopy_divide(app->entries.x, (double)app->entries.n" in text
    assert (tmp_path / "out" / "main_app.h").read_text().count("    double ") == 2


GROOT = """\
<?xml version="1.0" encoding="UTF-8"?>
<root BTCPP_format="4"
      main_tree_to_execute="Navigate">
  <BehaviorTree ID="Navigate">
    <RecoveryNode name="NavigateRecovery"
                  number_of_retries="6">
      <PipelineSequence name="NavigateWithReplanning">
        <RateController hz="1">
          <RecoveryNode number_of_retries="1" name="ComputePathToPose">
            <ComputePathToPose goal="{goal}" path="{path}" planner_id="GridBased" error_code_id="{compute_path_error_code}"/>
            <ClearEntireCostmap name="ClearGlobalCostmap" service_name="global_costmap/clear"/>
          </RecoveryNode>
        </RateController>
        <FollowPath path="{path}" controller_id="FollowPath" error_code_id="" speed=""/>
      </PipelineSequence>
      <ReactiveFallback name="RecoveryFallback">
        <GoalUpdated/>
        <SubTree ID="Recover" _autoremap="true" goal="{goal}"/>
      </ReactiveFallback>
    </RecoveryNode>
  </BehaviorTree>

  <BehaviorTree ID="Recover">
    <RoundRobin name="RecoveryActions">
      <ClearEntireCostmap service_name="local_costmap/clear"/>
      <Spin spin_dist="157"/>
      <Sleep name="Wait" msec="5000"/>
    </RoundRobin>
  </BehaviorTree>

  <!-- Description of Node Models (used by Groot) -->
  <TreeNodesModel>
    <Control ID="RecoveryNode" editable="true"><input_port name="number_of_retries" type="int"/></Control>
    <Control ID="PipelineSequence" editable="true"/>
    <Control ID="RoundRobin" editable="true"/>
    <Decorator ID="RateController" editable="true"><input_port name="hz" type="int" default=""/></Decorator>
    <Condition ID="GoalUpdated" editable="true"/>
    <Action ID="ComputePathToPose" editable="true">
      <input_port name="goal" type="geometry_msgs::msg::PoseStamped_&lt;std::allocator&lt;void&gt; &gt;"/>
      <output_port name="path" type="nav_msgs::msg::Path_&lt;std::allocator&lt;void&gt; &gt;">Path found</output_port>
      <input_port name="planner_id" type="std::string"/>
      <output_port name="error_code_id" type="unsigned short"/>
    </Action>
    <Action ID="FollowPath" editable="true">
      <input_port name="path" type="nav_msgs::msg::Path_&lt;std::allocator&lt;void&gt; &gt;"/>
      <input_port name="controller_id" type="std::string" default=""/>
      <input_port name="speed" type="unsigned int" default="3"/>
      <output_port name="error_code_id" type="unsigned short"/>
    </Action>
    <Action ID="ClearEntireCostmap" editable="true"><input_port name="service_name" type="std::string"/></Action>
    <Action ID="Spin" editable="true"><input_port name="spin_dist" type="int">cm</input_port></Action>
    <Action ID="Sleep" editable="true"><input_port name="msec" type="unsigned int"/></Action>
    <SubTree ID="Navigate" editable="true">
      <input_port name="goal" type="geometry_msgs::msg::PoseStamped_&lt;std::allocator&lt;void&gt; &gt;"/>
    </SubTree>
    <SubTree ID="Recover" editable="true"><input_port name="goal"/></SubTree>
  </TreeNodesModel>
</root>
"""


def test_a_tree_as_an_editor_saves_it_compiles_and_links_with_its_stubs(tmp_path: Path) -> None:
    (tmp_path / "types.h").write_text(
        "#pragma once\ntypedef struct { int x; } path_t;\ntypedef struct { int x; } pose_t;\n"
    )
    types = [
        *("--type-map", "nav_msgs::msg::Path_<std::allocator<void>>=path_t"),
        *("--type-map", "geometry_msgs::msg::PoseStamped_<std::allocator<void>>=pose_t"),
    ]
    stubs = tmp_path / "nodes.c"
    result = compile_files(tmp_path, {"main.xml": GROOT}, *types, "--include", "types.h", "--stubs", str(stubs))
    assert result.exit_code == 0, result.output
    program = tmp_path / "program.c"
    program.write_text(
        '#include <stddef.h>\n#include "main_app.h"\nint main(void) { return canopy_tree_validate(main_app.tree, NULL); }\n'
    )
    sources = [program, stubs, *(tmp_path / "out").glob("*.c"), *(ROOT / "runtime" / "src").glob("*.c")]
    include = ["-I", str(ROOT / "runtime" / "include"), "-I", str(tmp_path / "out"), "-I", str(tmp_path)]
    subprocess.run(
        ["gcc", "-std=c11", *WARNINGS, *include, *map(str, sources), "-o", str(tmp_path / "program")], check=True
    )
    subprocess.run([str(tmp_path / "program")], check=True)


CONSTRUCTS = """\
<Script code="t := 'a' .. 1; b := true; n := 0x10; w := 5000000000; n -= 3; n *= 2; b = !b"/>
<Script code="n /= 1; w += n; s := b ? t : 'z'; k := Climate.Door == Open ? 1 : 2; m := Climate.Uptime + 0"/>
<ScriptCondition code="0 &lt; n &lt;= 10 || Climate.Window == false || Climate.Door != 'Shut'"/>
<ScriptCondition code="Climate.Temperature - Climate.Temperature2 > n / 4"/>
<ScriptCondition code="Climate.Temperature * 3 - 1.5 &lt; -n"/>
<ScriptCondition code="1"/>
<ScriptCondition code="u8 >= 0 &amp;&amp; u64 >= 5"/>
<Script code="Fan.Mode := Climate.Temperature > 3 ? 1 : 5; Fan.Turbo := n; Fan.Ticks := u8 | 0x100; Fan.Speed := u8 * 10"/>
<SetBlackboard value="{Climate.Door}" output_key="door"/>
<SetBlackboard value="{Climate.Window}" output_key="{window}"/>
<SetBlackboard value="blue" output_key="{colour}"/>
<SetBlackboard value="17" output_key="u8"/>
<UnsetBlackboard key="colour"/>
<WaitValueUpdate entry="{colour}"><AlwaysSuccess/></WaitValueUpdate>
<Switch2 variable="{Climate.Door}" case_1="Open" case_2="Shut"><AlwaysSuccess/><AlwaysFailure/><AlwaysSuccess/></Switch2>
<Switch2 variable="{colour}" case_1="blue" case_2="{t}"><AlwaysSuccess/><AlwaysFailure/><AlwaysSuccess/></Switch2>
<LoopString queue="a;b;c" value="{letter}"><ScriptCondition code="letter == 'b'"/></LoopString>
<LoopBool queue="true;false" value="{bit}" if_empty="SKIPPED"><AlwaysSuccess/></LoopBool>
<LoopDouble queue="1.5;2" value="{real}"><ScriptCondition code="real / n > 1.5 &amp;&amp; real * 2 != Climate.Temperature"/></LoopDouble>
<Script code="real += 0.1; n = real > 2 ? 1 : 2; f32 = real; u8 = real; u64 = w; r2 := real - n"/>
<Precondition if="b" else="RUNNING"><Timeout msec="{n}"><Delay delay_msec="{u8}"><AlwaysSuccess/></Delay></Timeout></Precondition>
<Parallel success_count="{n}" failure_count="1"><AlwaysSuccess/><RunOnce then_skip="{b}"><AlwaysSuccess/></RunOnce></Parallel>
<Say text="{t}" any="{w}"/>
<Go speed="{Climate.Temperature2}"/>"""


def test_every_construct_compiles_without_a_warning(tmp_path: Path) -> None:
    ports = {"u8": "uint8_t", "u64": "uint64_t", "f32": "float"}
    model = MODEL + '<SubTree ID="Main">'
    model += (
        "".join(f'<input_port name="{name}" type="{kind}" default="1"/>' for name, kind in ports.items()) + "</SubTree>"
    )
    result = compile_files(
        tmp_path, {"main.xml": tree(f"<Sequence>{CONSTRUCTS}</Sequence>", model=model)}, "--allow-floating-point"
    )
    assert result.exit_code == 0, result.output
    include = ["-I", str(ROOT / "runtime" / "include"), "-I", str(tmp_path / "out")]
    for compiler in ("gcc", "clang"):
        command = [
            compiler,
            "-std=c11",
            *WARNINGS,
            *include,
            "-c",
            str(tmp_path / "out" / "main_app.c"),
            "-o",
            "/dev/null",
        ]
        subprocess.run(command, check=True)
