# SPDX-License-Identifier: MIT
"""The rules, by what they look at. Importing this package registers them all, in this order."""

from __future__ import annotations

from canopy.check.registry import RULES, Rule

# The order of the table.
# isort: off
from canopy.check.rules import reach, parallel, reactive, reactivity, guards, outcomes, declarations, bus

__all__ = [
    "all_rules",
    "bus",
    "declarations",
    "guards",
    "outcomes",
    "parallel",
    "reach",
    "reactive",
    "reactivity",
    "table",
]


def all_rules() -> dict[str, Rule]:
    """Every rule by its id, in the order of the documentation."""
    return RULES


def table() -> str:
    """The table of docs/lint.md."""
    lines = ["| rule | severity | what it finds | why it matters | way out |", "|---|---|---|---|---|"]
    for known in RULES.values():
        lines.append(f"| `{known.id}` | {known.severity.label} | {known.title} | {known.why} | {known.way_out} |")
    return "\n".join(lines) + "\n"
