# SPDX-License-Identifier: MIT
"""Sequential composition of controllers ("funnels") as a behaviour tree: Burridge's algorithm, and the paper's Lemma 9.

A controller has a domain, from which it brings the robot to its goal. One prepares another when its goal lies inside
the other's domain. As a leaf it SUCCEEDS in its goal, is RUNNING in the rest of its domain, and FAILS elsewhere; the
tree is a Fallback of all, in the order of the queue, and the robot walks through it from right to left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.convert.equivalence import Answers, Shown, State
from canopy.convert.json_input import fields, integer, read_json, text
from canopy.convert.machine import Use
from canopy.convert.regions import Box, Cells, Point, Region
from canopy.convert.writer import LeafModel
from canopy.semantics.spec import FAILURE, HALTED, RUNNING, SUCCESS

MAX_CELLS = 1_000_000
STATUS_WORDS = {RUNNING: "RUNNING", SUCCESS: "SUCCESS", FAILURE: "FAILURE"}


@dataclass(frozen=True)
class Controller:
    """A controller with its regions."""

    id: str
    goal: Region
    domain: Region

    def status(self, point: Point) -> int:
        """What it returns as a leaf. A goal outside of the domain counts, too: there it has nothing to do."""
        if self.goal.holds(point):
            return SUCCESS
        return RUNNING if self.domain.holds(point) else FAILURE


@dataclass(frozen=True)
class Family:
    """Controllers over one state space; the first one's goal is the overall goal."""

    space: Box
    controllers: tuple[Controller, ...]

    def cells(self) -> Cells:
        """What all regions together cut the space into."""
        return Cells(self.space, [region for c in self.controllers for region in (c.goal, c.domain)])


@dataclass(frozen=True)
class Unplaced:
    """A controller that has no place, and a point of its goal that no controller before it takes up."""

    controller: Controller
    stuck: Point


@dataclass
class Order:
    """The controllers in the order of the Fallback, and those that cannot be placed."""

    placed: list[Controller]
    unplaced: list[Unplaced]


def _range(value: Any, place: Place, where: str) -> tuple[int, int]:
    if not isinstance(value, list) or len(value) != 2:
        raise CompileError(place, f"{where} must be [least, greatest]")
    low, high = integer(value[0], place, where), integer(value[1], place, where)
    if low > high:
        raise CompileError(place, f"{where}: {low} is more than {high}")
    return low, high


def _region(value: Any, space: Box, place: Place, where: str) -> Region:
    boxes = value if isinstance(value, list) else [value]
    result = []
    for box in boxes:
        if not isinstance(box, dict):
            raise CompileError(place, f"{where} must be an object of ranges, or a list of them")
        for name in box:
            if name not in space:
                raise CompileError(place, f"{where}: no variable '{name}'", nearest(name, space))
        result.append({name: _range(part, place, f"{where}.{name}") for name, part in box.items()})
    return Region(tuple(result))


def read_family(path: Path) -> Family:
    """Reads the JSON form (docs/convert.md).

    Raises:
        CompileError: it is not valid, or the regions cut the space into too many cells; the message names the place.
    """
    place = Place(str(path))
    top = fields(read_json(path), place, "the file", ("variables", "controllers"))
    if not isinstance(top["variables"], dict) or not top["variables"]:
        raise CompileError(place, "variables must be an object: each variable's [least, greatest]")
    space = {name: _range(value, place, f"variables.{name}") for name, value in top["variables"].items()}
    if not isinstance(top["controllers"], list) or not top["controllers"]:
        raise CompileError(place, "controllers must be a list; the first one's goal is the overall goal")
    controllers: list[Controller] = []
    for number, value in enumerate(top["controllers"]):
        where = f"controllers[{number}]"
        found = fields(value, place, where, ("name", "goal", "domain"))
        name = text(found["name"], place, f"{where}.name")
        if name in [known.id for known in controllers]:
            raise CompileError(place, f"{where}: there are two controllers '{name}'")
        goal = _region(found["goal"], space, place, f"{where}.goal")
        domain = _region(found["domain"], space, place, f"{where}.domain")
        controllers.append(Controller(name, goal, domain))
    family = Family(space, tuple(controllers))
    if len(family.cells()) > MAX_CELLS:
        raise CompileError(place, f"the regions cut the space into more than {MAX_CELLS} cells", "use fewer boxes")
    for controller in controllers:
        if not any(controller.goal.holds(cell) for cell in family.cells()):
            raise CompileError(place, f"the goal of '{controller.id}' is empty, or outside of the variables' ranges")
    return family


def order(family: Family) -> Order:
    """Burridge's breadth-first search from the overall goal; then what lies in what several together take up (Lemma 9).

    Ties keep the order of the file. A controller is placed when each point of its goal lies in the domain, or in the
    goal, of those placed before it: Lemma 9 needs no more than that, and with less the tree would succeed elsewhere.
    """
    cells = list(family.cells())
    inside = {
        c.id: frozenset(i for i, cell in enumerate(cells) if c.status(cell) != FAILURE) for c in family.controllers
    }
    goals = {c.id: frozenset(i for i, cell in enumerate(cells) if c.goal.holds(cell)) for c in family.controllers}
    placed = [family.controllers[0]]
    waiting = list(family.controllers[1:])
    covered = inside[placed[0].id]
    first = 0
    while waiting:
        chosen = []
        if first < len(placed):
            chosen = [c for c in waiting if goals[c.id] <= inside[placed[first].id]]
            first += 1
        else:
            chosen = [c for c in waiting if goals[c.id] <= covered][:1]
            if not chosen:
                break
        placed += chosen
        waiting = [c for c in waiting if c not in chosen]
        covered = covered.union(*(inside[c.id] for c in chosen))
    return Order(placed, [Unplaced(c, cells[min(goals[c.id] - covered)]) for c in waiting])


def leaves(family: Family, placed: Sequence[Controller]) -> list[LeafModel]:
    """The leaves, each with the statuses that its regions let it return."""
    models = []
    cells = list(family.cells())
    for controller in placed:
        found = {controller.status(cell) for cell in cells}
        returns = " ".join(word for status, word in STATUS_WORDS.items() if status in found)
        models.append(LeafModel(controller.id, "StatefulAction", returns))
    return models


def decide(family: Family) -> Callable[[Use, Answers], int]:
    """What a leaf returns: the point of the tick decides, one of each cell."""
    points = list(family.cells())
    known = {controller.id: controller for controller in family.controllers}

    def status(use: Use, answers: Answers) -> int:
        return known[use.name].status(points[answers.ask("point", range(len(points)))])

    return status


def show(status: int, calls: Sequence[tuple[Use, int]]) -> Shown:
    """The root's status, and the controller that has control: the last one asked, unless all failed."""
    asked = [use.name for use, kind in calls if kind != HALTED]
    return status, asked[-1] if status != FAILURE else None


class BurridgeMachine:
    """The original: each controller has an execution region, its domain without those before it, and is run there."""

    def __init__(self, family: Family, placed: Sequence[Controller]) -> None:
        self._points = list(family.cells())
        self._regions: list[frozenset[int]] = []
        taken: frozenset[int] = frozenset()
        for controller in placed:
            domain = frozenset(i for i, cell in enumerate(self._points) if controller.status(cell) != FAILURE)
            self._regions.append(domain - taken)
            taken |= domain
        self._placed = placed

    def start(self) -> State:
        """There is no state."""
        return ()

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """Who is run at a point, and whether the overall goal is reached."""
        where = answers.ask("point", range(len(self._points)))
        for controller, region in zip(self._placed, self._regions, strict=True):
            if where in region:
                reached = self._placed[0].goal.holds(self._points[where])
                return state, (SUCCESS if reached else RUNNING, controller.id)
        return state, (FAILURE, None)
