# SPDX-License-Identifier: MIT
"""The model of a plant and its leaves, as read from TOML (docs/verify.md): what each leaf returns and does where.

Everything is exact: numbers are rational, regions and guards unions of polyhedra, updates affine.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, Place
from canopy.verify.linear import Affine, Atom, Formula, Polyhedron, State
from canopy.verify.units import Unit

Status = str
SUCCESS, RUNNING, FAILURE = "SUCCESS", "RUNNING", "FAILURE"
STATUSES: tuple[Status, ...] = (SUCCESS, RUNNING, FAILURE)


@dataclass(frozen=True)
class Variable:
    """A part of the state, from `low` to `high`, both included. `signal`: Message.Signal of the DBC that shows it."""

    name: str
    unit: Unit
    low: Fraction
    high: Fraction
    signal: str
    place: Place = field(compare=False)


@dataclass(frozen=True)
class Step:
    """Where the state goes in one step. For each variable either its map plus a disturbance, or any shorter step.

    `maps`: the next value. `noise`: least and greatest disturbance, added to it. `shorter`: where it is a number, the
    variable may go anywhere in its range that is less than that away, and its map counts for nothing.
    """

    maps: tuple[Affine, ...]
    noise: tuple[tuple[Fraction, Fraction], ...]
    shorter: tuple[Fraction | None, ...]

    def moves(self, index: int) -> bool:
        """Does it do anything to a variable?"""
        still = identity(len(self.maps))[index]
        return self.maps[index] != still or any(self.noise[index]) or self.shorter[index] is not None


def identity(width: int) -> tuple[Affine, ...]:
    """Every variable stays."""
    rows = (tuple(Fraction(int(i == k)) for i in range(width)) for k in range(width))
    return tuple(Affine(row, Fraction(0)) for row in rows)


def standing_still(width: int) -> Step:
    """The step in which nothing acts."""
    return Step(identity(width), ((Fraction(0), Fraction(0)),) * width, (None,) * width)


@dataclass(frozen=True)
class Mode:
    """What a leaf does while it is RUNNING and the state is in `when`, for the leaf, and in `where`, for the plant.

    `writes`: signals that its C sets there.
    """

    name: str
    when: Formula
    where: Formula
    step: Step
    writes: tuple[tuple[str, str | int], ...]
    place: Place = field(compare=False)


@dataclass(frozen=True)
class LeafModel:
    """A leaf: where it returns what. With `free` it may return anything that it declares, wherever the state is."""

    id: str
    regions: dict[Status, Formula] = field(compare=False)
    modes: tuple[Mode, ...]
    free: bool
    place: Place = field(compare=False)


@dataclass(frozen=True)
class Claim:
    """What is to be shown. `options` is the table as it stands in the file, `index` its place among the claims."""

    name: str
    kind: str
    options: dict[str, Any] = field(compare=False)
    index: int
    place: Place = field(compare=False)


@dataclass(frozen=True)
class Plant:
    """A model file. `room`: by how much the state space is wider than the variables' ranges; empty: not at all."""

    path: Path
    variables: tuple[Variable, ...]
    leaves: dict[str, LeafModel] = field(compare=False)
    claims: tuple[Claim, ...]
    room: tuple[Fraction, ...] = ()

    @property
    def width(self) -> int:
        """Number of variables."""
        return len(self.variables)

    @property
    def units(self) -> dict[str, Unit]:
        """Of the variables, in the order of the state."""
        return {one.name: one.unit for one in self.variables}

    @property
    def declared(self) -> Polyhedron:
        """Each variable in its range: where runs may start."""
        return self._box((Fraction(0),) * self.width)

    @property
    def domain(self) -> Polyhedron:
        """The state space."""
        return self._box(self.room or (Fraction(0),) * self.width)

    def _box(self, room: tuple[Fraction, ...]) -> Polyhedron:
        atoms = []
        for index, (one, more) in enumerate(zip(self.variables, room, strict=True)):
            unit = tuple(int(i == index) for i in range(self.width))
            atoms.append(Atom(unit, one.high + more, False))
            atoms.append(Atom(tuple(-value for value in unit), more - one.low, False))
        return Polyhedron(self.width, atoms)

    def shown(self, state: State) -> str:
        """A state as messages print it."""
        return ", ".join(
            f"{one.name} = {number(value)}{f' {one.unit}' if one.unit.powers else ''}"
            for one, value in zip(self.variables, state, strict=True)
        )

    def error(self, place: Place, message: str, help_text: str = "") -> CompileError:
        """An error in this file."""
        return CompileError(place, message, help_text)


def number(value: Fraction) -> str:
    """A decimal number where it has an end, else a fraction."""
    denominator = value.denominator
    for prime in (2, 5):
        while denominator % prime == 0:
            denominator //= prime
    if denominator != 1:
        return str(value)
    digits = 0
    while (value * 10**digits).denominator != 1:
        digits += 1
    text = f"{abs(int(value * 10**digits)):0{digits + 1}d}"
    text = f"{text[:-digits]}.{text[-digits:]}" if digits else text
    return f"-{text}" if value < 0 else text
