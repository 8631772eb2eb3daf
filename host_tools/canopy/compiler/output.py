# SPDX-License-Identifier: MIT
"""What the commands that write files have in common."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

from canopy.compiler.errors import CompileError, Place
from canopy.escape import make
from canopy.escape.terminal import echo, echo_lines
from canopy.files import FileError, write_files

INPUT_ERROR = 2


def fail(error: CompileError) -> NoReturn:
    """Prints the error, and ends the program with exit status 2."""
    echo_lines(str(error), err=True)
    sys.exit(INPUT_ERROR)


def print_note(note: str) -> None:
    """Prints a note to standard error; nothing when it is empty."""
    if note:
        echo(note, err=True)


def dependencies(depfile: Path, target: Path, read: list[Path]) -> dict[Path, bytes]:
    """The file that tells make which files `target` was made from.

    Raises:
        CompileError: a path cannot stand in it.
    """
    try:
        return {depfile: make.rule(target, [file.resolve() for file in read])}
    except ValueError as error:
        raise CompileError(Place(str(depfile)), str(error), "rename it") from error


def write_or_exit(
    folder: Path, files: Mapping[str, bytes], first: Mapping[Path, bytes] | None = None, new: tuple[Path, ...] = ()
) -> None:
    """Writes `files` into the folder, which is made, and before them `first`: all or none; else fail().

    `new`: those of `first` that must not be there yet.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_files({**(first or {}), **{folder / name: content for name, content in files.items()}}, new)
    except FileExistsError as error:
        place = Place(str(error.filename or folder))
        if Path(place.file) not in new:
            fail(CompileError(place, f"cannot be written: {error.strerror}"))
        fail(
            CompileError(place, "is there already, and is not overwritten", "name a new file, and copy what is missing")
        )
    except OSError as error:
        fail(CompileError(Place(str(error.filename or folder)), f"cannot be written: {error.strerror}"))
    except FileError as error:
        fail(CompileError(Place(str(error.path)), f"cannot be written: {error.problem}"))
