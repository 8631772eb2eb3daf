# SPDX-License-Identifier: MIT
"""`canopy show`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from canopy.compiler.cli import main_tree_option, package_option, read_packages, read_search, search_option
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.output import fail, print_note
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
@search_option
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

    Any tree is drawn, also of older formats: nodes that no file declares as what they seem to be, and what would not
    compile as far as it can be. Without a main tree all trees of the file are drawn that are no part of another one.

    \b
    Examples:
      canopy show trees/get_home.xml
      canopy show trees/get_home.xml --svg get_home.svg
      canopy show trees/get_home.xml --dot - | dot -Tpdf > get_home.pdf
    """
    try:
        options = replace(ANY_TYPE, ros_packages=read_packages(packages), search=read_search(), draw=True)
        drawn = [read_tree(tree, replace(options, main_tree=main_tree))]
        if svg_file is None and dot_file is None:
            drawn += [read_tree(tree, replace(options, main_tree=other)) for other in drawn[0].others]
    except CompileError as error:
        fail(error)
    if svg_file is not None:
        _write(svg_file, svg(drawn[0]))
    if dot_file is not None:
        _write(dot_file, dot(drawn[0]))
    if svg_file is None and dot_file is None:
        for one in drawn:
            print_tree(one)
    elif drawn[0].others:
        print_note(f"note: '{drawn[0].id}' is drawn; for another tree: --main-tree {' or '.join(drawn[0].others)}")
    problems = max(one.problems for one in drawn)
    if problems:
        things = "1 thing" if problems == 1 else f"{problems} things"
        print_note(f"note: {things} would not compile; canopy compile says which")
