# SPDX-License-Identifier: MIT
"""What `canopy compile` cannot compile: exit status 2, a message with the place and the way out, no file written."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main

NAO = Path(__file__).parents[2] / "examples" / "nao"

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
MODEL = """\
    <Condition ID="Ready"><MetadataFields><Metadata reads="Battery"/></MetadataFields></Condition>
    <Action ID="Go">
      <input_port name="speed" type="uint8_t"/>
      <MetadataFields><Metadata reads="Battery.Level" writes="PowerCommand"/></MetadataFields>
    </Action>"""


def compile_tree(tmp_path: Path, tree: str | bytes, dbc: Path = NAO / "nao.dbc", *more: str) -> Result:
    """Runs the command on this tree text. The output folder is tmp_path/out."""
    file = tmp_path / "main.xml"
    file.write_bytes(tree if isinstance(tree, bytes) else tree.encode())
    arguments = ["compile", str(file), "--dbc", str(dbc), "--node", "Controller", "--period-ms", "50"]
    return CliRunner().invoke(main, [*arguments, "-o", str(tmp_path / "out"), *more])


def expect_error(tmp_path: Path, result: Result, place: str, *texts: str) -> None:
    """The one error is at `place` ("main.xml:4:3") and its text contains `texts`."""
    assert result.exit_code == 2, result.output
    first, *rest = result.stderr.splitlines()
    assert first.startswith(f"{tmp_path / place}: error: "), first
    for text in texts:
        assert text in first + "\n".join(rest)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("nodes", "place", "texts"),
    [
        ("<Sequense><Ready/></Sequense>", "main.xml:3:5", ["unknown node 'Sequense'", "did you mean 'Sequence'?"]),
        ("<Sequence>\n  <Redy/>\n</Sequence>", "main.xml:4:3", ["unknown node 'Redy'", "did you mean 'Ready'?"]),
        ("<Sequence/>", "main.xml:3:5", ["<Sequence> needs at least 1 child node(s), and has 0"]),
        ("<Inverter><Ready/><Ready/></Inverter>", "main.xml:3:5", ["needs exactly 1 child node(s), and has 2"]),
        ("<Ready><Ready/></Ready>", "main.xml:3:12", ["'Ready' is a leaf and cannot have children"]),
        ("<Ready/>\n    <Ready/>", "main.xml:2:3", ["needs exactly 1 node, and has 2"]),
        ("<Sequence nam='x'><Ready/></Sequence>", "main.xml:3:5", ["has no attribute 'nam'", "did you mean 'name'?"]),
        ("<Timeout><Ready/></Timeout>", "main.xml:3:5", ["<Timeout> needs the attribute msec"]),
        ("<Timeout msec='soon'><Ready/></Timeout>", "main.xml:3:5", ["msec='soon' is not a whole number"]),
        ("<Timeout msec='-1'><Ready/></Timeout>", "main.xml:3:5", ["msec=-1 is outside [0, "]),
        ("<ReactiveParallel success_count='3'><Ready/><Ready/></ReactiveParallel>", "main.xml:3:5", ["never be met"]),
        ("<ReactiveParallel success_count='0'><Ready/></ReactiveParallel>", "main.xml:3:5", ["success_count=0"]),
        ("<Go/>", "main.xml:3:5", ["'Go' needs a value for its port 'speed'"]),
        ("<Go speed='300'/>", "main.xml:3:16", ["port 'speed' of 'Go': 300 is outside uint8_t [0, 255]"]),
        ("<Go speed='fast'/>", "main.xml:3:16", ["'fast' is not a whole number"]),
        ("<Go speed='{x}'/>", "main.xml:3:16", ["port 'speed' of 'Go': nothing writes entry 'x'"]),
        ("<Go sped='3'/>", "main.xml:3:5", ["has no attribute 'sped'", "did you mean 'speed'?"]),
        ("<Ready _skpIf='true'/>", "main.xml:3:20", ["has no attribute '_skpIf'", "did you mean '_skipIf'?"]),
        ("<SubTree ID='Main'/>", "main.xml:3:5", ["trees contain each other in a cycle: Main -> Main"]),
        ("<Action ID='Ready'/>", "main.xml:3:5", ["'Ready' is declared as Condition"]),
    ],
)
def test_a_wrong_node_is_named_with_its_place(tmp_path: Path, nodes: str, place: str, texts: list[str]) -> None:
    expect_error(tmp_path, compile_tree(tmp_path, TREE.format(nodes=f"    {nodes}", model=MODEL)), place, *texts)


@pytest.mark.parametrize(
    ("model", "texts"),
    [
        ("<Condition ID='Ready'><MetadataFields><Metadata reads='Batery'/></MetadataFields></Condition>",
         ["leaf 'Ready' reads 'Batery'", "nao.dbc does not receive", "did you mean 'Battery'?"]),
        ("<Condition ID='Ready'><MetadataFields><Metadata reads='Battery.Levle'/></MetadataFields></Condition>",
         ["message 'Battery' has no signal 'Levle'", "did you mean 'Level'?"]),
        ("<Action ID='Ready'><MetadataFields><Metadata writes='Battery'/></MetadataFields></Action>",
         ["leaf 'Ready' writes 'Battery'", "does not send"]),
        ("<Condition ID='Ready'><MetadataFields><Metadata writes='PowerCommand'/></MetadataFields></Condition>",
         ["condition 'Ready' declares that it writes"]),
        ("<Condition ID='Ready'><MetadataFields><Metadata stale='RUNNING'/></MetadataFields></Condition>",
         ["metadata stale='RUNNING'", "allowed: FAILURE, SUCCESS"]),
        ("<Condition ID='Ready'><MetadataFields><Metadata raeds='Battery'/></MetadataFields></Condition>",
         ["unknown metadata 'raeds'", "did you mean 'reads'?"]),
        ("<Condition ID='Ready'><input_port name='a' type='std::vector'/></Condition>",
         ["unsupported type 'std::vector'"]),
        ("<Condition ID='Ready'/><Condition ID='ready'/>", ["'ready' is declared again"]),
        ("<Condition/>", ["needs an ID"]),
        ("<Node ID='Ready'/>", ["<Node> in <TreeNodesModel> is not supported"]),
    ],
)  # fmt: skip
def test_a_wrong_declaration_of_a_leaf_is_named(tmp_path: Path, model: str, texts: list[str]) -> None:
    result = compile_tree(tmp_path, TREE.format(nodes="    <Ready/>", model=model))
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(f"{tmp_path / 'main.xml'}:6:")
    for text in texts:
        assert text in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("node", ["Action", "Condition", "Control", "Decorator"])
def test_a_type_that_is_not_supported_blocks_only_trees_that_use_it(tmp_path: Path, node: str) -> None:
    model = f"<Condition ID='Ready'/><{node} ID='Other'><input_port name='a' type='std::vector'/></{node}>"
    assert compile_tree(tmp_path, TREE.format(nodes="    <Ready/>", model=model)).exit_code == 0
    inner = "<Other><Ready/></Other>" if node in ("Control", "Decorator") else "<Other/>"
    result = compile_tree(tmp_path, TREE.format(nodes=f"    {inner}", model=model))
    assert result.exit_code == 2
    assert "unsupported type 'std::vector'" in result.stderr


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        (b"", "main.xml:1:1", "not well-formed XML"),
        (b"<root", "main.xml:1:1", "not well-formed XML"),
        (b"<root BTCPP_format='4'>\n  <a></b>\n</root>", "main.xml:2:8", "mismatched tag"),
        (b"<root BTCPP_format='3'/>", "main.xml:1:1", 'must be <root BTCPP_format="4">'),
        (b"<root BTCPP_format='4'/>", "main.xml:1:1", "no <BehaviorTree>"),
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]>\n<root BTCPP_format='4'>&b;</root>", "main.xml:1:1", "is not accepted"),
        (b"\xff\xfe\x00", "main.xml:1:", "not well-formed XML"),
        (b"<root BTCPP_format='4'><BehaviorTree/></root>", "main.xml:1:24", "needs exactly 1 node, and has 0"),
        (
            b"<root BTCPP_format='4'><BehaviorTree><A/></BehaviorTree>\n<BehaviorTree><A/></BehaviorTree></root>",
            "main.xml:2:1",
            "needs an ID of its own",
        ),
        (b"<root BTCPP_format='4'><include path='x'/></root>", "main.xml:1:39", "x' is not there"),
        (b"<root BTCPP_format='4'><includes path='x'/></root>", "main.xml:1:24", "did you mean 'include'?"),
    ],
)
def test_a_malformed_file_is_an_error_with_a_place(tmp_path: Path, text: bytes, place: str, message: str) -> None:
    result = compile_tree(tmp_path, text)
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(f"{tmp_path / place}")
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_lone_tree_needs_no_id(tmp_path: Path) -> None:
    result = compile_tree(tmp_path, b"<root BTCPP_format='4'><BehaviorTree><AlwaysSuccess/></BehaviorTree></root>")
    assert result.exit_code == 0, result.output


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    arguments = [
        "compile",
        "nothing.xml",
        "--dbc",
        "x.dbc",
        "--node",
        "N",
        "--period-ms",
        "5",
        "-o",
        str(tmp_path / "out"),
    ]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert "nothing.xml: error: cannot be read: No such file" in result.stderr


def test_too_many_nodes_are_refused(tmp_path: Path) -> None:
    nodes = "<Sequence>" + "<Ready/>" * 65_534 + "</Sequence>"
    result = compile_tree(tmp_path, TREE.format(nodes=nodes, model=MODEL))
    assert result.exit_code == 2
    assert "the tree has more than 65534 nodes" in result.stderr


def test_a_deep_tree_compiles(tmp_path: Path) -> None:
    """Depth costs no recursion: neither here nor in the engine."""
    depth = 5_000
    nodes = "<Inverter>" * depth + "<Ready/>" + "</Inverter>" * depth
    result = compile_tree(tmp_path, TREE.format(nodes=nodes, model=MODEL))
    assert result.exit_code == 0, result.output
    assert f"depth {depth + 1}" in result.output


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ('BA_ "GenMsgCycleTime" BO_ 512 50;', 'BA_ "GenMsgCycleTime" BO_ 512 75;', ["multiple of 50"]),
        ('BA_DEF_DEF_ "GenSigInactiveValue" 0;', "", ["'PowerCommand.E2E_CRC'"]),
        ('BA_ "GenSigInactiveValue" SG_ 512 Mode 0;', 'BA_ "GenSigInactiveValue" SG_ 512 Mode 9;', ["its range"]),
        (" SG_ E2E_Counter : 8|4@1+ (1,0) [0|14] \"\" Robot\n SG_ Mode", " SG_ Mode", ["needs the signal E2E_Counter"]),
        ("BO_ 512 PowerCommand:", "BO_ 512 CanopyTick:", ["node 'Controller' sends 'CanopyTick'", "--trace 0x600"]),
        ("BU_: Controller Robot", "BU_: Robot", ["no node 'Controller'", "known here: Robot"]),
        ("BO_ 256 Battery: 8 Robot", "BO_ 256 Battery", ["not a DBC that can be read"]),
    ],
)  # fmt: skip
def test_a_wrong_dbc_is_named(tmp_path: Path, old: str, new: str, texts: list[str]) -> None:
    text = (NAO / "nao.dbc").read_text()
    assert old in text
    if "SG_DEF" in old or old.startswith("BA_DEF_DEF_"):
        text = "\n".join(line for line in text.splitlines() if "GenSigInactiveValue" not in line) + "\n"
        texts = ["has no safe value", "GenSigInactiveValue"]
    dbc = tmp_path / "bus.dbc"
    dbc.write_text(text.replace(old, new))
    result = compile_tree(tmp_path, TREE.format(nodes="    <Ready/>", model=MODEL), dbc)
    assert result.exit_code == 2, result.output
    assert str(dbc) in result.stderr
    for part in texts:
        assert part in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_budget_that_is_exceeded_fails_the_build(tmp_path: Path) -> None:
    tree = TREE.format(nodes="    <Ready/>", model=MODEL)
    result = compile_tree(tmp_path, tree, NAO / "nao.dbc", "--max-ram", "100")
    assert result.exit_code == 2
    assert "RAM budget exceeded" in result.stderr
    assert not (tmp_path / "out").exists()


def test_the_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    tree = TREE.format(nodes="    <Sequence><Ready/><Go speed='3'/><Go speed='4'/></Sequence>", model=MODEL)
    outputs = []
    for _ in range(2):
        assert compile_tree(tmp_path, tree).exit_code == 0
        outputs.append({file.name: file.read_bytes() for file in (tmp_path / "out").iterdir()})
    assert outputs[0] == outputs[1]
    assert sorted(outputs[0]) == [
        "main.model.json",
        "main_app.c",
        "main_app.h",
        "main_bus.c",
        "main_bus.h",
        "main_leaves.h",
        "nao.dbc",
    ]
