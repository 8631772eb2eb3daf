# SPDX-License-Identifier: MIT
"""Models, types and stubs: what the user writes in C, from the tree as an editor saves it to a linked program."""

# ruff: noqa: E501
# In the tables, one line is one case.

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from integration.compilers import COMPILERS
from integration.language import MODEL, ROOT, WARNINGS, compile_files, tree


@pytest.mark.parametrize("compiler", COMPILERS)
def test_stubs_compile_and_are_never_overwritten(tmp_path: Path, compiler: str) -> None:
    nodes = "<Pick><Guard><Find goal='{g}'/></Guard><Go speed='1'/><Say text='hello'/></Pick>"
    stubs = tmp_path / "nodes.c"
    assert compile_files(tmp_path, {"main.xml": tree(nodes)}, "--stubs", str(stubs)).exit_code == 0
    text = stubs.read_text()
    for name in ("pick_enter", "pick_child", "pick_halt", "guard_enter", "find_on_start", "go_tick", "say_on_halted"):
        assert f"{name}(" in text
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
        ("uint16", "uint16_t"),
        ("float64", "double"),
        ("pose_t", "const pose_t *"),
        ("int16_t*0.01", "int16_t"),
        ("unsigned char / 4", "uint8_t"),
        ("my::Celsius", "int32_t"),
    ],
)
def test_types_of_models(tmp_path: Path, name: str, c_type: str) -> None:
    model = f"<Action ID='A'><input_port name='p' type='{name}'/></Action><SubTree ID='Main'><input_port name='e' type='{name}'/></SubTree>"
    options = [
        "--type-map",
        "nav_msgs::msg::Path=path_t",
        "--type-map",
        "std::vector<int>=list_t",
        "--type-map",
        "my::Celsius=int32_t * 0.1",
        "--include",
        "mine.h",
    ]
    result = compile_files(
        tmp_path, {"main.xml": tree("<A p='{e}'/>", model=model)}, *options, "--allow-floating-point"
    )
    assert result.exit_code == 0, result.output
    spaced = c_type if c_type.endswith("*") else f"{c_type} "
    assert f"    {spaced}p;" in (tmp_path / "out" / "main_leaves.h").read_text()


def test_a_port_in_both_directions_has_two_names(tmp_path: Path) -> None:
    port = '<{}_port name="index" type="int"/>'
    texts = []
    for name in ("inout", "bidirectional"):
        model = f'<Control ID="Resume">{port.format(name)}</Control>'
        nodes = "<Sequence><Script code='i := 0'/><Resume index='{i}'><AlwaysSuccess/></Resume></Sequence>"
        assert compile_files(tmp_path, {"main.xml": tree(nodes, model=model)}).exit_code == 0
        texts.append((tmp_path / "out" / "main_leaves.h").read_text())
    assert texts[0] == texts[1]
    assert "int32_t *index;" in texts[0]


def test_floating_point_only_where_it_is_allowed(tmp_path: Path) -> None:
    nodes = "<Sequence><Script code='x := 0.5; n := 3; y := x / n; z := y > 0.1'/><ScriptCondition code='x + n &gt;= 2'/></Sequence>"
    result = compile_files(tmp_path, {"main.xml": tree(nodes)}, "--allow-floating-point")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "out" / "main_app.c").read_text()
    assert "canopy_divide(app->entries.x, (double)app->entries.n" in text
    assert (tmp_path / "out" / "main_app.h").read_text().count("    double ") == 2


FLOATING = ["--dbc", str(ROOT / "tests" / "unit" / "floating" / "floating.dbc")]


@pytest.mark.parametrize(
    ("nodes", "options", "texts"),
    [
        ("<ScriptCondition code='Level.Water &gt; 1'/>", [], ["'Level.Water' is floating point", "--allow-floating-point"]),
        ("<Script code='Pump.Power := 1'/>", [], ["'Pump.Power' is floating point", "use a leaf"]),
        ("<Go speed='{Level.Water}'/>", [], ["port 'speed' of 'Go': 'Level.Water' is floating point"]),
        ("<Go speed='{Level.Water}'/>", ["--allow-floating-point"],
         ["port 'speed' of 'Go': a floating-point signal would be cut to int32_t", "convert it in a script"]),
    ],
)  # fmt: skip
def test_floating_point_signals_are_refused_by_name(
    tmp_path: Path, nodes: str, options: list[str], texts: list[str]
) -> None:
    result = compile_files(tmp_path, {"main.xml": tree(nodes)}, *FLOATING, *options)
    assert result.exit_code == 2, result.output
    for text in texts:
        assert text in result.stderr


def test_a_constant_that_no_double_can_hold_is_refused(tmp_path: Path) -> None:
    nodes = "<Script code='x := 0.5; y := x * 1e400'/>"
    result = compile_files(tmp_path, {"main.xml": tree(nodes)}, "--allow-floating-point")
    assert result.exit_code == 2
    assert "a number that is too large for floating point" in result.stderr


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


@pytest.mark.parametrize("compiler", COMPILERS)
def test_every_construct_compiles_without_a_warning(tmp_path: Path, compiler: str) -> None:
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
    source = str(tmp_path / "out" / "main_app.c")
    subprocess.run([compiler, "-std=c11", *WARNINGS, *include, "-c", source, "-o", "/dev/null"], check=True)


def test_texts_of_a_leaf_need_names_of_their_own(tmp_path: Path) -> None:
    for texts in ("low noise;low-noise", "red;?"):
        model = f"<Action ID='A'><output_port name='p' type='std::string'/><MetadataFields><Metadata texts='{texts}'/></MetadataFields></Action>"
        result = compile_files(tmp_path, {"main.xml": tree("<A p='{e}'/>", model=model)})
        assert result.exit_code == 2
        assert "gives no C name of its own" in result.stderr


def test_the_main_tree_can_be_named_from_outside(tmp_path: Path) -> None:
    trees = "".join(f"<BehaviorTree ID='{name}'><AlwaysSuccess/></BehaviorTree>" for name in ("A", "B"))
    files = {"main.xml": f"<root BTCPP_format='4'>{trees}</root>"}
    refused = compile_files(tmp_path, files)
    assert refused.exit_code == 2
    assert "several trees, and no main_tree_to_execute says which" in refused.stderr
    assert "--main-tree" in refused.stderr
    assert compile_files(tmp_path, files, "--main-tree", "B").exit_code == 0
    assert "tables of tree B" in (tmp_path / "out" / "main_app.c").read_text()
    wrong = compile_files(tmp_path, files, "--main-tree", "C")
    assert wrong.exit_code == 2
    assert "--main-tree: error: 'C' is no tree of" in wrong.stderr


@pytest.mark.parametrize("compiler", COMPILERS)
def test_unset_ports_are_zero_where_that_is_allowed(tmp_path: Path, compiler: str) -> None:
    ports = {"count": "uint8_t", "on": "bool", "name": "string", "limit": "int16_t*0.1", "pose": "pose_t"}
    inputs = "".join(f"<input_port name='{name}' type='{kind}'/>" for name, kind in ports.items())
    model = f"<Condition ID='Is'>{inputs}</Condition>"
    files = {"main.xml": tree("<Is/>", model=model)}
    (tmp_path / "mine.h").write_text("typedef struct { int x; } pose_t;\n")
    refused = compile_files(tmp_path, files, "--include", "mine.h")
    assert refused.exit_code == 2
    assert "'Is' needs a value for its port 'count'" in refused.stderr
    assert "--allow-unset-ports" in refused.stderr
    assert compile_files(tmp_path, files, "--include", "mine.h", "--allow-unset-ports").exit_code == 0
    code = (tmp_path / "out" / "main_app.c").read_text()
    for member in (".count = 0", ".on = false", ".name = NULL", ".limit = 0", ".pose = NULL"):
        assert member in code
    include = ["-I", str(ROOT / "runtime" / "include"), "-I", str(tmp_path / "out"), "-I", str(tmp_path)]
    source = str(tmp_path / "out" / "main_app.c")
    subprocess.run([compiler, "-std=c11", *WARNINGS, *include, "-c", source, "-o", "/dev/null"], check=True)


def test_a_leaf_that_lists_no_texts_writes_places_in_the_table(tmp_path: Path) -> None:
    model = "<Action ID='See'><output_port name='what' type='string'/></Action>"
    model += "<Action ID='Tell'><input_port name='what' type='string'/></Action>"
    nodes = "<Sequence><See what='{x}'/><Tell what='{x}'/></Sequence>"
    assert compile_files(tmp_path, {"main.xml": tree(nodes, model=model)}).exit_code == 0
    assert "void see_set_what(const see_ports_t *ports, uint16_t value)" in (tmp_path / "out/main_leaves.h").read_text()
    # Whatever number it writes, nothing outside the table is read.
    guard = "main_texts[app->entries.x < MAIN_TEXTS ? app->entries.x : 0u]"
    assert guard in (tmp_path / "out" / "main_app.c").read_text()


@pytest.mark.parametrize("item", ["std::chrono::milliseconds", "pose_t"])
def test_queues_hold_numbers_and_texts(tmp_path: Path, item: str) -> None:
    model = f"<Action ID='A'><output_port name='p' type='{item}[4]'/></Action>"
    result = compile_files(tmp_path, {"main.xml": tree("<A p='{e}'/>", model=model)}, "--include", "mine.h")
    assert result.exit_code == 2
    assert "a queue has 1 to 65535 numbers or texts" in result.stderr
