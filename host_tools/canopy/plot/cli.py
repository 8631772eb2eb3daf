# SPDX-License-Identifier: MIT
"""`canopy plot`."""

from __future__ import annotations

from pathlib import Path

import click

from canopy.compiler.cli import read_type_options, type_options
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.output import fail
from canopy.escape.terminal import CleanCommand, echo
from canopy.files import FileError, write_files
from canopy.plot.draw import FORMATS, rendered
from canopy.plot.portrait import Portrait, portrait
from canopy.verify.run import load, model_path

MOST_STEPS = 10_000


class _Group(CleanCommand, click.Group):
    pass


@click.group(cls=_Group)
def command() -> None:
    """Draw what a tree does to a plant, given a model of its leaves (docs/plot.md)."""


def _write(made: Portrait, outputs: tuple[Path, ...]) -> None:
    """Draws and writes all files, or none."""
    files = {path: rendered(made, path.suffix[1:].lower()) for path in outputs}
    try:
        write_files(files)
    except OSError as error:
        raise CompileError(Place(str(error.filename or outputs[0])), f"cannot be written: {error.strerror}") from error
    except FileError as error:
        raise CompileError(Place(str(error.path)), f"cannot be written: {error.problem}") from error


@command.command()
@click.argument("tree", metavar="TREE", type=click.Path(path_type=Path))
@click.option("--model", type=click.Path(path_type=Path), help="The model. [default: NAME.plant.toml beside the tree]")
@click.option("--of", metavar="NODE", help="Draw this node's subtree alone: its name, or its path.")
@click.option("--run", "runs", multiple=True, metavar="STATE", help="Draw a run from x1=80,x2=50; several times.")
@click.option(
    "--steps", default=1_000, show_default=True, type=click.IntRange(1, MOST_STEPS), help="Most steps of a run."
)
@click.option("--title", help="Title of the picture. [default: the node's name]")
@click.option(
    "-o", "--output", "outputs", multiple=True, required=True, metavar="FILE", type=click.Path(path_type=Path),
    help="NAME.svg or NAME.png; several times for both.",
)  # fmt: skip
@type_options
def phase(
    tree: Path,
    model: Path | None,
    of: str | None,
    runs: tuple[str, ...],
    steps: int,
    title: str | None,
    outputs: tuple[Path, ...],
    include: str | None,
    floats: bool,
    unset_ports: bool,
    type_map: tuple[str, ...],
    packages: tuple[str, ...],
    main_tree: str | None,
) -> None:
    """Draw the phase portrait of TREE: which leaf acts where, the direction of its steps, and runs.

    The model is that of canopy verify, with two variables. Regions and runs are computed without rounding.

    \b
    Examples:
      canopy plot phase examples/nao/trees/get_home.xml --run x1=0.5,x2=0 -o get_home.svg
      canopy plot phase examples/nao/trees/power_supply.xml --of "Do Other Task" -o task.png
    """
    for path in outputs:
        if path.suffix[1:].lower() not in FORMATS:
            raise click.UsageError(f"--output {path}: expected a name that ends in .svg or .png")
    try:
        options = read_type_options(include, floats, unset_ports, type_map, packages, main_tree)
        made = portrait(load(tree, model or model_path(tree), options=options), of, runs, steps, title)
        _write(made, outputs)
    except CompileError as error:
        fail(error)
    for run in made.runs:
        last = zip(made.axes, run.visits[-1].state, strict=True)
        shown = ", ".join(f"{axis.name} = {float(x):.6g}" for axis, x in last)
        echo(f"run of {len(run.visits) - 1} steps to {shown}: {'SUCCESS' if run.ended else run.why}")
