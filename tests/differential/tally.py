# SPDX-License-Identifier: MIT
"""How much of the comparison with BehaviorTree.CPP is strict, and what excuses the rest."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field

from differential.differences import RULES
from differential.shown import SHOWN

SEVERAL = "several at once"
"""In place of a rule: more than one fired in the first tick in which one fired."""


@dataclass
class Excused:
    """What one rule excuses.

    `same`: ticks in which engine and BehaviorTree.CPP did the same, though they need not; `trees_same`: trees in which
    they did so to the end.
    """

    trees: int = 0
    ticks: int = 0
    same: int = 0
    trees_same: int = 0


@dataclass
class Tally:
    """Counts of trees and ticks; a halt of the whole tree counts as a tick.

    `ticks`: those that the trees have, run or not: after an exception BehaviorTree.CPP runs no more. `strict_ticks`:
    those before the first rule fired, in which engine and BehaviorTree.CPP have to be the same. `strict_trees`: trees
    in which no rule fired. `excused`: the other ticks, at the first rule that fired. `identical`: strict ticks in
    which every status was the same. `shown`: those in which one was shown otherwise, at each way of it (shown.SHOWN).
    """

    trees: int = 0
    ticks: int = 0
    strict_trees: int = 0
    strict_ticks: int = 0
    identical: int = 0
    thrown: int = 0
    excused: defaultdict[str, Excused] = field(default_factory=lambda: defaultdict(Excused))
    shown: Counter[str] = field(default_factory=Counter)

    def excuse(self, fired: set[str], ticks: int, same: int) -> None:
        """Adds a tree in which these rules were the first to fire, with so many ticks from there on."""
        row = self.excused[next(iter(fired)) if len(fired) == 1 else SEVERAL]
        row.trees += 1
        row.ticks += ticks
        row.same += same
        row.trees_same += same == ticks

    def lines(self) -> list[str]:
        """The tally as a table."""
        share = 100 / max(self.ticks, 1)
        rows = [
            f"  {'':28}{'trees':>8}{'ticks and halts':>18}{'':10}{'the same anyway: trees':>24}{'ticks':>10}",
            f"  {'strict':28}{self.strict_trees:8}{self.strict_ticks:18}{self.strict_ticks * share:8.2f} %",
        ]
        for name in (*RULES, SEVERAL):
            row = self.excused[name]
            if row.trees:
                rows.append(
                    f"  {'excused: ' + name:28}{row.trees:8}{row.ticks:18}{row.ticks * share:8.2f} %"
                    f"{row.trees_same:24}{row.same:10}"
                )
        total = [sum(getattr(row, name) for row in self.excused.values()) for name in ("trees_same", "same")]
        rows.append(f"  {'all':28}{self.trees:8}{self.ticks:18}{100:8.2f} %{total[0]:24}{total[1]:10}")
        shown = "; ".join(f"{name} {self.shown[name]}" for name in SHOWN)
        rows.append(f"  strict ticks with every status the same {self.identical}; shown otherwise: {shown}")
        return rows
