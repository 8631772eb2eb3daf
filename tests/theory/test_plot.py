# SPDX-License-Identifier: MIT
"""`canopy plot phase` draws what the models say: fills, arrows and runs against equations written out here."""

from __future__ import annotations

import io
import random
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import matplotlib as mpl
import pytest
from click.testing import CliRunner
from matplotlib.image import imread

from canopy.cli import main
from canopy.plot import draw as drawing
from canopy.plot.geometry import outline
from canopy.plot.portrait import Portrait, portrait
from canopy.verify.linear import State
from canopy.verify.run import load, model_path
from theory.figures import DOOR, FIGURES, FOLDER, HOME, POWER, ROOT, SHUT, UAV, draw

POINTS = 200
WINDOW = 4
"""Pixels on each side of a point that are looked at: more than an arrow's shaft or a hatch's line covers."""
Does = tuple[str, Fraction, Fraction]


def exact(text: str) -> Fraction:
    return Fraction(text)


def example_1(place: Fraction, door: Fraction) -> Does:
    if door < 80:
        return "Open Front Door", exact("0"), exact("10")
    return ("SUCCESS", exact("0"), exact("0")) if place >= 1 else ("Pass through Door", exact("0.5"), exact("0"))


def example_2(place: Fraction, door: Fraction) -> Does:
    if place >= 1:
        return "SUCCESS", exact("0"), exact("0")
    if door >= 80:
        return "Pass through Door", exact("0.5"), exact("0")
    return ("FAILURE", exact("0"), exact("0")) if place < -4 else ("Open Front Door", exact("0"), exact("10"))


def task(x1: Fraction, x2: Fraction) -> Does:
    if x2 >= exact("0.1"):
        return "Do Other Task", (50 - x1) / 50, exact("-0.1")
    return "Do Other Task [empty]", (50 - x1) / 50, -x2


def guard(x1: Fraction, x2: Fraction) -> Does:
    if x2 >= 100 or (x1 >= exact("0.1") and x2 > 20):
        return "SUCCESS", exact("0"), exact("0")
    if x1 < exact("0.1"):
        return "Guarantee Power Supply [charge]", exact("0"), exact("1")
    if x2 >= exact("0.1"):
        return "Guarantee Power Supply [drive]", exact("-1"), exact("-0.1")
    return "Guarantee Power Supply [drive, empty]", exact("-1"), -x2


def example_4(x1: Fraction, x2: Fraction) -> Does:
    first = guard(x1, x2)
    return task(x1, x2) if first[0] == "SUCCESS" else first


def walk(x1: Fraction, x2: Fraction) -> Does:
    if x1 <= 0:
        return "SUCCESS", exact("0"), exact("0")
    return ("FAILURE", exact("0"), exact("0")) if x2 < exact("0.48") else ("Walk Home", exact("-0.1"), exact("0"))


def stand(_x1: Fraction, x2: Fraction) -> Does:
    if x2 >= exact("0.48"):
        return "SUCCESS", exact("0"), exact("0")
    return ("FAILURE", exact("0"), exact("0")) if x2 < exact("0.3") else ("Sit to Stand", exact("0"), exact("0.05"))


def sit(_x1: Fraction, x2: Fraction) -> Does:
    if x2 >= exact("0.3"):
        return "SUCCESS", exact("0"), exact("0")
    return "Lie down to Sit up", exact("0"), exact("0.03")


def example_5(x1: Fraction, x2: Fraction) -> Does:
    does = [child(x1, x2) for child in (walk, stand, sit)]
    return next(one for one in does if one[0] != "FAILURE")


CASES: dict[str, tuple[str, str | None, Callable[[Fraction, Fraction], Does]]] = {
    "fig12": (DOOR, None, example_1),
    "fig15": (SHUT, None, example_2),
    "fig26": (POWER, "Guarantee Power Supply", guard),
    "fig27": (POWER, "Do Other Task", task),
    "fig28": (POWER, None, example_4),
    "fig30": (HOME, "Walk Home", walk),
    "fig31": (HOME, "Sit to Stand", stand),
    "fig32": (HOME, "Lie down to Sit up", sit),
    "fig33": (HOME, None, example_5),
}


def of(tree: str, node: str | None = None, runs: tuple[str, ...] = (), steps: int = 1_000) -> Portrait:
    return portrait(load(ROOT / tree, model_path(ROOT / tree)), node, runs, steps)


def somewhere(source: random.Random, made: Portrait) -> State:
    return tuple(one.low + (one.high - one.low) * Fraction(source.randint(0, 10**6), 10**6) for one in made.axes)


def fill(made: Portrait, label: str) -> tuple[int, ...]:
    colour = drawing.FILLS[next(one.fill for one in made.regions if one.label == label)][0]
    return tuple(bytes.fromhex(colour[1:]))


@pytest.mark.parametrize("name", CASES)
def test_colours_are_those_of_the_regions(name: str) -> None:
    tree, node, does = CASES[name]
    made = of(tree, node)
    fills = {fill(made, one.label) for one in made.regions}
    assert len(fills) == len(made.regions)
    image = imread(io.BytesIO(drawing.rendered(made, "png")))
    source, seen = random.Random(name), 0
    inner = (drawing.INNER_WIDTH * drawing.DPI, drawing.INNER_HEIGHT * drawing.DPI)
    room = (drawing.MARGIN * inner[0], drawing.MARGIN * inner[1])
    pixel = [(one.high - one.low) / Fraction(size) for one, size in zip(made.axes, inner, strict=True)]
    while seen < POINTS:
        state = somewhere(source, made)
        around = [
            (state[0] + i * (WINDOW + 2) * pixel[0], state[1] + k * (WINDOW + 2) * pixel[1])
            for i in (-1, 1)
            for k in (-1, 1)
        ]
        label = does(*state)[0]
        if any(
            does(*corner)[0] != label or not one.low <= x <= one.high
            for corner in around
            for one, x in zip(made.axes, corner, strict=True)
        ):
            continue  # at a border
        x, y = (float((value - one.low) / size) for value, one, size in zip(state, made.axes, pixel, strict=True))
        column = int(drawing.LEFT * drawing.DPI + room[0] + x)
        row = int(drawing.TOP * drawing.DPI + room[1] + inner[1] - y)
        window = image[row - WINDOW : row + WINDOW + 1, column - WINDOW : column + WINDOW + 1, :3]
        found = {tuple(round(float(value) * 255) for value in one) for line in window for one in line}
        assert found & fills == {fill(made, label)}, f"{name}, {state}: not {label}"
        seen += 1


@pytest.mark.parametrize("name", CASES)
def test_regions_and_arrows_are_those_of_the_equations(name: str) -> None:
    tree, node, does = CASES[name]
    made = of(tree, node)
    source = random.Random(name)
    borders = [corner for one in made.regions for polygon in one.polygons for corner in polygon]
    for state in [*borders, *(somewhere(source, made) for _ in range(POINTS))]:
        label, *step = does(*state)
        assert [one.label for one in made.regions if one.holds(state)] == [label], state
        arrow = made.arrow(state)
        assert (list(arrow.step or ()) if arrow is not None else [0, 0]) == step, state


def area(polygon: tuple[State, ...]) -> Fraction:
    pairs = zip(polygon, (*polygon[1:], polygon[0]), strict=True)
    return sum((a[0] * b[1] - a[1] * b[0] for a, b in pairs), Fraction(0)) / 2


@pytest.mark.parametrize("tree", [DOOR, SHUT, UAV, POWER, HOME])
def test_polygons_fill_the_state_space_once(tree: str) -> None:
    made = of(tree)
    polygons = [polygon for one in made.regions for polygon in one.polygons]
    assert all(area(polygon) > 0 for polygon in polygons if len(polygon) > 2)
    x, y = made.axes
    assert sum(area(polygon) for polygon in polygons) == (x.high - x.low) * (y.high - y.low)


def test_corners_are_exact() -> None:
    region = next(one for one in of(HOME).regions if one.label == "Walk Home")
    low, high, end = exact("0.48"), exact("0.55"), exact("0.5")
    assert set(region.polygons[0]) == {(0, low), (end, low), (end, high), (0, high)}


def test_an_outline_has_no_edge_between_two_parts() -> None:
    def box(x: int, y: int, width: int, height: int) -> tuple[State, ...]:
        corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
        return tuple((Fraction(a), Fraction(b)) for a, b in corners)

    edges = outline([box(0, 0, 4, 2), box(1, 2, 1, 1)])
    top = sorted((int(b[0]), int(a[0])) for a, b in edges if a[1] == b[1] == 2)
    assert top == [(0, 1), (2, 4)]
    assert sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in edges) == 14


@pytest.mark.parametrize(
    ("tree", "does", "start", "most"),
    [
        (HOME, example_5, ("0.5", "0"), 1_000),
        (HOME, example_5, ("0.3", "0.4"), 1_000),
        (POWER, example_4, ("80", "50"), 500),
        (SHUT, example_2, ("-3", "20"), 1_000),
    ],
)
def test_runs_are_drawn_as_the_equations_go(
    tree: str, does: Callable[[Fraction, Fraction], Does], start: tuple[str, str], most: int
) -> None:
    names = [one.name for one in of(tree).axes]
    made = of(tree, None, (",".join(f"{n}={v}" for n, v in zip(names, start, strict=True)),), most)
    state = (exact(start[0]), exact(start[1]))
    expected = [state]
    while len(expected) <= most and does(*state)[0] not in ("SUCCESS", "FAILURE"):
        _, across, up = does(*state)
        state = (state[0] + across, state[1] + up)
        expected.append(state)
    assert [visit.state for visit in made.runs[0].visits] == expected
    assert made.runs[0].ended == (does(*state)[0] == "SUCCESS")
    lines = {line.get_gid(): line for line in drawing.figure(made).axes[0].get_lines()}
    x, y = lines["run0"].get_data()
    assert list(zip(map(float, x), map(float, y), strict=True)) == [(float(a), float(b)) for a, b in expected]
    assert [float(value[0]) for value in lines["run0-end"].get_data()] == [float(value) for value in state]
    assert lines["run0-end"].get_marker() == ("s" if made.runs[0].ended else ">")


def test_what_the_model_leaves_open_has_no_arrow() -> None:
    made = of(UAV)
    arrow = made.arrow((Fraction(5_000), Fraction(3_000)))
    assert arrow is not None
    assert arrow.step is None
    assert made.region_at((Fraction(0), Fraction(1_001))).label == "SUCCESS or Perform Mission or FAILURE"
    assert made.disturbed


@pytest.mark.parametrize("name", FIGURES)
def test_figures_of_the_docs_are_up_to_date(name: str, tmp_path: Path) -> None:
    draw(name, tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_bytes() == (FOLDER / f"{name}.svg").read_bytes(), "run: make figures"


def test_docs_show_each_figure_and_no_other() -> None:
    text = (ROOT / "docs" / "plot.md").read_text(encoding="utf-8")
    assert sorted(path.stem for path in FOLDER.iterdir()) == sorted(FIGURES)
    assert all(f"(figures/{name}.svg)" in text for name in FIGURES)


@pytest.mark.parametrize("form", drawing.FORMATS)
def test_the_same_bytes_whatever_the_users_settings_are(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = of(HOME, None, ("x1=0.5,x2=0",))
    first = drawing.rendered(made, form)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 20, "svg.hashsalt": "other", "text.usetex": True}):
        assert drawing.rendered(made, form) == first


LINE_MODEL = """format = 1
[variables.x]
unit = "m"
range = [0, 10]
[variables.y]
unit = ""
range = [0, 10]
[leaves.A]
success = "x == 5"
failure = "x > 5 and y == 3 and x == 7"
running = "else"
[[leaves.A.modes]]
next = { y = "0" }
"""
LINE_TREE = """<root BTCPP_format="4"><BehaviorTree ID="T"><A name="{name}"/></BehaviorTree>
<TreeNodesModel><Action ID="A"/></TreeNodesModel></root>
"""


def test_lines_points_and_strange_names_are_drawn(tmp_path: Path) -> None:
    tree, out = tmp_path / "t.xml", tmp_path / "t.svg"
    tree.write_text(LINE_TREE.format(name=r"$\frac{ &lt;b&gt; %s {0}"), encoding="utf-8")
    model_path(tree).write_text(LINE_MODEL, encoding="utf-8")
    result = CliRunner().invoke(main, ["plot", "phase", str(tree), "-o", str(out), "-o", str(tmp_path / "t.png")])
    assert result.exit_code == 0, result.output
    ElementTree.fromstring(out.read_bytes())
    shapes = {
        one.label: sorted(map(len, one.polygons)) for one in portrait(load(tree, model_path(tree)), None, (), 1).regions
    }
    assert shapes["SUCCESS"] == [2]
    assert shapes["FAILURE"] == [1]
    image = imread(io.BytesIO((tmp_path / "t.png").read_bytes()))
    found = {tuple(round(float(value) * 255) for value in one[:3]) for line in image[:550] for one in line}
    assert {(0xD3, 0xEF, 0xE3), (0xD9, 0xD9, 0xD9)} <= found


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["examples/papers/trees/fig34.xml", "-o", "{}/x.svg"], "the model has 6 variables; a phase portrait has two"),
        ([HOME, "--of", "Walk Hom", "-o", "{}/x.svg"], "--of: the tree has no node 'Walk Hom'"),
        ([HOME, "--run", "x1=0.5", "-o", "{}/x.svg"], "'x1=0.5' does not give each of x1, x2"),
        ([HOME, "--run", "x1=0.5,x1=0", "-o", "{}/x.svg"], "'x1=0.5,x1=0' is not a state"),
        ([HOME, "--run", "x1=a,x2=0", "-o", "{}/x.svg"], "'a' is not a number"),
        ([HOME, "--run", "x1=1/0,x2=0", "-o", "{}/x.svg"], "'1/0' is not a number"),
        ([HOME, "--run", "x1=9,x2=0", "-o", "{}/x.svg"], "is outside of the state space"),
        ([HOME, "-o", "{}/x.pdf"], "expected a name that ends in .svg or .png"),
        ([HOME, "-o", "{}/none/x.svg"], "cannot be written: No such file or directory"),
        ([HOME, "--model", "{}/none.toml", "-o", "{}/x.svg"], "cannot be read"),
        ([HOME], "Missing option '-o'"),
    ],
)
def test_wrong_input_is_named_and_nothing_is_written(arguments: list[str], message: str, tmp_path: Path) -> None:
    words = [str(ROOT / word) if word.startswith("examples/") else word.format(tmp_path) for word in arguments]
    result = CliRunner().invoke(main, ["plot", "phase", *words])
    assert result.exit_code == 2
    assert message in result.output
    assert not list(tmp_path.iterdir())


def test_more_regions_than_fills(tmp_path: Path) -> None:
    tree = tmp_path / "t.xml"
    tree.write_text(LINE_TREE.format(name="many"), encoding="utf-8")
    modes = "".join(
        f'[[leaves.A.modes]]\nname = "m{k}"\nwhen = "{k} <= x < {k + 1}"\nnext = {{ y = "0" }}\n' for k in range(15)
    )
    text = LINE_MODEL.replace("range = [0, 10]", "range = [0, 14]", 1).partition("success")[0]
    model_path(tree).write_text(f'{text}running = "true"\n{modes}', encoding="utf-8")
    result = CliRunner().invoke(main, ["plot", "phase", str(tree), "-o", str(tmp_path / "t.svg")])
    assert result.exit_code == 2
    assert "'many' has 15 kinds of region" in result.output
    assert "--of NODE" in result.output


def test_without_matplotlib_the_message_names_the_extra() -> None:
    program = "import sys; sys.modules['matplotlib'] = None; from canopy.cli import main; main(['plot', 'phase'])"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert result.stderr == "canopy plot needs the Python package 'matplotlib': pip install 'canopy-bt[plot]'\n"
