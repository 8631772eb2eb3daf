# SPDX-License-Identifier: MIT
"""Ports and values as trees have them: each compiles, and its C passes gcc's warnings; or it is refused by name."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.port_types import Options, literal, read_type

ROOT = Path(__file__).parents[2]
DBC = ROOT / "examples" / "nao" / "nao.dbc"
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror"]
IN = '<input_port name="v"{}/>'


def compiled(tmp_path: Path, nodes: str, model: str = "", *more: str, trees: str = "") -> Result:
    """Runs `canopy compile`; the main tree is M."""
    models = f"<TreeNodesModel>{model}</TreeNodesModel>" if model else ""
    text = f'<root BTCPP_format="4" main_tree_to_execute="M"><BehaviorTree ID="M">{nodes}</BehaviorTree>{trees}{models}'
    (tmp_path / "v.xml").write_text(f"{text}</root>", encoding="utf-8")
    bus = ["--dbc", str(DBC), "--node", "Controller", "--period-ms", "50", "--allow-floating-point"]
    arguments = ["compile", str(tmp_path / "v.xml"), *bus, "-o", str(tmp_path / "out"), *more]
    return CliRunner().invoke(main, [*arguments, "--stubs", str(tmp_path / "leaves.c")])


def action(name: str, *ports: str) -> str:
    """A declaration."""
    return f'<Action ID="{name}">{"".join(ports)}</Action>'


def port(name: str, kind: str | None = None, tag: str = "input_port", default: str | None = None) -> str:
    """A port of a declaration."""
    typed = f' type="{kind.replace("<", "&lt;")}"' if kind is not None else ""
    given = f' default="{default}"' if default is not None else ""
    return f'<{tag} name="{name}"{typed}{given}/>'


LOOP = '<BehaviorTree ID="L"><LoopInt queue="{queue}" value="{n}"><AlwaysSuccess/></LoopInt></BehaviorTree>'
SWITCH = (
    '<Switch2 variable="{k}" case_1="RED" case_2="GREEN"><AlwaysSuccess/><AlwaysSuccess/><AlwaysFailure/></Switch2>'
)
COLORS = '<Enum ID="Color"><value name="RED"/><value name="GREEN" number="4"/></Enum>'
PAINT = action("Paint", port("c", "demo::Color"))
SUB = '<BehaviorTree ID="S"><Sequence><Paint c="{k}"/><ScriptCondition code="k == GREEN"/></Sequence></BehaviorTree>'

WORK = {
    "untyped, unset": ("<A/>", action("A", port("v")), ""),
    "untyped output, unset": ('<A i="5"/>', action("A", port("i"), port("o", tag="output_port")), ""),
    "untyped in several types": (
        '<Sequence><A v="5"/><A v="hello"/><A v="2.5"/><A v="{e}"/><A v="{t}"/><A v="{d}"/></Sequence>',
        action("A", port("v"))
        + f'<SubTree ID="M">{port("e", "bool")}{port("t", "std::string")}{port("d", "double")}</SubTree>',
        "",
    ),
    "untyped numbers": ('<Sequence><A v="5"/><A v="2.5"/></Sequence>', action("A", port("v")), ""),
    "literal on an inout port": ('<A v="/reactivate"/>', action("A", port("v", "std::string", "inout_port")), ""),
    "number on an inout port": ('<A v="7"/>', action("A", port("v", "int", "inout_port")), ""),
    "list as a literal": ('<A v="1;2;3"/>', action("A", port("v", "int32_t[8]")), ""),
    "list of texts": ('<A v="a;b c"/>', action("A", port("v", "std::string[4]")), ""),
    "empty list": ('<A v=""/>', action("A", port("v", "std::vector<int>", default="")), "--allow-unset-ports"),
    "vector into a loop": (
        '<Sequence><P o="{q}"/><LoopDouble queue="{q}" value="{x}"><U i="{x}"/></LoopDouble></Sequence>',
        action("P", port("o", "std::vector<double>", "output_port")) + action("U", port("i", "double")),
        "",
    ),
    "loop over nothing": ('<LoopInt queue="" if_empty="FAILURE" value="{v}"><AlwaysSuccess/></LoopInt>', "", ""),
    "list through a subtree's port": ('<SubTree ID="L" queue="1;2;3"/>', "", ""),
    "default that is an entry": (
        '<Sequence><A o="{grasp}"/><B v="{grasp}"/></Sequence>',
        action("A", port("o", "int", "output_port"))
        + action("B", port("v", "int"))
        + f'<SubTree ID="M">{port("grasp", None, "output_port", "{grasp}")}</SubTree>',
        "",
    ),
    "status": ('<A v="SUCCESS"/>', action("A", port("v", "BT::NodeStatus")), ""),
    "optional": ('<Sequence><A v="1.5"/><A/></Sequence>', action("A", port("v", "std::optional<double>")), ""),
    "infinity": ('<A v="-infinity()"/>', action("A", port("v", "double"), port("w", "float", default="inf")), ""),
    "names of entries": (
        '<Sequence><A o="{my-entry}"/><A o="{a b}"/><A o="{goal.pose}"/><B v="{goal.pose}"/></Sequence>',
        action("A", port("o", "int", "output_port")) + action("B", port("v", "int")),
        "",
    ),
    "number that a text port reads": (
        '<Sequence><Script code="a := 3"/><A v="{a}"/></Sequence>',
        action("A", port("v", "std::string")),
        "",
    ),
    "enum in a script": ('<Sequence><Script code="color := RED"/><Paint c="{color}"/></Sequence>', PAINT + COLORS, ""),
    "enum in a literal": ('<Sequence><Paint c="GREEN"/><Paint c="4"/></Sequence>', PAINT + COLORS, ""),
    "enum in a switch": (
        f'<Sequence><Paint c="{{k}}"/><SetBlackboard value="RED" output_key="k"/>{SWITCH}</Sequence>',
        PAINT + COLORS,
        "",
    ),
    "enum through a subtree": ('<SubTree ID="S" k="GREEN"/>', PAINT + COLORS, ""),
    "C++ type with a header": (
        '<A v="{p}"/>',
        action("A", port("v", "ns::Pose_<std::allocator<void>>", "output_port")),
        "--include",
    ),
    "whole number with a point": ('<A v="5.0"/>', action("A", port("v", "int")), ""),
}


@pytest.mark.parametrize("name", WORK)
def test_it_compiles_and_so_does_its_c(tmp_path: Path, name: str) -> None:
    nodes, model, option = WORK[name]
    trees = (LOOP if 'ID="L"' in nodes else "") + (SUB if 'ID="S"' in nodes else "")
    more = ["--include", "types.h"] if option == "--include" else [option] if option else []
    result = compiled(tmp_path, nodes, model, *more, trees=trees)
    assert result.exit_code == 0, result.output
    (tmp_path / "types.h").write_text("#pragma once\ntypedef struct { int x; } ns_pose_t;\n")
    sources = [*(tmp_path / "out").glob("*.c"), tmp_path / "leaves.c"]
    include = [flag for folder in (ROOT / "runtime" / "include", tmp_path / "out", tmp_path) for flag in ("-I", folder)]
    subprocess.run(["gcc", "-std=c11", *WARNINGS, *include, "-fsyntax-only", *sources], check=True)


@pytest.mark.parametrize(
    ("nodes", "model", "texts"),
    [
        ('<A v="1.5;2.5"/>', action("A", port("v", "std::optional<double>")), ["'1.5;2.5' is not a number"]),
        ('<A v="1;x"/>', action("A", port("v", "int32_t[8]")), ["'x' is not a whole number"]),
        ('<A v="1;2;3"/>', action("A", port("v", "int32_t[2]")), ["a list of 3 items", "--type-map"]),
        ('<A v="RED"/>', action("A", port("v", "BT::NodeStatus")), ["'RED' is no value of a status"]),
        ('<Paint c="BLUE"/>', PAINT + COLORS, ["'BLUE' is no value of Color"]),
        ('<Script code="RED := 3"/>', PAINT + COLORS, ["'RED' is a value of an enum"]),
        ('<ScriptCondition code="x == BLUE"/>', "", ["<Enum> in <TreeNodesModel>"]),
        ("<A v='json:{&quot;x&quot;:1}'/>", action("A", port("v", "point_t")), ["unsupported type 'point_t'"]),
        ('<TestNode return_status_script="SUCCESS"/>', "", ["return_status_script is not supported"]),
        ("<AlwaysSuccess/>", '<Enum ID="C"/>', ["needs an ID and values"]),
        ("<AlwaysSuccess/>", '<Enum ID="C"><value name="A"/><value name="A"/></Enum>', ["each once"]),
        ("<AlwaysSuccess/>", '<Enum ID="C"><value name="A" number="x"/></Enum>', ["not a whole number"]),
        ("<AlwaysSuccess/>", COLORS + '<Enum ID="D"><value name="RED" number="2"/></Enum>', ["contradicts 'Color'"]),
        ('<A o="5"/>', action("A", port("o", "int", "output_port")), ["is written, and '5' is a literal"]),
        (
            '<Sequence><A o="{Battery.Level}"/></Sequence>',
            action("A", port("o", "int", "output_port")),
            ["'Battery' is a message of the bus"],
        ),
        (
            '<Sequence><A o="{x}"/><B v="{x}"/></Sequence>',
            action("A", port("o", "std::shared_ptr<Cat>", "output_port"))
            + action("B", port("v", "std::shared_ptr<Animal>")),
            ["unsupported type 'std::shared_ptr<Cat>'", "it is std_shared_ptr_cat_t unless"],
        ),
        (
            "<A/>",
            action("A", port("v", default="1")) + action("A", port("v", default="1"), port("w", default="2")),
            ["'A' is declared again"],
        ),
    ],
)
def test_it_is_refused_by_name(tmp_path: Path, nodes: str, model: str, texts: list[str]) -> None:
    result = compiled(tmp_path, nodes, model)
    assert result.exit_code == 2, result.output
    for text in texts:
        assert text in result.stderr, result.stderr


def test_two_cxx_types_can_be_one_c_type(tmp_path: Path) -> None:
    model = action("A", port("o", "std::shared_ptr<Cat>", "output_port")) + action(
        "B", port("v", "std::shared_ptr<Animal>")
    )
    maps = ["--type-map", "std::shared_ptr<Cat>=animal_t", "--type-map", "std::shared_ptr<Animal>=animal_t"]
    result = compiled(tmp_path, '<Sequence><A o="{x}"/><B v="{x}"/></Sequence>', model, *maps, "--include", "types.h")
    assert result.exit_code == 0, result.output


def test_a_list_has_the_capacity_that_a_type_map_gives(tmp_path: Path) -> None:
    model = action("A", port("v", "std::vector<int>"))
    items = ";".join(map(str, range(20)))
    assert "a list of 20 items" in compiled(tmp_path, f'<A v="{items}"/>', model).stderr
    result = compiled(tmp_path, f'<A v="{items}"/>', model, "--type-map", "std::vector<int>=int[32]")
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize(
    ("name", "c"),
    [
        ("std::vector<double, std::allocator<double> >", "canopy_queue_double_16_t"),
        ("std::deque<std::string>", "canopy_queue_text_16_t"),
        ("BT::SharedQueue<int>", "canopy_queue_int32_16_t"),
        ("std::shared_ptr<std::deque<bool>>", "canopy_queue_bool_16_t"),
        ("std::optional<std::vector<int>>", "canopy_queue_int32_16_t"),
        ("std::vector<geometry_msgs::Pose_<std::allocator<void>>>", "std_vector_geometry_msgs_pose_t"),
        ("nav_msgs::msg::Path", "nav_msgs_msg_path_t"),
        ("BT::NodeStatus", "int32_t"),
    ],
)
def test_cxx_types(name: str, c: str) -> None:
    assert read_type(name, "x", Place("x"), Options(floats=True, include="types.h")).c == c


@pytest.mark.parametrize(
    ("text", "kind", "c"),
    [
        ("infinity()", "double", "__builtin_inf()"),
        ("-inf", "float", "-__builtin_inff()"),
        ("std::numeric_limits<double>::infinity()", "double", "__builtin_inf()"),
        ("std::numeric_limits<int>::max()", "int", "INT32_C(2147483647)"),
        ("numeric_limits<unsigned>::max()", "unsigned", "UINT32_C(4294967295)"),
        ("-std::numeric_limits<float>::max()", "float", "-3.4028234663852886e+38f"),
        ("SKIPPED", "NodeStatus", "INT32_C(4)"),
    ],
)
def test_values_that_cxx_names(text: str, kind: str, c: str) -> None:
    options = Options(floats=True)
    assert literal(text, read_type(kind, "x", Place("x"), options), "x", Place("x")) == c


def test_infinity_is_no_whole_number() -> None:
    with pytest.raises(CompileError, match="is outside int32_t"):
        literal("infinity()", read_type("int", "x", Place("x"), Options()), "x", Place("x"))
