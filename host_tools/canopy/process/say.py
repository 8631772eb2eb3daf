# SPDX-License-Identifier: MIT
"""What a tool says on stderr while it runs: each kind of thing now and then, and how often it was not said.

Whoever sends on a bus or on LCM can make a tool speak. It must not make it flood a terminal, a log or a disk.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from canopy.escape.terminal import echo

PERIOD_S = 10.0
"""Least time between two lines of one kind [s]; the first ones come at once."""

AT_ONCE = 3
"""Lines of one kind that come without a pause."""

KINDS_MAX = 64
"""Kinds that are told apart; all further ones are one."""


@dataclass
class _Kind:
    said: int = 0
    withheld: int = 0
    due: float = 0.0


class Voice:
    """Says lines that begin with the program's name."""

    def __init__(self, program: str) -> None:
        self._program = program
        self._kinds: dict[str, _Kind] = {}

    def say(self, text: str, kind: str | None = None) -> None:
        """Says a line, or counts it.

        Args:
            text: What to say. A text with something in it that others choose needs a `kind`.
            kind: What it is one of; None: of its own text.
        """
        name = text if kind is None else kind
        if name not in self._kinds and len(self._kinds) >= KINDS_MAX:
            name = ""
        entry = self._kinds.setdefault(name, _Kind())
        now = time.monotonic()
        if entry.said >= AT_ONCE and now < entry.due:
            entry.withheld += 1
            return
        more = f" ({entry.withheld} more like this since the last line)" if entry.withheld else ""
        echo(f"{self._program}: {text}{more}", err=True)
        entry.said, entry.withheld, entry.due = entry.said + 1, 0, now + PERIOD_S

    def end(self) -> None:
        """Says how much was not said."""
        withheld = sum(entry.withheld for entry in self._kinds.values())
        if withheld:
            echo(f"{self._program}: {withheld} further lines like these were counted, not printed", err=True)
            for entry in self._kinds.values():
                entry.withheld = 0
