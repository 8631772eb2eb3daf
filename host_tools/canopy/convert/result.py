# SPDX-License-Identifier: MIT
"""From a converter's text to a file: nothing is written that has not been read back, run, and found equal."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from canopy.compiler.errors import CompileError, Place
from canopy.convert.equivalence import Difference, Key, Shown, Verdict
from canopy.escape.terminal import echo_lines
from canopy.semantics.spec import CALL_NAMES, STATUS_NAMES


class NotEqualError(Exception):
    """The result is not what it was made from: a mistake of the converter, or of what was declared."""


def _answer(key: Key, value: int) -> str:
    if isinstance(key, tuple) and key and isinstance(key[0], tuple):
        key = key[0]  # the use's number is of no interest
    if isinstance(key, tuple) and key:
        ports = ", ".join(f"{name}={text}" for name, text in key[1]) if len(key) > 1 else ""
        return f"{key[0]}{f'({ports})' if ports else ''}: {STATUS_NAMES[value]}"
    return f"{key}: {value}"


def _shown(shown: Shown) -> str:
    status, calls = shown
    if not isinstance(calls, tuple):
        return f"{STATUS_NAMES[status]}, in control: {calls or 'nobody'}"
    parts = []
    for call in calls:
        if isinstance(call, str):
            parts.append(call)
        else:
            key, kind = call
            while isinstance(key, tuple):
                key = key[0]
            parts.append(f"{key} {CALL_NAMES[kind]}")
    return f"{STATUS_NAMES[status]}, calls: {', '.join(parts) or 'none'}"


def describe(difference: Difference, one: str, other: str) -> str:
    """Where two machines differ, tick by tick."""
    lines = []
    for number, given in enumerate((*difference.before, difference.given), 1):
        lines.append(f"  tick {number}: " + ", ".join(_answer(key, value) for key, value in given.items()))
    return "\n".join([*lines, f"  {one}: {_shown(difference.one)}", f"  {other}: {_shown(difference.other)}"])


def write_checked(text: str, output: str, check: Callable[[Path], Verdict] | None) -> Verdict | None:
    """Writes `text` to a file ("-": standard output), after `check` has read it from a file and found it equal.

    Raises:
        CompileError: it cannot be written, or not read back.
        NotEqualError: it is not equal; nothing has been written.
    """
    target = None if output == "-" else Path(output)
    verdict = None
    try:
        suffix = ".xml" if target is None else target.suffix
        folder = None if target is None else target.resolve().parent
        handle, name = tempfile.mkstemp(dir=folder, prefix=".canopy-", suffix=suffix)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            if check is not None:
                verdict = check(Path(name))
                if verdict.difference is not None:
                    raise NotEqualError(describe(verdict.difference, "the source", "the result"))
            if target is not None:
                os.chmod(name, 0o666 & ~_umask())
                os.replace(name, target)
        finally:
            if os.path.exists(name):
                os.unlink(name)
    except OSError as error:
        raise CompileError(Place(output), f"cannot be written: {error.strerror}") from error
    if target is None:
        echo_lines(text)
    return verdict


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
