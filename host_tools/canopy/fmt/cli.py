# SPDX-License-Identifier: MIT
"""`canopy fmt`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import click

from canopy.compiler.errors import CompileError, Place
from canopy.escape.terminal import echo, echo_lines
from canopy.files import LARGEST, FileError, read_bytes, write_files
from canopy.fmt.document import read_document
from canopy.fmt.simplify_file import simplify_bytes
from canopy.fmt.to_4 import to_4
from canopy.fmt.writer import write_document
from canopy.tree.raw_markup import repaired

WOULD_CHANGE = 1
INPUT_ERROR = 2


@dataclass(frozen=True)
class Changes:
    """What is done besides formatting."""

    to_4: bool = False
    repair: bool = False


def format_bytes(data: bytes, file: str, changes: Changes | None = None) -> bytes:
    """The canonical form of a file's content; says what a conversion changes.

    Raises:
        CompileError: it is not XML.
    """
    changes = changes or Changes()
    document = read_document(repaired(data) if changes.repair else data, file)
    said = to_4(document) if changes.to_4 else []
    for line in said if said is not None else ["is of format 4 already"]:
        echo(f"{file}: {line}", err=True)
    return write_document(document).encode()


def _simplified(path: Path, facts: Path | None) -> bytes:
    formatted, reports = simplify_bytes(path, facts)
    for report in reports:
        echo(f"{path}: {report}", err=True)
    return formatted


def _format_file(path: Path, check: bool, simplify: bool, facts: Path | None, changes: Changes) -> bool:
    """Formats a file in place, unless `check`. Was it not in canonical form, or not simple?"""
    try:
        data = read_bytes(path)
        formatted = _simplified(path, facts) if simplify else format_bytes(data, str(path), changes)
        if formatted != data and not check:
            target = path.resolve()  # a link to a file stays one
            write_files({target: formatted}, mode=target.stat().st_mode & 0o7777)
    except FileError as error:
        raise CompileError(Place(str(path)), error.problem) from error
    except OSError as error:
        raise CompileError(Place(str(path)), f"cannot be read or written: {error.strerror}") from error
    return formatted != data


def _found(check: bool, simplify: bool) -> str:
    """What is said about a file that changes."""
    if check:
        return "not in canonical form, or not simple" if simplify else "not in canonical form"
    return "formatted"


def _read_input() -> bytes:
    """Standard input, and no more of it than of a file."""
    return sys.stdin.buffer.read(LARGEST + 1)


def _print(formatted: bytes) -> None:
    """Bytes for a pipe; a terminal does not get a comment's control characters."""
    if sys.stdout.isatty():
        echo_lines(formatted.decode())
    else:
        sys.stdout.buffer.write(formatted)


@click.command()
@click.argument("files", metavar="FILE…", nargs=-1, required=True)
@click.option("--check", is_flag=True, help="Change nothing; exit with status 1 if a file is not in canonical form.")
@click.option("--to-4", is_flag=True, help="Also convert files of BehaviorTree.CPP 2 and 3 to format 4.")
@click.option("--repair", is_flag=True, help="Also write raw & and < in attributes as &amp; and &lt;.")
@click.option("--simplify", is_flag=True, help="Also remove what cannot matter; each step is proved.")
@click.option(
    "--facts",
    type=click.Path(path_type=Path),
    help="What is known of the leaves, for --simplify: 'A implies B', 'A returns RUNNING', …",
)
def command(files: tuple[str, ...], check: bool, to_4: bool, repair: bool, simplify: bool, facts: Path | None) -> None:
    """Write tree files in one canonical form, without loss (docs/tools.md).

    `-` formats standard input to standard output.

    Exit status: 0 done, 1 with --check: a file would change, 2 a file cannot be read (the others are still done).

    \b
    Examples:
      canopy fmt trees/*.xml
      canopy fmt --check trees/*.xml
      canopy fmt - < drawn.xml > tidy.xml
      canopy fmt --to-4 old/*.xml
      canopy fmt --simplify --facts robot.facts trees/*.xml
    """
    if facts is not None and not simplify:
        raise click.UsageError("--facts goes with --simplify")
    if simplify and "-" in files:
        raise click.UsageError("--simplify needs files: what leaves are declared may stand in others that they include")
    if simplify and (to_4 or repair):
        raise click.UsageError("convert and repair first, then --simplify")
    changes = Changes(to_4, repair)
    changed = unreadable = False
    for name in files:
        try:
            if name == "-":
                data = _read_input()
                formatted = format_bytes(data, "<stdin>", changes)
                differs = formatted != data
                if not check:
                    _print(formatted)
                    continue
            else:
                differs = _format_file(Path(name), check, simplify, facts, changes)
        except CompileError as error:
            echo_lines(str(error), err=True)
            unreadable = True
            continue
        if differs:
            changed = True
            echo(f"{name}: {_found(check, simplify)}", err=check)
    if unreadable:
        sys.exit(INPUT_ERROR)
    sys.exit(WOULD_CHANGE if check and changed else 0)
