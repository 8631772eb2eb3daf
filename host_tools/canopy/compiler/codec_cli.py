# SPDX-License-Identifier: MIT
"""`canopy codec`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from canopy.compiler.bus_model import Bus
from canopy.compiler.bus_reader import read_bus, read_messages
from canopy.compiler.cli import in_range
from canopy.compiler.emit import environment, render_bus
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.generation import tie
from canopy.compiler.layout import layout
from canopy.compiler.limits import PERIOD_MS
from canopy.compiler.output import write_or_exit
from canopy.escape.terminal import echo, echo_lines

INPUT_ERROR = 2


def render_codec(bus: Bus) -> dict[str, str]:
    """The codec's two files: file name -> content, for tie(). The same input gives the same bytes."""
    templates = environment(bus)
    return {
        f"{bus.name}_codec.{suffix}": layout(templates.get_template(f"codec.{suffix}.j2").render(bus=bus))
        for suffix in ("h", "c")
    }


@click.command()
@click.argument("dbc", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder for the generated files.")
@click.option("--node", default="", help="Decode only what this node (BU_) receives, encode only what it sends.")
@click.option("--message", "messages", multiple=True, help="Only this message; may be given again.")
@click.option(
    "--period-ms",
    type=in_range(PERIOD_MS),
    help="With --node: the images and tables of canopy/bus.h instead, for a loop of this period.",
)
def command(dbc: Path, output: Path, node: str, messages: tuple[str, ...], period_ms: int | None) -> None:
    """Make the C codec of the bus that DBC describes; no tree is needed.

    Writes NAME_codec.h and NAME_codec.c: a struct, an init, a decode and an encode function for each message. With
    --period-ms it writes NAME_bus.h and NAME_bus.c, as `canopy compile` does. Nothing is written when anything is
    wrong. Exit status: 0 done, 2 the input cannot be compiled.

    \b
    Example:
      canopy codec powertrain.dbc -o generated
    """
    if period_ms is not None and (not node or messages):
        raise click.UsageError("--period-ms needs --node, and goes without --message")
    try:
        if period_ms is None:
            bus = read_messages(dbc, node, messages)
            files = render_codec(bus)
        else:
            bus = read_bus(dbc, node, period_ms)
            files = render_bus(bus, period_ms)
        if not bus.messages:
            raise CompileError(Place(str(dbc)), "no message to make a codec of", "leave out --node or --message")
    except CompileError as error:
        echo_lines(str(error), err=True)
        sys.exit(INPUT_ERROR)
    for remark in bus.remarks:
        echo_lines(str(remark), err=True)
    write_or_exit(output, tie(files))
    signals = sum(len(message.signals) for message in bus.messages)
    echo(f"{bus.name}: {len(bus.messages)} messages, {signals} signals: {', '.join(sorted(files))}")
