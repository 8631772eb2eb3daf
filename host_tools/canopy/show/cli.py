# SPDX-License-Identifier: MIT
"""`canopy show`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from canopy.compiler.cli import main_tree_option, package_option, read_packages
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.output import fail
from canopy.compiler.port_types import ANY_TYPE
from canopy.compiler.tree_reader import read_tree
from canopy.escape.terminal import echo_lines
from canopy.files import FileError, write_files
from canopy.show.dot import dot
from canopy.show.svg import svg
from canopy.show.terminal import print_tree


def _write(target: str, text: str) -> None:
    if target == "-":
        echo_lines(text)
        return
    try:
        write_files({Path(target): text.encode()})
    except OSError as error:
        fail(CompileError(Place(target), f"cannot be written: {error.strerror}"))
    except FileError as error:
        fail(CompileError(Place(target), f"cannot be written: {error.problem}"))


@click.command()
@click.argument("tree", type=click.Path(path_type=Path))
@click.option("--svg", "svg_file", metavar="FILE", help="Draw it as SVG into FILE; - is standard output.")
@click.option("--dot", "dot_file", metavar="FILE", help="Write it in Graphviz's DOT into FILE; - is standard output.")
@package_option
@main_tree_option
def command(
    tree: Path,
    svg_file: str | None,
    dot_file: str | None,
    packages: tuple[str, ...],
    main_tree: str | None,
) -> None:
    """Draw TREE: in the terminal, as SVG, or as DOT.

    → Sequence, ? Fallback, ⇉ Parallel, * with memory (BehaviorTree.CPP's Sequence and Fallback have one, the Reactive
    ones not), δ decorator, (condition), [action].

    \b
    Examples:
      canopy show trees/get_home.xml
      canopy show trees/get_home.xml --svg get_home.svg
      canopy show trees/get_home.xml --dot - | dot -Tpdf > get_home.pdf
    """
    try:
        checked = read_tree(tree, replace(ANY_TYPE, ros_packages=read_packages(packages), main_tree=main_tree))
    except CompileError as error:
        fail(error)
    if svg_file is not None:
        _write(svg_file, svg(checked))
    if dot_file is not None:
        _write(dot_file, dot(checked))
    if svg_file is None and dot_file is None:
        print_tree(checked)
