# SPDX-License-Identifier: MIT
"""Attributes and metadata keys of other tools: left alone, and counted for one note.

A name that is one or two letters from one of ours is an error, not a note: a misspelt `_while` would be an unguarded
robot. `--foreign NAME` says that it is meant.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from canopy.compiler.errors import CompileError, Place

LONGEST = 40  # no name of ours is longer; measuring the distance to longer ones takes long
SHOWN = 8


def _distance(one: str, other: str) -> int:
    """How many letters to insert, leave out, replace, or swap with their neighbour, until `one` is `other`."""
    rows = [list(range(len(other) + 1))]
    for i, letter in enumerate(one, 1):
        row = [i]
        for j, wanted in enumerate(other, 1):
            best = min(rows[-1][j] + 1, row[j - 1] + 1, rows[-1][j - 1] + (letter != wanted))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == wanted:
                best = min(best, rows[-2][j - 2] + 1)
            row.append(best)
        rows.append(row)
    return rows[-1][-1]


def _slips(name: str) -> int:
    """How many letters of a name may be wrong for it still to be recognised: 2, of a short name 1 or none."""
    return 2 if len(name) >= 6 else 1 if len(name) >= 4 else 0


def misspelt(name: str, known: Iterable[str]) -> str | None:
    """The known name that `name` is a slip of the keyboard away from."""
    if len(name) > LONGEST:
        return None
    plain = name.strip("_").lower()
    for other in sorted(known):
        if plain == other.strip("_").lower() or (len(plain) >= 4 and other.startswith(name)):
            return other
        if abs(len(name) - len(other)) <= 2 and _distance(name, other) <= _slips(other):
            return other
    return None


@dataclass
class Foreign:
    """The names that were left alone, each with how often it was met, and the first place.

    `allowed`: those that --foreign names. They may look like ours.
    """

    allowed: frozenset[str] = frozenset()
    seen: dict[str, tuple[int, Place]] = field(default_factory=dict)

    def leave(self, name: str, place: Place, whose: str, known: Iterable[str]) -> None:
        """Counts a name that is none of `known`. `whose`: for the message, "<BehaviorTree>" or "metadata".

        Raises:
            CompileError: it looks like one of ours, misspelt.
        """
        meant = misspelt(name, known) if name not in self.allowed else None
        if meant is not None:
            raise CompileError(
                place,
                f"{whose} has no attribute '{name}'" if whose.startswith("<") else f"unknown {whose} '{name}'",
                f"did you mean '{meant}'? If it is another tool's: --foreign {name}",
            )
        count, first = self.seen.get(name, (0, place))
        self.seen[name] = (count + 1, first)

    def note(self) -> str:
        """One line about all of them; empty when there are none."""
        if not self.seen:
            return ""
        names = [
            f"{name} ({f'{count} times, first at' if count > 1 else 'at'} {place})"
            for name, (count, place) in list(self.seen.items())[:SHOWN]
        ]
        more = f" and {len(self.seen) - SHOWN} more" if len(self.seen) > SHOWN else ""
        return f"note: left alone, because Canopy does not know them: {', '.join(names)}{more}"
