# SPDX-License-Identifier: MIT
"""`canopy fmt`."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import click

from canopy.compiler.errors import CompileError, Place
from canopy.fmt.document import read_document
from canopy.fmt.writer import write_document

WOULD_CHANGE = 1
INPUT_ERROR = 2


def format_bytes(data: bytes, file: str) -> bytes:
    """The canonical form of a file's content; raises CompileError if it is no XML."""
    return write_document(read_document(data, file)).encode()


def _replace(path: Path, data: bytes) -> None:
    """Writes the whole file or nothing; keeps its permissions, and follows a link to it."""
    target = path.resolve()
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, target.stat().st_mode & 0o7777)
        os.replace(temporary, target)
    except BaseException:
        os.unlink(temporary)
        raise


def _format_file(path: Path, check: bool) -> bool:
    """Formats a file in place, unless `check`. Was it not in canonical form?"""
    try:
        data = path.read_bytes()
        formatted = format_bytes(data, str(path))
        if formatted != data and not check:
            _replace(path, formatted)
    except OSError as error:
        raise CompileError(Place(str(path)), f"cannot be read or written: {error.strerror}") from error
    return formatted != data


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
                data = sys.stdin.buffer.read()
                formatted = format_bytes(data, "<stdin>")
                differs = formatted != data
                if not check:
                    sys.stdout.buffer.write(formatted)
                    continue
            else:
                differs = _format_file(Path(name), check)
        except CompileError as error:
            click.echo(str(error), err=True)
            unreadable = True
            continue
        if differs:
            changed = True
            click.echo(f"{name}: {'not in canonical form' if check else 'formatted'}", err=check)
    if unreadable:
        sys.exit(INPUT_ERROR)
    sys.exit(WOULD_CHANGE if check and changed else 0)
