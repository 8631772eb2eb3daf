# SPDX-License-Identifier: MIT
"""How a watched controller looks in a terminal, as lines of text, and as JSON."""

from __future__ import annotations

import sys
from collections import Counter
from types import TracebackType
from typing import Protocol

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo, styled
from canopy.live.codes import NOTHING_KNOWN, NodeState, last_result, was_ticked
from canopy.live.words import health_words
from canopy.model import Node
from canopy.trace import Status, TreeView
from canopy.watch import Watch

_STYLES = {
    Status.UNKNOWN: "bright_black",
    Status.IDLE: "bright_black",
    Status.RUNNING: "bold yellow",
    Status.SUCCESS: "bold green",
    Status.FAILURE: "bold red",
    Status.SKIPPED: "magenta",
}
_SYMBOLS = {"Sequence": ("→", "->"), "Fallback": ("?", "?"), "Parallel": ("⇉", "=>")}
_LEAF_NAMES_IN_A_LINE = 6
_VALUES_IN_A_LINE = 6
_REDRAW_S = 0.1


def symbol(node: Node, ascii_only: bool = False) -> str:
    """The paper's sign of a control node; the type's name for others that have children."""
    for part, signs in _SYMBOLS.items():
        if node.category == "control" and part in node.type:
            return signs[ascii_only]
    return node.type


def line(watch: Watch, now: float) -> str:
    """The controller in one line without colours: tick, leaves that are not idle, signals, what was lost."""
    view = watch.view
    if view is None:
        return f"{watch.model.application}: no trace yet"
    active = [
        f"{node.name} {state.text}"
        for node, state in zip(watch.model.nodes, view.nodes, strict=True)
        if node.category in ("condition", "action") and state.status not in (Status.IDLE, Status.UNKNOWN)
    ]
    more = f", {len(active) - _LEAF_NAMES_IN_A_LINE} more" if len(active) > _LEAF_NAMES_IN_A_LINE else ""
    readings = watch.signals.readings(now)
    times = Counter(reading.signal for reading in readings)
    signals = ", ".join(
        f"{f'{reading.message}.' if times[reading.signal] > 1 else ''}{reading.signal} "
        f"{reading.text}{' (stale)' if reading.stale else ''}"
        for reading in readings
    )
    leaves = ", ".join(active[:_LEAF_NAMES_IN_A_LINE]) + more
    return (
        f"tick {view.tick} {view.root_status.name} [{leaves}] {signals}{_values(view)}; "
        f"{_pace(watch, now)}{_bus(view)}; {_losses(view)}"
        f"{'; THE CONTROLLER CLAIMS ANOTHER TREE' if watch.disagreement else ''}"
    )


def picture(watch: Watch, now: float, title: str, ascii_only: bool = False) -> RenderableType:
    """The controller as a picture for a terminal: tree, signals, one line on its health."""
    silent = watch.silent_for(now) is not None
    view = watch.view
    table = Table.grid(padding=(0, 1), expand=True)
    table.add_column(ratio=1)
    table.add_column(ratio=1)
    table.add_row(
        Panel(_tree(watch, silent, ascii_only), title=styled(watch.model.tree_id), title_align="left"),
        Group(
            Panel(_signals(watch, now), title="signals", title_align="left"),
            *([Panel(_value_table(view), title="values", title_align="left")] if view and view.values else []),
        ),
    )
    claim = [styled(watch.disagreement, style="bold red")] if watch.disagreement else []
    return Group(styled(title, style="bold"), table, *claim, _footer(watch, now))


def _tree(watch: Watch, silent: bool, ascii_only: bool) -> Tree:
    view = watch.view
    states = view.nodes if view else (NOTHING_KNOWN,) * len(watch.model.nodes)
    branches: list[Tree] = []
    for node in watch.model.nodes:
        label = _label(node, states[node.index], silent, ascii_only)
        branches.append(Tree(label) if node.parent is None else branches[node.parent].add(label))
    return branches[0]


def _label(node: Node, state: NodeState, silent: bool, ascii_only: bool) -> Text:
    style = _STYLES[last_result(state.code)] if state.certain and not silent else _STYLES[Status.UNKNOWN]
    if not was_ticked(state.code):
        style = style.replace("bold", "dim")
    if node.category == "control":
        head = f"{symbol(node, ascii_only)}  {node.name}"
    elif node.category == "condition":
        head = f"({node.name})"
    elif node.category == "action":
        head = f"[{node.name}]"
    else:
        head = f"<{node.type}> {node.name}"
    return styled((head, style), "  ", (state.text + _since(state), style))


def _since(state: NodeState) -> str:
    """Of a node that was not ticked: since when it is so."""
    if not state.certain or state.code <= 0 or was_ticked(state.code):
        return ""
    return f" since tick {state.since}{'' if state.exact else ' or before'}"


def _signals(watch: Watch, now: float) -> Table:
    table = Table.grid(padding=(0, 1))
    message = ""
    for reading in watch.signals.readings(now):
        if reading.message != message:
            message = reading.message
            direction = "sends" if reading.sent else "receives"
            table.add_row(styled(message, style="bold"), styled(direction, style="bright_black"))
        style = "red" if reading.stale else "bright_black" if reading.value is None else "cyan"
        table.add_row(
            styled(f"  {reading.signal}"), styled(reading.text + (" stale" if reading.stale else ""), style=style)
        )
    return table


def _value_table(view: TreeView) -> Table:
    table = Table.grid(padding=(0, 1))
    for state in view.values:
        table.add_row(styled(state.value.title), styled(state.text, style="cyan" if state.certain else "bright_black"))
    return table


def _values(view: TreeView) -> str:
    """What has been told, for a line."""
    told = [f"{state.value.title} {state.text}" for state in view.values if state.known is not None]
    more = f", {len(told) - _VALUES_IN_A_LINE} more" if len(told) > _VALUES_IN_A_LINE else ""
    return f"; {', '.join(told[:_VALUES_IN_A_LINE])}{more}" if told else ""


def _footer(watch: Watch, now: float) -> Text:
    view = watch.view
    if view is None:
        return styled("no trace yet", style="bold red")
    lossless = not (view.lost or view.refused)
    return styled(
        (f"tick {view.tick}  ", "bold"),
        (f"{view.root_status.name}  ", _STYLES[view.root_status]),
        (_pace(watch, now), "bold red" if watch.silent_for(now) is not None else ""),
        (_bus(view), "bold red"),
        "; ",
        (_losses(view), "" if lossless else "red"),
    )


def _pace(watch: Watch, now: float) -> str:
    silent = watch.silent_for(now)
    return f"SILENT for {silent:.1f} s" if silent is not None else f"{watch.rate(now):.1f} ticks/s"


def _losses(view: TreeView) -> str:
    text = f"{view.overruns} overruns, {view.lost} trace frames lost"
    if view.refused:
        text += f", {view.refused} refused"
    if view.crc_errors:
        text += f" ({view.crc_errors} of them CanopyTick with a wrong CRC)"
    if view.restarts:
        text += f", {view.restarts} restarts"
    health = health_words(view.health)
    return text + (f"; controller: {health}" if health else "")


def _bus(view: TreeView) -> str:
    """The state of the bus where it is not as it should be, else nothing."""
    return f"; bus {view.bus.text()}" if view.bus is not None and not view.bus.is_good else ""


class Display(Protocol):
    """Somewhere the watched controller is shown. A context: what it needs is set up and put back."""

    def __enter__(self) -> Display: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def show(self, watch: Watch, now: float, new_tick: bool, title: str = "") -> None:
        """Call this often; it shows what is due at the time `now` [s]."""


class LineDisplay:
    """Lines of text, or of JSON, every `period` seconds; 0: one for each tick."""

    def __init__(self, period: float, as_json: bool) -> None:
        self._period = period
        self._as_json = as_json
        self._due: float | None = None

    def __enter__(self) -> LineDisplay:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def show(self, watch: Watch, now: float, new_tick: bool, title: str = "") -> None:
        """Prints a line when one is due. The title is for pictures."""
        if self._period > 0:
            self._due = now + self._period if self._due is None else self._due
            if now < self._due:
                return
            self._due = now + self._period
        elif not new_tick:
            return
        # click.echo flushes, and writes no colours.
        echo(dumps(watch.snapshot(now)) if self._as_json else line(watch, now))


class LiveDisplay:
    """A picture that is redrawn in place, for a terminal."""

    def __init__(self) -> None:
        self._console = Console()
        self._ascii_only = self._console.options.ascii_only
        self._live = Live(console=self._console, auto_refresh=False, vertical_overflow="ellipsis")
        self._due = 0.0

    def __enter__(self) -> LiveDisplay:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def show(self, watch: Watch, now: float, new_tick: bool, title: str = "") -> None:
        """Redraws, at most ten times a second."""
        if now >= self._due:
            self._due = now + _REDRAW_S
            self._live.update(picture(watch, now, title, self._ascii_only), refresh=True)


def make_display(as_json: bool, period: float) -> Display:
    """A picture where stdout is a terminal, else lines every `period` seconds (0: one for each tick)."""
    if as_json or not sys.stdout.isatty():
        return LineDisplay(period, as_json)
    return LiveDisplay()
