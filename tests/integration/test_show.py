# SPDX-License-Identifier: MIT
"""`canopy show`: in the terminal, as SVG, as DOT."""

from __future__ import annotations

import itertools
import random
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.errors import Place
from canopy.compiler.node_types import node_types
from canopy.compiler.port_types import ANY_TYPE
from canopy.compiler.tree import Node
from canopy.compiler.tree_reader import read_tree
from canopy.show.layout import GAP_X, Box, place
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


UNFINISHED = """\
<root{format}>
  <BehaviorTree ID="A"><SequenceStar foo="1">
    <IsDoorOpen/><Timeout><OpenDoor speed="fast"/></Timeout><SubTree ID="Gone"/><SubTree ID="Part"/>
    <Recovery><Go/><Go/></Recovery>
  </SequenceStar></BehaviorTree>
  <BehaviorTree ID="B"><Fly/></BehaviorTree>
  <BehaviorTree ID="Part"><Script code="a <= b"/></BehaviorTree>
  <TreeNodesModel><Action/></TreeNodesModel>
</root>
""".replace("<=", "&lt;=")


@pytest.mark.parametrize("version", [' BTCPP_format="4"', ' BTCPP_format="3"', ' main_tree_to_execute="None"', ""])
def test_what_does_not_compile_is_drawn_as_far_as_it_can_be(tmp_path: Path, version: str) -> None:
    file = tmp_path / "wild.xml"
    file.write_text(UNFINISHED.replace("{format}", version), encoding="utf-8")
    result = CliRunner().invoke(main, ["show", str(file)])
    assert result.exit_code == 0, result.output
    assert result.stdout == (
        "A\nSequenceStar\n├── (IsDoorOpen)\n├── δ Timeout\n│   └── [OpenDoor]\n├── [SubTree Gone]\n├── [Script]\n"
        "└── Recovery\n    ├── [Go]\n    └── [Go]\nB\n[Fly]\n"
    )
    assert "would not compile" in result.stderr
    one = CliRunner().invoke(main, ["show", str(file), "--main-tree", "B"])
    assert one.stdout == "B\n[Fly]\n"
    drawn = CliRunner().invoke(main, ["show", str(file), "--dot", "-"])
    assert drawn.exit_code == 0 and "for another tree: --main-tree B" in drawn.stderr


@pytest.mark.timeout(60)
def test_a_chain_as_deep_as_the_compiler_takes_is_drawn(tmp_path: Path) -> None:
    file = tmp_path / "chain.xml"
    levels = 30_000
    inner = "<Inverter>" * levels + "<AlwaysSuccess/>" + "</Inverter>" * levels
    file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="M">{inner}</BehaviorTree></root>')
    result = CliRunner().invoke(main, ["show", str(file), "--svg", str(tmp_path / "chain.svg")])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "chain.svg").read_text().count("<rect") == levels + 2
    result = CliRunner().invoke(main, ["show", str(file)])
    assert result.stdout.splitlines()[-1] == f"{levels} └── [AlwaysSuccess]"
    assert max(map(len, result.stdout.splitlines())) < 300


def test_outlines_are_as_close_as_they_come() -> None:
    """Against a plain computation: each level's ends, moved and merged."""
    rng = random.Random(20261130)
    kind = node_types()["Sequence"]
    for _ in range(40):
        boxes = [Box(Node(kind, "n", Place("x")), rng.choice([20.0, 60.0, 100.0]), 20.0, 0)]
        for _ in range(rng.randrange(30)):
            above = rng.choice(boxes)
            boxes.append(Box(Node(kind, "n", Place("x")), rng.choice([20.0, 60.0, 100.0]), 20.0, above.depth + 1))
            above.children.append(boxes[-1])
        order: list[Box] = []
        waiting = [boxes[0]]
        while waiting:
            order.append(waiting.pop())
            waiting.extend(reversed(order[-1].children))
        place(order)
        for level in range(max(box.depth for box in order) + 1):
            row = sorted((box for box in order if box.depth == level), key=lambda box: box.x)
            assert row == [box for box in order if box.depth == level]
            for one, other in itertools.pairwise(row):
                assert other.x - other.width / 2 - (one.x + one.width / 2) >= GAP_X - 1e-6
        for box in order:
            if box.children:
                assert abs(box.x - (box.children[0].x + box.children[-1].x) / 2) < 1e-6
            for child in box.children[1:]:  # it touches what stands left of it, somewhere
                levels = range(child.depth, 1 + max(other.depth for other in order))
                mine, left = _below(child), _left_of(box, child)
                gaps = []
                for level in levels:
                    a = [o.x - o.width / 2 for o in mine if o.depth == level]
                    b = [o.x + o.width / 2 for o in left if o.depth == level]
                    gaps += [min(a) - max(b)] if a and b else []
                assert min(gaps) == pytest.approx(GAP_X)


def _below(box: Box) -> list[Box]:
    found, waiting = [], [box]
    while waiting:
        found.append(waiting.pop())
        waiting.extend(found[-1].children)
    return found


def _left_of(parent: Box, child: Box) -> list[Box]:
    before = parent.children[: next(i for i, other in enumerate(parent.children) if other is child)]
    return [box for sibling in before for box in _below(sibling)]
