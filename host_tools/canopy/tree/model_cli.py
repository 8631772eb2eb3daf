# SPDX-License-Identifier: MIT
"""`canopy model`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from canopy.compiler.cli import package_option, read_packages, read_search, search_option
from canopy.compiler.documents import Documents, read_files
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.output import fail, print_note
from canopy.compiler.port_types import ANY_TYPE
from canopy.compiler.tree_reader import built_in_names
from canopy.escape.terminal import echo_lines
from canopy.files import FileError, write_files
from canopy.tree.built_in import built_in_xml
from canopy.tree.guess import guess_models
from canopy.tree.model_file import MARK, model_text
from canopy.tree.search import complete


def _write(output: Path | None, text: str) -> None:
    if output is None:
        echo_lines(text.rstrip("\n"))
        return
    try:
        write_files({output: text.encode()})
    except OSError as error:
        fail(CompileError(Place(str(output)), f"cannot be written: {error.strerror}"))
    except FileError as error:
        fail(CompileError(Place(str(output)), f"cannot be written: {error.problem}"))


@click.command()
@click.argument("trees", metavar="TREE…", nargs=-1, type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="The file to write; standard output without it.")
@click.option("--builtin", is_flag=True, help="Declare the built-in nodes instead, for an editor that lacks some.")
@package_option
@search_option
def command(trees: tuple[Path, ...], output: Path | None, builtin: bool, packages: tuple[str, ...]) -> None:
    """Write the <TreeNodesModel> that the files TREE… need and do not have.

    Kinds, ports and types are guessed from how all these files use a node; each guess is marked CONFIRM. The program's
    own inputs, entries that nothing writes, become ports of the main tree. Then compile with --search FILE, or include
    the file. Exit status: 0, or 2 when a file cannot be read.

    \b
    Examples:
      canopy model trees/*.xml -o trees/nodes.xml
      canopy compile trees/patrol.xml --search trees/nodes.xml …
      canopy model --builtin -o canopy_nodes.xml
    """
    if builtin == bool(trees):
        raise click.UsageError("give tree files, or --builtin")
    if builtin:
        _write(output, built_in_xml())
        return
    many: list[Documents] = []
    try:
        options = replace(ANY_TYPE, ros_packages=read_packages(packages), search=read_search())
        for tree in trees:
            documents = read_files(tree, options, built_in_names())
            complete(documents, built_in_names())
            many.append(documents)
    except CompileError as error:
        fail(error)
    guess = guess_models(many)
    _write(output, model_text(guess))
    if output is not None:
        ports = sum(len(node.ports) for node in guess.nodes.values())
        inputs = sum(len(names) for names in guess.inputs.values())
        print_note(
            f"{output}: {len(guess.nodes)} nodes with {ports} ports, {inputs} inputs of main trees; "
            f"look at each {MARK}, then compile with --search {output}"
        )
