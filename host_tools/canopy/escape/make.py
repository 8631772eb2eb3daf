# SPDX-License-Identifier: MIT
"""Dependencies as make and Ninja read them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

_ESCAPES = {ord(" "): "\\ ", ord("#"): "\\#", ord("$"): "$$"}


def _name(path: Path) -> str:
    """The path in a rule.

    Raises:
        ValueError: make has no way to write it.
    """
    text = path.as_posix()
    if any(character in text for character in "\n\r\t\\"):
        raise ValueError(f"the path {text!r} cannot stand in a file for make")
    return text.translate(_ESCAPES)


def rule(target: Path, read: Iterable[Path]) -> bytes:
    """The rule that `target` was made from the files `read`.

    Raises:
        ValueError: a name cannot stand in it.
    """
    return os.fsencode(f"{_name(target)}: {' '.join(map(_name, read))}\n")
