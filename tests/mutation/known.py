# SPDX-License-Identifier: MIT
"""known.txt: the mutants that no test can notice, each with its reason, and those that none has noticed yet."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

FILE = Path(__file__).with_name("known.txt")
Name = tuple[str, str, str]


@dataclass(frozen=True)
class Known:
    """What is known of the mutants that live."""

    judged: frozenset[str]
    """Files of which all mutants were tried: one of theirs that lives and is not listed is an error."""
    equivalent: dict[Name, str]
    """Their behaviour is the same; the reason."""
    alive: frozenset[Name]


class KnownError(Exception):
    """The file is not as it should be; the text names the line."""


def read_known(path: Path = FILE) -> Known:
    """Reads the list.

    A line is a comment (#), `judged FILE…`, or a mutant: `equivalent PLACE | BEFORE | AFTER | REASON`,
    `alive PLACE | BEFORE | AFTER`, where PLACE is FILE:FUNCTION. A bar has two blanks on each side.

    Raises:
        KnownError: A line is none of these.
    """
    judged: set[str] = set()
    equivalent: dict[Name, str] = {}
    alive: set[Name] = set()
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        word, _, rest = line.partition(" ")
        parts = rest.split("  |  ")
        if not line or word == "#":
            continue
        if word == "judged":
            judged.update(rest.split())
        elif word == "equivalent" and len(parts) == 4 and parts[3].strip():
            equivalent[parts[0], parts[1], parts[2]] = parts[3]
        elif word == "alive" and len(parts) == 3:
            alive.add((parts[0], parts[1], parts[2]))
        else:
            raise KnownError(f"{path}:{number}: is no line of this list: {line[:80]}")
    return Known(frozenset(judged), equivalent, frozenset(alive))
