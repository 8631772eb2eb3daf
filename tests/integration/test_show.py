# SPDX-License-Identifier: MIT
"""`canopy show`: in the terminal, as SVG, as DOT."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.node_types import node_types
from canopy.compiler.port_types import ANY_TYPE
from canopy.compiler.tree_reader import read_tree
from canopy.show.layout import Box, place
from canopy.show.order import in_order
from canopy.show.symbols import look
from canopy.show.terminal import lines

REPOSITORY = Path(__file__).parents[2]
TREES = sorted(file for file in REPOSITORY.glob("examples/**/*.xml") if "<BehaviorTree" in file.read_text())
SVG = "{http://www.w3.org/2000/svg}"

TREE = """\
<root BTCPP_format="4">
  <BehaviorTree ID="Main">
    <ReactiveFallback name="Do &lt;it&gt;">
      <Sequence><Ready/><RetryUntilSuccessful num_attempts="3"><Go name="Go now"/></RetryUntilSuccessful></Sequence>
      <ReactiveParallel success_count="1"><Go/><Sleep msec="5"/></ReactiveParallel>
    </ReactiveFallback>
  </BehaviorTree>
  <TreeNodesModel><Condition ID="Ready"/><Action ID="Go"/></TreeNodesModel>
</root>
"""
TERMINAL = """\
Main
? Do <it>
├── →*
│   ├── (Ready)
│   └── δ RetryUntilSuccessful 3
│       └── [Go now]
└── ⇉ [1]
    ├── [Go]
    └── [Sleep 5]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "main.xml"
    path.write_text(TREE)
    return path


def show(*arguments: object) -> str:
    result = CliRunner().invoke(main, ["show", *map(str, arguments)])
    assert result.exit_code == 0, result.output
    return result.output


def test_in_a_pipe_it_is_plain_text(file: Path) -> None:
    assert show(file) == TERMINAL


def test_nodes_of_the_users_own_have_their_names_and_any_type(tmp_path: Path) -> None:
    file = tmp_path / "own.xml"
    file.write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="Main"><Recovery name="Plan"><Rate><Go path="{p}"/></Rate></Recovery>'
        '</BehaviorTree><TreeNodesModel><Control ID="Recovery"/><Decorator ID="Rate"/>'
        '<Action ID="Go"><output_port name="path" type="std::vector&lt;Pose&gt;"/></Action></TreeNodesModel></root>'
    )
    assert show(file) == "Main\nRecovery Plan\n└── δ Rate\n    └── [Go]\n"


def test_ascii_where_nothing_else_can_be_encoded(file: Path) -> None:
    text = "\n".join(line.plain for line in lines(read_tree(file), ascii_only=True))
    assert text.isascii()
    assert "|   `-- d RetryUntilSuccessful 3" in text
    assert "`-- => [1]" in text


def test_on_a_terminal_it_has_colours(file: Path) -> None:
    assert any(line.spans for line in lines(read_tree(file)))


@pytest.mark.parametrize("tree", TREES, ids=[tree.stem for tree in TREES])
def test_the_svg_has_every_node_once_and_none_overlap(tree: Path) -> None:
    root = ET.fromstring(show(tree, "--svg", "-"))
    nodes = root.findall(f"{SVG}g")[1:]
    assert len(nodes) == len(list(in_order(read_tree(tree, ANY_TYPE).root)))
    assert len(root.findall(f".//{SVG}path")) == len(nodes) - 1
    left, top, width, height = map(float, root.attrib["viewBox"].split())
    areas: list[tuple[float, float, float, float]] = []
    for node in nodes:
        rect, ellipse = node.find(f"{SVG}rect"), node.find(f"{SVG}ellipse")
        if rect is not None:
            x, y, w, h = (float(rect.attrib[name]) for name in ("x", "y", "width", "height"))
        else:
            assert ellipse is not None
            cx, cy, rx, ry = (float(ellipse.attrib[name]) for name in ("cx", "cy", "rx", "ry"))
            x, y, w, h = cx - rx, cy - ry, 2 * rx, 2 * ry
        assert x >= left and y >= top and x + w <= left + width and y + h <= top + height
        assert not any(x < ox + ow and ox < x + w and y < oy + oh and oy < y + h for ox, oy, ow, oh in areas)
        areas.append((x, y, w, h))


def test_the_svg_says_what_and_where(file: Path, tmp_path: Path) -> None:
    assert show(file, "--svg", tmp_path / "a.svg") == ""
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert "<title>ReactiveFallback 'Do &lt;it&gt;', line 3</title>" in text
    assert [sign for sign in ("→*", "?", "⇉", "δ") if f">{sign}</text>" not in text] == []
    assert text.count("<ellipse") == 1


def test_dot(file: Path, tmp_path: Path) -> None:
    text = show(file, "--dot", "-")
    assert text.startswith('digraph "Main" {\n')
    assert re.findall(r"n(\d) -> n(\d);", text) == [tuple(e) for e in ("01", "12", "13", "34", "05", "56", "57")]
    assert 'n2 [label="Ready", shape=ellipse' in text
    assert 'n1 [label="→*", shape=box' in text
    assert show(file, "--svg", tmp_path / "a.svg", "--dot", tmp_path / "a.dot") == ""
    assert (tmp_path / "a.dot").read_text(encoding="utf-8") == text


def test_parents_stand_above_the_middle_of_their_children(file: Path) -> None:
    root = read_tree(file).root
    boxes = [Box(node, 10, 10, depth) for node, _, depth in in_order(root)]
    made = {id(box.node): box for box in boxes}
    for node, parent, _ in in_order(root):
        if parent is not None:
            made[id(parent)].children.append(made[id(node)])
    place(boxes)
    for box in boxes:
        if box.children:
            assert box.x == pytest.approx((box.children[0].x + box.children[-1].x) / 2)


def test_every_type_of_node_has_a_look() -> None:
    from canopy.compiler.errors import Place
    from canopy.compiler.tree_reader import Node

    for kind in node_types().values():
        node = Node(kind, "x", Place("x"), tuple(0 for _ in kind.parameters))
        shown = look(node)
        assert bool(shown.sign) == (kind.category != "LEAF")
        assert look(node, ascii_only=True).sign.isascii()


def test_errors(file: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["show", str(tmp_path / "none.xml")])
    assert result.exit_code == 2
    assert "cannot be read" in result.stderr
    result = CliRunner().invoke(main, ["show", str(file), "--svg", str(tmp_path / "no" / "a.svg")])
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr


def test_a_deep_tree_is_drawn(tmp_path: Path) -> None:
    file = tmp_path / "deep.xml"
    deep = "<Inverter>" * 2_000 + "<AlwaysSuccess/>" + "</Inverter>" * 2_000
    file.write_text(f"<root BTCPP_format='4'><BehaviorTree ID='T'>{deep}</BehaviorTree></root>")
    assert show(file).count("\n") == 2_002
    assert show(file, "--svg", "-").count("<g>") == 2_001


def test_a_tree_with_types_of_the_users_own() -> None:
    shown = show(REPOSITORY / "tests" / "unit" / "language" / "main.xml")
    assert "TryCatch [catch_on_halt]" in shown
    assert "[TestNode return_status=3 async_delay=0 failure_script=stand_in = 2 post_script=posts += 1]" in shown
    floating = REPOSITORY / "tests" / "unit" / "floating" / "main.xml"
    assert "[Measure]" in show(floating)
    wrong = CliRunner().invoke(main, ["show", str(floating), "--ros-package", "x"])
    assert (wrong.exit_code, "'x' is not NAME=DIR" in wrong.output) == (2, True)
