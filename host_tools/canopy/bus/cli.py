# SPDX-License-Identifier: MIT
"""`canopy dbc`: what a bus description lacks, and what can be made of it."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from canopy.bus.doubts import left_out
from canopy.bus.overlay import overlay_path
from canopy.bus.overlay_writer import StartValues, Values, Wanted, overlay_text
from canopy.bus.survey import FileResult, as_markdown, commit_of, survey_folder
from canopy.compiler.dbc_file import load_dbc
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.output import fail, write_or_exit
from canopy.escape.terminal import echo, echo_lines


@click.group()
def command() -> None:
    """Work with the maker's bus description, which stays as it is.

    \b
    Examples:
      canopy dbc overlay car.dbc --node Controller
      canopy dbc survey opendbc canmatrix -o table.md
    """


@command.command()
@click.argument("dbc", type=click.Path(path_type=Path))
@click.option("--node", required=True, help="The application's name on the bus; the file need not have it.")
@click.option("--receive", multiple=True, metavar="MESSAGE", help="It receives this one, too; may be given again.")
@click.option("--send", multiple=True, metavar="MESSAGE", help="It sends this one, too; may be given again.")
@click.option("--start-values", is_flag=True, help="Take GenSigStartValue as the safe value, where the file has it.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="NAME.overlay.toml beside the DBC; - prints it.")
def overlay(
    dbc: Path, node: str, receive: tuple[str, ...], send: tuple[str, ...], start_values: bool, output: Path | None
) -> None:
    """Write the overlay of DBC: everything that an application at NODE needs and the file lacks.

    Each line has the message's comment and unit; where it says "?", you decide. Everything that reads the DBC reads the
    overlay beside it, too. Nothing is overwritten. Exit status: 0 done, 2 the DBC cannot be read, or the overlay is
    there already.
    """
    try:
        read = load_dbc(dbc)
        values = StartValues() if start_values else Values()
        text = overlay_text(read, Wanted(node, receive, send, values))
    except CompileError as error:
        fail(error)
    for problem in read.left_out:
        echo_lines(str(left_out(problem)), err=True)
    if output is not None and str(output) == "-":
        echo_lines(text)
        return
    target = output or overlay_path(dbc)
    write_or_exit(target.parent, {}, {target: text.encode()}, (target,))
    questions = text.count('= "?"')
    echo(f"{target}: {questions} values to fill in")


@command.command()
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Write the tables there, in place of printing them."
)
def survey(folders: tuple[Path, ...], output: Path | None) -> None:
    """Try every bus description below FOLDERS: a codec, and an application for each node.

    Makes the tables of docs/dbc.md, as Markdown: how much can be used, and what is left out, and why. Applications are
    made with the overlay that `canopy dbc overlay` writes, filled by rule. Exit status: 0, 1 a file cannot be read, 2 a
    folder is not there.
    """
    found: dict[str, list[FileResult]] = {}
    for folder in folders:
        if not folder.is_dir():
            fail(CompileError(Place(str(folder)), "is not a folder"))
        commit = commit_of(folder)
        found[f"{folder.resolve().name}{f' {commit}' if commit else ''}"] = list(survey_folder(folder))
    text = as_markdown(found)
    if output is None:
        echo_lines(text)
    else:
        write_or_exit(output.parent, {output.name: text.encode()})
    sys.exit(1 if any(result.error for results in found.values() for result in results) else 0)
