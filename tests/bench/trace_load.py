# SPDX-License-Identifier: MIT
"""The bus load of the trace, of version 1 and of version 2: PYTHONPATH=tests python -m bench.trace_load.

Counted, not timed: frames in a second from the formats' rules, each of 8 bytes with an 11-bit id and the most stuff
bits, at 500 kbit/s. Version 1 sent in every tick CanopyTick, CanopyInputs, a CanopySnapshot, CanopyArrivals of three
messages each, and CanopyChange of two nodes each, 8 at most. Of version 2 the slow frames are counted, too.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import click

from canopy.compiler.bus_timing import frame_bits
from canopy.compiler.emit import load_application
from canopy.compiler.trace import TraceOptions

from . import cycle

BITRATE = 500_000
PERIOD_MS = 50
OLD_CHANGES_MAX = 8
NEAR = 5
"""Nodes in a CanopyChange of version 2, where they lie near each other."""


@dataclass(frozen=True)
class Row:
    """Frames in a second: `old` and `new`."""

    what: str
    old: float
    new: float


def _load(frames: float) -> float:
    return 100 * frames * frame_bits(8, extended=False, fd=False) / BITRATE


def _old(messages: int, changes: int, period_ms: int) -> float:
    in_tick = 3 + -(-messages // 3) + min(OLD_CHANGES_MAX, -(-changes // 2))
    return in_tick * 1000 / period_ms + 2  # CanopyHealth and CanopyModel, each once a second


def rows(folder: Path) -> list[Row]:
    """Idle, four changes in every tick, and as many as both formats can tell in eight frames."""
    result = []
    applications = [(one.name, one.folder / "trees" / one.tree, one.folder / one.dbc) for one in cycle.APPLICATIONS[:2]]
    large = cycle.idle(folder, 200)
    applications.append(("200 nodes", large.folder / "trees" / large.tree, large.folder / large.dbc))
    for name, tree, dbc in applications:
        application = load_application("load", tree, dbc, "Controller", PERIOD_MS, BITRATE, trace=TraceOptions(0x600))
        trace, messages = application.trace, len(application.bus.receive)
        assert trace is not None
        idle = trace.frames_a_second(PERIOD_MS, worst=False)
        for what, changes in (("idle", 0), ("4 changes in every tick", 4), ("16 changes in every tick", 16)):
            if changes > trace.nodes:
                continue
            new = idle + -(-changes // NEAR) * 1000 / PERIOD_MS
            result.append(Row(f"{name}, {what}", _old(messages, changes, PERIOD_MS), new))
    return result


@click.command()
def main() -> None:
    """Prints the table."""
    click.echo(f"{'trace at 50 ms, 500 kbit/s':38} {'version 1':>10} {'version 2':>10} {'less':>6}")
    with tempfile.TemporaryDirectory(prefix="canopy-bench-") as name:
        for row in rows(Path(name)):
            less = 1 - row.new / row.old
            click.echo(f"{row.what:38} {_load(row.old):8.2f} % {_load(row.new):8.2f} % {less:5.0%}")


if __name__ == "__main__":
    main()
