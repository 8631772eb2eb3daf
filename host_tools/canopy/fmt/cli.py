# SPDX-License-Identifier: MIT
"""`canopy fmt`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from canopy.compiler.errors import CompileError, Place
from canopy.escape.terminal import echo, echo_lines
from canopy.files import LARGEST, FileError, read_bytes, write_files
from canopy.fmt.document import read_document
from canopy.fmt.writer import write_document

WOULD_CHANGE = 1
INPUT_ERROR = 2


def format_bytes(data: bytes, file: str) -> bytes:
    """The canonical form of a file's content; raises CompileError if it is no XML."""
    return write_document(read_document(data, file)).encode()


def _format_file(path: Path, check: bool) -> bool:
    """Formats a file in place, unless `check`. Was it not in canonical form?"""
    try:
        data = read_bytes(path)
        formatted = format_bytes(data, str(path))
        if formatted != data and not check:
            target = path.resolve()  # a link to a file stays one
            write_files({target: formatted}, mode=target.stat().st_mode & 0o7777)
    except FileError as error:
        raise CompileError(Place(str(path)), error.problem) from error
    except OSError as error:
        raise CompileError(Place(str(path)), f"cannot be read or written: {error.strerror}") from error
    return formatted != data


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
def command(files: tuple[str, ...], check: bool) -> None:
    """Write tree files in one canonical form, without loss (docs/tools.md).

    `-` formats standard input to standard output.

    Exit status: 0 done, 1 with --check: a file would change, 2 a file cannot be read (the others are still done).

    \b
    Examples:
      canopy fmt trees/*.xml
      canopy fmt --check trees/*.xml
      canopy fmt - < drawn.xml > tidy.xml
    """
    changed = unreadable = False
    for name in files:
        try:
            if name == "-":
                data = _read_input()
                formatted = format_bytes(data, "<stdin>")
                differs = formatted != data
                if not check:
                    _print(formatted)
                    continue
            else:
                differs = _format_file(Path(name), check)
        except CompileError as error:
            echo_lines(str(error), err=True)
            unreadable = True
            continue
        if differs:
            changed = True
            echo(f"{name}: {'not in canonical form' if check else 'formatted'}", err=check)
    if unreadable:
        sys.exit(INPUT_ERROR)
    sys.exit(WOULD_CHANGE if check and changed else 0)
