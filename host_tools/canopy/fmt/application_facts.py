# SPDX-License-Identifier: MIT
"""What an application knows of its leaves: facts in a small file, and those that follow from declared thresholds.

# one a line
BatteryAbove30 implies BatteryAbove10
"Battery.Level > 30" implies not IsEmpty
never Sitting and Standing
PerformTask returns RUNNING
Recharge is memoryless
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import combinations
from pathlib import Path

from canopy.check.facts import overlap
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.script.syntax import Comparison, Name, Number, ScriptError, Unary, parse
from canopy.convert.read_back import STATUS_OF
from canopy.files import FileError, read_text
from canopy.semantics.spec import SUCCESS

MAX_BYTES = 1024 * 1024
MAX_CONDITIONS = 300
"""Conditions that facts are about: what follows from what is worked out for all pairs."""

Literal = tuple[Hashable, bool]
"""A condition's key, and whether it is true."""

_CONDITION = r'(?:"[^"]*"|[A-Za-z_]\w*(?:\([^()]*\))?)'
_IMPLIES = re.compile(rf"(not\s+)?({_CONDITION})\s+implies\s+(not\s+)?({_CONDITION})")
_NEVER = re.compile(rf"never\s+({_CONDITION})\s+and\s+({_CONDITION})")
_RETURNS = re.compile(r"([A-Za-z_]\w*)\s+returns\s+(\w+(?:\s+\w+)*)")
_MEMORYLESS = re.compile(r"([A-Za-z_]\w*)\s+is\s+memoryless")


@dataclass
class Facts:
    """Facts: `clauses`, of each of which one literal holds; what leaves return; which leaves have no memory."""

    clauses: set[tuple[Literal, Literal]] = field(default_factory=set)
    returns: dict[str, tuple[int, ...]] = field(default_factory=dict)
    memoryless: set[str] = field(default_factory=set)

    def rules(self) -> ClauseRules:
        """The clauses as rules for a comparison."""
        return ClauseRules(self.clauses)


class ClauseRules:
    """Which answers go together: with clauses of two literals, exactly those of which no two exclude each other.

    Raises:
        ValueError: the clauses contradict each other.
    """

    def __init__(self, clauses: Iterable[tuple[Literal, Literal]]) -> None:
        follows: dict[Literal, set[Literal]] = {}
        for one, other in clauses:
            follows.setdefault(_negated(one), set()).add(other)
            follows.setdefault(_negated(other), set()).add(one)
        self._implied = {literal: _closure(literal, follows) for literal in follows}
        for literal, implied in self._implied.items():
            if _negated(literal) in implied and literal in self._implied.get(_negated(literal), ()):
                raise ValueError(f"the facts contradict each other about {literal[0]}")

    def allows(self, given: dict[Hashable, int], key: Hashable, value: int) -> bool:
        """May `key` have this answer, in a tick in which the others are `given`?"""
        literal = (key, value == SUCCESS)
        implied = self._implied.get(literal)
        if implied is None:
            return True
        if _negated(literal) in implied:
            return False
        return not any((other, answer != SUCCESS) in implied for other, answer in given.items())


def _negated(literal: Literal) -> Literal:
    return literal[0], not literal[1]


def _closure(literal: Literal, follows: Mapping[Literal, set[Literal]]) -> set[Literal]:
    found = {literal}
    waiting = [literal]
    while waiting:
        for other in follows.get(waiting.pop(), ()):
            if other not in found:
                found.add(other)
                waiting.append(other)
    return found


class _Reader:
    def __init__(self, path: Path, leaves: Mapping[str, Leaf]) -> None:
        self._path = path
        self._leaves = leaves
        self.facts = Facts()

    def line(self, number: int, text: str) -> None:
        place = Place(str(self._path), number)
        if match := _IMPLIES.fullmatch(text):
            one = (self._condition(match[2], place), not match[1])
            other = (self._condition(match[4], place), not match[3])
            self.facts.clauses.add((_negated(one), other))
        elif match := _NEVER.fullmatch(text):
            self.facts.clauses.add(
                ((self._condition(match[1], place), False), (self._condition(match[2], place), False))
            )
        elif match := _MEMORYLESS.fullmatch(text):
            self.facts.memoryless.add(self._leaf(match[1], place))
        elif match := _RETURNS.fullmatch(text):
            self.facts.returns[self._leaf(match[1], place)] = tuple(self._status(w, place) for w in match[2].split())
        else:
            raise CompileError(
                place,
                f"not a fact: {text}",
                "A implies B; A implies not B; never A and B; A returns RUNNING; A is memoryless",
            )

    @staticmethod
    def _status(word: str, place: Place) -> int:
        if word not in STATUS_OF or word == "SKIPPED":
            raise CompileError(place, f"'{word}' is not a status", "RUNNING, SUCCESS, FAILURE")
        return STATUS_OF[word]

    def _leaf(self, name: str, place: Place) -> str:
        if name not in self._leaves:
            raise CompileError(place, f"no leaf '{name}'", nearest(name, self._leaves))
        return name

    def _condition(self, text: str, place: Place) -> Hashable:
        if text.startswith('"'):
            return ("script", text[1:-1])
        name, _, ports = text.rstrip(")").partition("(")
        if self._leaves[self._leaf(name, place)].kind != "Condition":
            raise CompileError(place, f"'{name}' is not a Condition", "facts relate Conditions, and scripts in quotes")
        values = [tuple(part.strip() for part in port.partition("=")[::2]) for port in ports.split(",") if port.strip()]
        return (name, tuple(sorted(values)))


def read_facts(path: Path, leaves: Mapping[str, Leaf]) -> Facts:
    """Reads a file of facts.

    Raises:
        CompileError: it cannot be read, or a line is not a fact about these leaves.
    """
    place = Place(str(path))
    try:
        text = read_text(path, MAX_BYTES)
    except FileError as error:
        raise CompileError(place, error.problem) from error
    reader = _Reader(path, leaves)
    for number, line in enumerate(text.splitlines(), 1):
        content = line.partition("#")[0].strip()
        if content:
            reader.line(number, " ".join(content.split()))
    try:
        reader.facts.rules()
    except ValueError as error:
        raise CompileError(place, str(error)) from error
    return reader.facts


@dataclass(frozen=True)
class Threshold:
    """A condition that is a comparison of a signal with a number; `sign` is <, <=, >, >=, == or !=."""

    signal: str
    sign: str
    limit: Fraction

    def holds(self, value: Fraction) -> bool:
        """Is it true of a value?"""
        return {
            "<": value < self.limit,
            "<=": value <= self.limit,
            ">": value > self.limit,
            ">=": value >= self.limit,
            "==": value == self.limit,
            "!=": value != self.limit,
        }[self.sign]


def read_threshold(text: str) -> Threshold | None:
    """A script that is one comparison of a signal with a number; None if it is something else."""
    try:
        (only,) = parse(text)
    except (ScriptError, ValueError):
        return None
    if not isinstance(only, Comparison) or len(only.operands) != 2:
        return None
    left, right = only.operands
    negative = isinstance(right, Unary) and right.operator == "-"
    number = right.operand if isinstance(right, Unary) and negative else right
    if (
        not isinstance(left, Name)
        or "." not in left.name
        or left.name.endswith(".fresh")
        or not isinstance(number, Number)
    ):
        return None
    return Threshold(left.name, only.operators[0], -number.value if negative else number.value)


def declared_thresholds(leaves: Mapping[str, Leaf]) -> dict[Hashable, Threshold]:
    """What Conditions declare with `holds`: those that read nothing else, have no ports, and are false when stale.

    Raises:
        CompileError: a `holds` is not a comparison of a signal that the condition reads with a number.
    """
    found: dict[Hashable, Threshold] = {}
    for leaf in leaves.values():
        if not leaf.holds:
            continue
        threshold = read_threshold(leaf.holds)
        message = threshold.signal.partition(".")[0] if threshold is not None else ""
        if threshold is None or not any(overlap(threshold.signal, name) for name in leaf.reads):
            raise CompileError(
                leaf.place,
                f"holds='{leaf.holds}' of '{leaf.id}' is not a comparison of a signal that it reads with a number",
                "for example reads='Battery.Level' holds='Battery.Level > 30'",
            )
        alone = {name.partition(".")[0] for name in leaf.reads} == {message}
        if leaf.kind == "Condition" and alone and not leaf.ports and leaf.stale == "FAILURE" and leaf.state is None:
            found[leaf.id, ()] = threshold
    return found


def derived(thresholds: Mapping[Hashable, Threshold]) -> set[tuple[Literal, Literal]]:
    """What follows of each other from thresholds over one signal; all are false while the signal is not fresh."""
    clauses = set()
    for (one, first), (other, second) in combinations(list(thresholds.items())[:MAX_CONDITIONS], 2):
        if first.signal != second.signal:
            continue
        limits = sorted({first.limit, second.limit})
        values = [limits[0] - 1, *limits, (limits[0] + limits[-1]) / 2, limits[-1] + 1]
        together = {(first.holds(value), second.holds(value)) for value in values} | {(False, False)}
        for pair in ((True, False), (False, True), (True, True)):
            if pair not in together:
                clauses.add(((one, not pair[0]), (other, not pair[1])))
    return clauses
