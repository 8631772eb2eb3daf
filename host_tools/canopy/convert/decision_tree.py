# SPDX-License-Identifier: MIT
"""A decision tree as a behaviour tree: the paper's Lemma 7.

A decision is Fallback(Sequence(predicate, yes), no). That is only right while every action is RUNNING: an action that
fails would let the other branch begin. With `WhileDoElse(predicate, yes, no)` it is right whatever the actions return.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.compiler.bus_model import Bus, Signal
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.numbers import plain
from canopy.convert.equivalence import Answers, Shown, State
from canopy.convert.json_input import fields, number, read_json, text
from canopy.convert.machine import SignalInput
from canopy.convert.writer import LeafModel, node
from canopy.fmt.document import Element
from canopy.semantics.spec import FAILURE, RUNNING, SUCCESS

COMPARISONS = ("exact", "float32")
MAX_DECISIONS_DEEP = 80


@dataclass(frozen=True)
class Asked:
    """A predicate that is a Condition of the user's."""

    id: str


@dataclass(frozen=True)
class Threshold:
    """A predicate over a signal in physical units: at most `limit`, or with `above`, more than it.

    `float32`: as scikit-learn compares: the value is rounded to a float, and that is compared with the limit.
    """

    signal: str
    limit: Fraction
    above: bool
    float32: bool

    def holds(self, physical: Fraction) -> bool:
        """Is the predicate true of a physical value?"""
        value = Fraction(rounded(physical)) if self.float32 else physical
        return (value <= self.limit) != self.above


@dataclass(frozen=True)
class Decide:
    """An inner node of a decision tree."""

    predicate: Asked | Threshold
    yes: Decide | Act
    no: Decide | Act


@dataclass(frozen=True)
class Act:
    """A leaf of a decision tree: the action to take."""

    id: str


def rounded(value: Fraction) -> float:
    """The value as numpy makes a float32 of it: to the nearest double, then to the nearest float."""
    largest = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
    try:
        return float(struct.unpack("<f", struct.pack("<f", float(value)))[0])
    except OverflowError:
        return float(largest if value > 0 else -largest)


def _predicate(value: Any, place: Place, where: str, float32: bool) -> Asked | Threshold:
    if isinstance(value, str):
        return Asked(text(value, place, f"{where}.if"))
    found = fields(value, place, f"{where}.if", ("signal",), ("at_most", "above"))
    limits = [key for key in ("at_most", "above") if key in found]
    if len(limits) != 1:
        raise CompileError(place, f"{where}.if needs either at_most or above")
    signal = text(found["signal"], place, f"{where}.if.signal")
    limit = number(found[limits[0]], place, f"{where}.if.{limits[0]}")
    if float32:  # scikit-learn's threshold is a double, and its shortest decimal is written
        try:
            limit = Fraction(float(limit))
        except OverflowError:
            raise CompileError(place, f"{where}.if.{limits[0]} is too large for a double") from None
    return Threshold(signal, limit, limits[0] == "above", float32)


def _branch(value: Any, place: Place, where: str, float32: bool, depth: int = 0) -> Decide | Act:
    if depth > MAX_DECISIONS_DEEP:
        raise CompileError(place, f"{where}: more than {MAX_DECISIONS_DEEP} decisions one below the other")
    if isinstance(value, dict) and "do" in value:
        return Act(text(fields(value, place, where, ("do",))["do"], place, f"{where}.do"))
    found = fields(value, place, where, ("if", "then", "else"))
    yes, no = (_branch(found[key], place, f"{where}.{key}", float32, depth + 1) for key in ("then", "else"))
    return Decide(_predicate(found["if"], place, where, float32), yes, no)


def read_decision_tree(path: Path) -> Decide | Act:
    """Reads the JSON form (docs/convert.md).

    Raises:
        CompileError: it is not valid; the message names the branch.
    """
    place = Place(str(path))
    top = fields(read_json(path), place, "the file", ("tree",), ("comparison",))
    comparison = top.get("comparison", "exact")
    if comparison not in COMPARISONS:
        raise CompileError(place, f"comparison '{comparison}'", nearest(str(comparison), COMPARISONS))
    return _branch(top["tree"], place, "tree", comparison == "float32")


def decisions(tree: Decide | Act) -> Iterator[Decide | Act]:
    """Every node of a decision tree, depth first."""
    yield tree
    if isinstance(tree, Decide):
        yield from decisions(tree.yes)
        yield from decisions(tree.no)


def decimal(value: Fraction) -> str:
    """A number that has an end, as decimals."""
    digits = 0
    while (value * 10**digits).denominator != 1:
        digits += 1
        assert digits < 400, value
    whole = abs(int(value * 10**digits))
    shown = f"{whole // 10**digits}" + (f".{whole % 10**digits:0{digits}d}" if digits else "")
    return f"-{shown}" if value < 0 else shown


class Grid:
    """The values that a signal can have: low to high, each a whole number of steps."""

    def __init__(self, signal: Signal) -> None:
        self.signal = signal
        self.scale, self.offset = Fraction(signal.scale), Fraction(signal.offset)

    def physical(self, raw: int) -> Fraction:
        """The physical value of a raw one."""
        return raw * self.scale + self.offset

    def below(self, limit: Threshold) -> int:
        """How many of the values, from the least physical one on, are not above the limit. Exact: a binary search."""
        low, high = 0, self.signal.high - self.signal.low + 1
        while low < high:
            middle = (low + high) // 2
            if limit.holds(self.at(middle)) != limit.above:
                low = middle + 1
            else:
                high = middle
        return low

    def raw_at(self, place: int) -> int:
        """The raw value at a place of the values, the least physical one first."""
        return self.signal.low + place if self.scale > 0 else self.signal.high - place

    def at(self, place: int) -> Fraction:
        """The physical value there."""
        return self.physical(self.raw_at(place))

    @property
    def count(self) -> int:
        """How many values there are."""
        return self.signal.high - self.signal.low + 1


def grids(tree: Decide | Act, bus: Bus | None, place: Place) -> dict[str, Grid]:
    """The grid of each signal that the decision tree compares.

    Raises:
        CompileError: there is no DBC, it has no such signal for this node, or the signal is floating point.
    """
    wanted = {
        n.predicate.signal for n in decisions(tree) if isinstance(n, Decide) and isinstance(n.predicate, Threshold)
    }
    if wanted and bus is None:
        raise CompileError(
            place, f"it compares the signal '{min(wanted)}'", "to fix: --dbc FILE --node NAME, for the signal's steps"
        )
    known = {f"{m.name}.{s.name}": s for m in (bus.receive if bus else ()) for s in m.signals}
    found = {}
    for name in sorted(wanted):
        if name not in known:
            raise CompileError(place, f"the node receives no signal '{name}'", nearest(name, known))
        if known[name].is_float:
            raise CompileError(place, f"signal '{name}' is floating point", "make it a Condition: its name as the 'if'")
        found[name] = Grid(known[name])
    return found


@dataclass
class Conversion:
    """A converted decision tree: the root's element, its leaves, and what became of the thresholds."""

    root: Element
    leaves: list[LeafModel]
    notes: list[str]


class _Converter:
    def __init__(self, known: dict[str, Grid], shape: str) -> None:
        self._grids = known
        self._shape = shape
        self.leaves: list[LeafModel] = []
        self.notes: list[str] = []

    def element(self, tree: Decide | Act) -> Element:
        if isinstance(tree, Act):
            self.leaves.append(LeafModel(tree.id, "StatefulAction", "RUNNING" if self._shape == "fallback" else ""))
            return node(tree.id)
        predicate = self._predicate(tree.predicate)
        if predicate is None:
            return self.element(tree.no)
        yes, no = self.element(tree.yes), self.element(tree.no)
        if self._shape == "while":
            return node("WhileDoElse", predicate, yes, no)
        return node("ReactiveFallback", node("ReactiveSequence", predicate, yes), no)

    def _predicate(self, predicate: Asked | Threshold) -> Element | None:
        """The condition; None if it can never be true."""
        if isinstance(predicate, Asked):
            self.leaves.append(LeafModel(predicate.id, "Condition"))
            return node(predicate.id)
        grid = self._grids[predicate.signal]
        below = grid.below(predicate)
        if below in (0, grid.count):
            always = (below == grid.count) != predicate.above
            what = "only whether it is fresh is asked" if always else "its branch is left out"
            self.notes.append(
                f"{predicate.signal} {'>' if predicate.above else '<='} {plain(predicate.limit)} is "
                f"{'always' if always else 'never'} true in the signal's range: {what}"
            )
            return node("ScriptCondition", code=f"{predicate.signal.partition('.')[0]}.fresh") if always else None
        bound = decimal(grid.at(below - 1))
        return node("ScriptCondition", code=f"{predicate.signal} {'>' if predicate.above else '<='} {bound}")


def convert(tree: Decide | Act, known: dict[str, Grid], shape: str) -> Conversion:
    """The behaviour tree. `shape`: "fallback", Lemma 7, for actions that are always RUNNING; or "while"."""
    converter = _Converter(known, shape)
    root = converter.element(tree)
    return Conversion(root, converter.leaves, converter.notes)


def inputs(tree: Decide | Act, known: dict[str, Grid]) -> dict[str, SignalInput]:
    """For each signal the raw values to try: both sides of each threshold, and both ends of the range.

    Both the source's comparison and the result's are steps, so what agrees at these agrees between them.
    """
    places: dict[str, set[int]] = {name: {0, grid.count - 1} for name, grid in known.items()}
    for each in decisions(tree):
        if isinstance(each, Decide) and isinstance(each.predicate, Threshold):
            grid = known[each.predicate.signal]
            below = grid.below(each.predicate)
            places[each.predicate.signal] |= {place for place in (below - 1, below) if 0 <= place < grid.count}
    return {
        name: SignalInput(grid.scale, grid.offset, tuple(sorted(grid.raw_at(place) for place in places[name])))
        for name, grid in known.items()
    }


class DecisionMachine:
    """The decision tree itself, ticked. A predicate over a signal that is not fresh is false."""

    def __init__(self, tree: Decide | Act, signals: dict[str, SignalInput], shape: str) -> None:
        self._tree = tree
        self._signals = signals
        self._statuses = (RUNNING,) if shape == "fallback" else (RUNNING, SUCCESS, FAILURE)

    def start(self) -> State:
        """There is no state."""
        return ()

    def _holds(self, predicate: Asked | Threshold, answers: Answers) -> bool:
        if isinstance(predicate, Asked):
            return answers.ask((predicate.id, ()), (SUCCESS, FAILURE)) == SUCCESS
        if not answers.ask(f"{predicate.signal.partition('.')[0]}.fresh", (1, 0)):
            return False
        known = self._signals[predicate.signal]
        return predicate.holds(known.physical(answers.ask(predicate.signal, known.raws)))

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """Which action is taken, and its status."""
        here = self._tree
        while isinstance(here, Decide):
            here = here.yes if self._holds(here.predicate, answers) else here.no
        return state, (answers.ask((here.id, ()), self._statuses), (here.id,))
