# SPDX-License-Identifier: MIT
"""A phase portrait as PNG or SVG, by matplotlib. The same portrait gives the same bytes."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from canopy.escape.visible import visible
from canopy.plot.portrait import Arrow, Portrait
from canopy.verify.linear import State
from canopy.verify.model import Variable
from canopy.verify.simulate import Run

FORMATS = ("png", "svg")
DPI = 150
WIDTH, HEIGHT = 4.6, 3.4
"""Of the axes [inch]."""
LEFT, BOTTOM, TOP = 0.75, 0.62, 0.35
"""Room around them [inch]; the legend is below."""
LINE = 0.18
MARGIN = 0.03
INNER_WIDTH, INNER_HEIGHT = WIDTH / (1 + 2 * MARGIN), HEIGHT / (1 + 2 * MARGIN)
"""Of the state space [inch]."""
COLUMNS, ROWS = 14, 11
ARROW = 0.19
MAX_TEXT = 60

# Tints of Okabe and Ito's colours, which the colour-blind can tell apart. In grey the hatches tell them apart.
# The first two are those of SUCCESS and FAILURE (portrait.py).
FILLS = (
    ("#d3efe3", ""),
    ("#d9d9d9", "xx"),
    ("#fbdda3", "//"),
    ("#b3d9f2", "|"),
    ("#f4c3a5", "\\\\"),
    ("#f8f4b0", "-"),
    ("#e8c6da", "||"),
    ("#9fc3de", "--"),
    ("#a5d5c4", "/"),
    ("#efb86f", "+"),
    ("#c79ab5", "\\"),
    ("#bcbcbc", "++"),
)
HATCH, BORDER, ARROWS = "#8c8c8c", "#303030", "#202020"
RUNS = ("#0050a0", "#a02000", "#5c2d6e", "#00543f")
DASHES = ("-", (0, (5, 1.6)), (0, (1.5, 1.2)), (0, (6, 1.5, 1.5, 1.5)))
ARROW_MARK = Path([(-1, 0), (1, 0), (0.3, 0.35), (1, 0), (0.3, -0.35)], [1, 2, 1, 2, 2])
ENDS = {"goal": "s", "cut": ">", "other": "X"}


@contextmanager
def _settings() -> Iterator[None]:
    """Matplotlib's own defaults, whatever the user's are; texts are texts, not formulas."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(
            {
                "font.size": 9,
                "text.parse_math": False,
                "axes.unicode_minus": False,
                "hatch.linewidth": 0.5,
                "svg.hashsalt": "canopy",
                "svg.fonttype": "path",
            }
        )
        yield


def _text(text: str) -> str:
    text = visible(text)
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 1] + "…"


def _floats(state: State) -> tuple[float, float]:
    return float(state[0]), float(state[1])


def _axis(one: Variable) -> str:
    return _text(one.name) + (f" [{visible(str(one.unit))}]" if one.unit.powers else "")


def _limits(one: Variable) -> tuple[float, float]:
    room = float(one.high - one.low) * MARGIN
    return float(one.low) - room, float(one.high) + room


def _regions(axes: Axes, portrait: Portrait) -> list[Patch]:
    """Fills, and borders around what is filled alike; returns the legend's entries."""
    entries = []
    for region in portrait.regions:
        colour, hatch = FILLS[region.fill]
        for polygon in region.polygons:
            at = [_floats(corner) for corner in polygon]
            if len(at) > 2:
                axes.add_patch(Polygon(at, facecolor=colour, edgecolor=HATCH, hatch=hatch, linewidth=0, zorder=1))
            else:  # a line or a point: it would be invisible as an area
                axes.plot(*zip(*at, strict=True), color=colour, marker="o", markersize=4, linewidth=4, zorder=3)
        entries.append(Patch(facecolor=colour, edgecolor=HATCH, hatch=hatch, linewidth=0, label=_text(region.label)))
    lines = [[_floats(a), _floats(b)] for region in portrait.regions for a, b in region.borders]
    axes.add_collection(LineCollection(lines, colors=BORDER, linewidths=1.1, capstyle="round", zorder=2))
    return entries


def _arrows(axes: Axes, portrait: Portrait, field: Sequence[Arrow]) -> None:
    """The direction of the steps. All arrows have one length; those that would leave the state space are left out."""
    spans = [one.high - one.low for one in portrait.axes]
    heads: list[tuple[float, float, float, float]] = []
    for arrow in field:
        if arrow.step is None:
            continue
        across, up = (float(arrow.step[i] / spans[i]) * size for i, size in enumerate((INNER_WIDTH, INNER_HEIGHT)))
        length = (across**2 + up**2) ** 0.5
        across, up = across / length * ARROW, up / length * ARROW
        at = [float((x - one.low) / span) for x, one, span in zip(arrow.state, portrait.axes, spans, strict=True)]
        reach = (abs(across) / 2 / INNER_WIDTH, abs(up) / 2 / INNER_HEIGHT)
        if all(low <= x <= 1 - low for x, low in zip(at, reach, strict=True)):
            heads.append((*_floats(arrow.state), across, up))
    if heads:
        x, y, u, v = zip(*heads, strict=True)
        axes.quiver(
            x, y, u, v, color=ARROWS, angles="uv", scale_units="inches", scale=1, width=0.012, units="inches",
            pivot="middle", headwidth=4.5, headlength=5, headaxislength=4.5, zorder=4,
        )  # fmt: skip
    crosses = [_floats(arrow.state) for arrow in field if arrow.step is None]
    if crosses:
        axes.plot(*zip(*crosses, strict=True), linestyle="", marker="+", color=ARROWS, markersize=6, zorder=4)


def _arrow_entries(portrait: Portrait, field: Sequence[Arrow]) -> list[Line2D]:
    """What the legend says of them."""
    entries = []
    if any(arrow.step is not None for arrow in field):
        label = "direction of the step" + (", without the disturbance" if portrait.disturbed else "")
        entries.append(Line2D([], [], color=ARROWS, linestyle="", marker=ARROW_MARK, markersize=13, label=label))
    if any(arrow.step is None for arrow in field):
        entries.append(Line2D([], [], color=ARROWS, linestyle="", marker="+", label="the model leaves the step open"))
    return entries


def _end(run: Run) -> str:
    return "goal" if run.ended else "cut" if run.cut else "other"


def _run(axes: Axes, run: Run, index: int) -> Line2D:
    """A run, from a disc to what its end says; returns the legend's entry."""
    colour, dash = RUNS[index % len(RUNS)], DASHES[index % len(DASHES)]
    x, y = zip(*(_floats(visit.state) for visit in run.visits), strict=True)
    halo = [withStroke(linewidth=3.4, foreground="white")]
    axes.plot(x, y, color=colour, linestyle=dash, linewidth=1.7, zorder=5, path_effects=halo, gid=f"run{index}")
    for at, marker in ((0, "o"), (-1, ENDS[_end(run)])):
        axes.plot(
            x[at], y[at], marker=marker, color=colour, markersize=7, markeredgecolor="white", zorder=6, clip_on=False,
            gid=f"run{index}-{'start' if at == 0 else 'end'}",
        )  # fmt: skip
    count = len(run.visits) - 1
    what = f"run: SUCCESS after {count} steps" if run.ended else f"run: {count} steps; {run.why}"
    return Line2D([], [], color=colour, linestyle=dash, linewidth=1.7, marker=ENDS[_end(run)], label=_text(what))


def figure(portrait: Portrait) -> Figure:
    """The figure, for rendered(), whose settings it needs."""
    field = portrait.field(COLUMNS, ROWS)
    more = _arrow_entries(portrait, field)
    below = BOTTOM + (len(portrait.regions) + len(portrait.runs) + len(more)) * LINE
    size = (LEFT + WIDTH + 0.2, below + HEIGHT + TOP)
    made = Figure(figsize=size, dpi=DPI, facecolor="white")
    axes = made.add_axes((LEFT / size[0], below / size[1], WIDTH / size[0], HEIGHT / size[1]))
    entries: list[Patch | Line2D] = [*_regions(axes, portrait)]
    _arrows(axes, portrait, field)
    entries += [_run(axes, run, index) for index, run in enumerate(portrait.runs)]
    axes.set_xlabel(_axis(portrait.axes[0]))
    axes.set_ylabel(_axis(portrait.axes[1]))
    axes.set_title(_text(portrait.title), fontsize=10)
    axes.set_xlim(_limits(portrait.axes[0]))
    axes.set_ylim(_limits(portrait.axes[1]))
    made.legend(
        handles=[*entries, *more], loc="lower left", bbox_to_anchor=(LEFT / size[0], 0.0), frameon=False,
        borderaxespad=0.2, handlelength=2.2, handleheight=1.1, fontsize=8.5,
    )  # fmt: skip
    return made


def rendered(portrait: Portrait, form: str) -> bytes:
    """The bytes of a file of one of FORMATS."""
    target = io.BytesIO()
    metadata = {"Date": None, "Creator": None} if form == "svg" else {"Software": None}
    with _settings():
        figure(portrait).savefig(target, format=form, dpi=DPI, metadata=metadata)
    return target.getvalue()
