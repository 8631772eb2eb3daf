# SPDX-License-Identifier: MIT
"""What a phase portrait shows, exactly: which leaf acts where, where its step goes, and runs. Nothing is drawn here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.tree import Node
from canopy.plot.geometry import Corners, corners, outline, overlay
from canopy.verify.checks import nodes_of
from canopy.verify.linear import Formula, Polyhedron, State
from canopy.verify.model import FAILURE, RUNNING, STATUSES, SUCCESS, Plant, Variable, number
from canopy.verify.question import node_named
from canopy.verify.regions import Piece, Regions, pieces
from canopy.verify.run import Subject
from canopy.verify.simulate import Run, simulate
from canopy.verify.system import System

MAX_KINDS = 12
"""Fills that can be told from each other."""


@dataclass(frozen=True)
class Region:
    """States where one thing happens, or, with leaves that are free, one of several. `parts` do not overlap.

    `fill`: which of the MAX_KINDS fills it has: 0 SUCCESS, 1 FAILURE, from 2 on what the tree's leaves do.
    """

    label: str
    fill: int
    parts: tuple[Polyhedron, ...]
    polygons: tuple[Corners, ...]
    borders: tuple[tuple[State, State], ...]
    pieces: tuple[Piece, ...]

    def holds(self, state: State) -> bool:
        """Is a state in it?"""
        return any(part.holds(state) for part in self.parts)


@dataclass(frozen=True)
class Arrow:
    """At a state, where the step goes; None: the model leaves it open."""

    state: State
    step: State | None


@dataclass(frozen=True)
class Portrait:
    """A phase portrait of a node. The regions cover the state space and do not overlap."""

    title: str
    axes: tuple[Variable, Variable]
    regions: tuple[Region, ...]
    runs: tuple[Run, ...]
    disturbed: bool

    def region_at(self, state: State) -> Region:
        """The region of a state of the state space."""
        return next(one for one in self.regions if one.holds(state))

    def field(self, columns: int, rows: int) -> list[Arrow]:
        """The arrows on a grid, and in the middle of the polygons of a region in which no point of the grid lies."""
        x, y = self.axes
        grid = [
            (
                x.low + Fraction(2 * column + 1, 2 * columns) * (x.high - x.low),
                y.low + Fraction(2 * row + 1, 2 * rows) * (y.high - y.low),
            )
            for column in range(columns)
            for row in range(rows)
        ]
        more = [
            _middle(polygon)
            for region in self.regions
            if not any(region.holds(state) for state in grid)
            for polygon in region.polygons
            if len(polygon) > 2
        ]
        return [arrow for state in (*grid, *more) if (arrow := self.arrow(state)) is not None]

    def arrow(self, state: State) -> Arrow | None:
        """The step at a state, without its disturbance; None where nothing acts, so that the state stays."""
        region = self.region_at(state)
        steps = [piece.step for piece in region.pieces if piece.states.holds(state)]
        if any(limit is not None for step in steps for limit in step.shorter):
            return Arrow(state, None)
        moved = {tuple(one.at(state) - x for one, x in zip(step.maps, state, strict=True)) for step in steps}
        if not any(value for step in moved for value in step):
            return None
        return Arrow(state, moved.pop()) if len(moved) == 1 else Arrow(state, None)


def _middle(polygon: Corners) -> State:
    """A state strictly within a polygon."""
    return tuple(sum(values, Fraction(0)) / len(polygon) for values in zip(*polygon, strict=True))


def _label(piece: Piece) -> str:
    """What happens in a piece; the status is named where it is not that of a leaf that acts."""
    return piece.label if piece.status == RUNNING or not piece.acting else f"{piece.label} ({piece.status})"


def _fills(labels: Sequence[str], subject: Subject) -> list[int]:
    """The fill of each region: that of a leaf is the same in the portraits of all parts of a tree, if there is room."""
    leaves = [node for node in nodes_of(subject.tree.root) if node.leaf is not None]
    known = [SUCCESS, FAILURE]
    for node in leaves:
        model = subject.plant.leaves.get(node.leaf.id) if node.leaf is not None else None
        names = [mode.name for mode in model.modes] if model is not None else []
        known += [f"{node.name} [{name}]" if name else node.name for name in names]
    known = list(dict.fromkeys(known))
    known += [label for label in labels if label not in known]
    if len(known) > MAX_KINDS:
        known = [SUCCESS, FAILURE, *(label for label in labels if label not in (SUCCESS, FAILURE))]
    return [known.index(label) for label in labels]


def _regions(made: Sequence[Piece], domain: Polyhedron, subject: Subject) -> tuple[Region, ...]:
    """Pieces in which the same happens are one region; those that overlap are one of their own."""
    sets: dict[str, Formula] = {}
    for piece in sorted(made, key=lambda one: STATUSES.index(one.status)):
        name, one = _label(piece), Formula(domain.width, (piece.states,))
        sets[name] = sets[name] | one if name in sets else one
    result = []
    cells = overlay(sets, domain)
    labels = [" or ".join(names) for names in cells]
    for label, fill, (names, parts) in zip(labels, _fills(labels, subject), cells.items(), strict=True):
        polygons = tuple(corners(part, domain) for part in parts)
        borders = outline(polygons)
        there = tuple(piece for piece in made if _label(piece) in names)
        result.append(Region(label, fill, tuple(parts), polygons, borders, there))
    return tuple(result)


def _axes(plant: Plant) -> tuple[Variable, Variable]:
    """The two variables of a model.

    Raises:
        CompileError: It has another number of them, or one has a range that is too narrow to be drawn.
    """
    if plant.width != 2:
        raise CompileError(
            Place(str(plant.path)),
            f"the model has {plant.width} variable{'s' * (plant.width != 1)}; a phase portrait has two",
            "draw a model with two variables: give it with --model",
        )
    for one in plant.variables:
        if float(one.low) + (float(one.high) - float(one.low)) / 1000 <= float(one.low):
            raise CompileError(
                one.place, f"the range of '{one.name}' is too narrow to be drawn", "give it two different ends"
            )
    return plant.variables[0], plant.variables[1]


def start_of(plant: Plant, text: str) -> State:
    """Reads `x1=80,x2=50`.

    Raises:
        CompileError: It is not a state of the state space.
    """
    place, example = Place("--run"), ",".join(f"{one.name}={number(one.high)}" for one in plant.variables)
    given: dict[str, Fraction] = {}
    for pair in text.split(","):
        name, found, value = (word.strip() for word in pair.partition("="))
        if not found or name in given:
            raise CompileError(place, f"'{text}' is not a state", f"for example {example}")
        try:
            if len(value) > 60 or "e" in value.lower():
                raise ValueError
            given[name] = Fraction(value)
        except (ValueError, ZeroDivisionError):
            raise CompileError(place, f"'{value}' is not a number", f"for example {example}") from None
    names = [one.name for one in plant.variables]
    if sorted(given) != sorted(names):
        raise CompileError(place, f"'{text}' does not give each of {', '.join(names)}", f"for example {example}")
    state = tuple(given[name] for name in names)
    if not plant.domain.holds(state):
        ranges = ", ".join(f"{one.name} from {number(one.low)} to {number(one.high)}" for one in plant.variables)
        raise CompileError(place, f"{plant.shown(state)} is outside of the state space", f"it has {ranges}")
    return state


def portrait(subject: Subject, of: str | None, runs: Sequence[str], steps: int, title: str | None = None) -> Portrait:
    """The portrait of a tree, or of one of its nodes by name or path, with runs of at most `steps` steps.

    Raises:
        CompileError: The model has not two variables, a start is not one, there is no such node, or the tree has no
            meaning as a function of the state.
    """
    plant = subject.plant
    axes = _axes(plant)
    root: Node = subject.tree.root if of is None else node_named(Place("--of"), subject.tree, of, "--of")
    made = pieces(Regions(plant), root)
    regions = _regions(made, plant.domain, subject)
    if max(one.fill for one in regions) >= MAX_KINDS:
        raise CompileError(
            root.place,
            f"'{root.name}' has {len(regions)} kinds of region: too many to be told apart",
            "draw a part of the tree: --of NODE",
        )
    system = System(made, plant.domain)
    goal = frozenset(index for index, piece in enumerate(made) if piece.status == SUCCESS)
    done = tuple(simulate(system, start_of(plant, text), goal, steps) for text in runs)
    disturbed = any(low or high for piece in made for low, high in piece.step.noise)
    return Portrait(root.name if title is None else title, axes, regions, done, disturbed)
