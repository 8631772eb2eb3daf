# SPDX-License-Identifier: MIT
"""Leaves that compare not the state but a number of their arithmetic: steps of the DBC's signals, or binary32.

A state is rounded to the nearest number of the arithmetic (halves up in steps, to even in binary32), and so are the
constants of binary32. Rounding keeps the order: where a leaf compares one variable with a constant, the states are
those below or above another constant. So the regions of the rounded state are exact, and still divide the state space.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, floor

from canopy.compiler.bus_model import Bus
from canopy.compiler.errors import CompileError, Place
from canopy.verify.checks import signal_of
from canopy.verify.linear import Atom, Formula, Polyhedron
from canopy.verify.model import LeafModel, Mode, Plant, Variable

SIGNALS, BINARY32 = "signals", "binary32"
ARITHMETICS = (SIGNALS, BINARY32)
TITLES = {SIGNALS: "in steps of the DBC", BINARY32: "in binary32"}
_LARGEST = 2**127


@dataclass(frozen=True)
class Border:
    """States on one side of `bound`, with it or without it (`strict`)."""

    bound: Fraction
    strict: bool


class Steps:
    """Whole numbers of steps: step * n + offset."""

    def __init__(self, step: Fraction, offset: Fraction) -> None:
        self._step = step
        self._offset = offset
        self.spacing = step

    def below(self, constant: Fraction, *, strict: bool) -> Border:
        """The states whose rounded value is below a constant, or, if not `strict`, equal to it."""
        steps = (constant - self._offset) / self._step
        last = ceil(steps) - 1 if strict else floor(steps)
        return Border(last * self._step + self._offset + self._step / 2, True)

    def above(self, constant: Fraction, *, strict: bool) -> Border:
        """The states whose rounded value is above a constant, or equal to it."""
        first = self.below(constant, strict=not strict).bound
        return Border(first, False)


class Binary32:
    """IEEE 754 binary32, rounded to nearest, ties to even. `largest`: of the variable's range."""

    def __init__(self, largest: Fraction) -> None:
        self.spacing = _neighbour(_nearest(largest), 1) - _nearest(largest)

    def below(self, constant: Fraction, *, strict: bool) -> Border:
        """As Steps.below(); the constant is rounded, too."""
        near = _nearest(constant)
        last = _neighbour(near, -1) if strict else near
        return Border((last + _neighbour(last, 1)) / 2, not _is_even(last))

    def above(self, constant: Fraction, *, strict: bool) -> Border:
        """As Steps.above()."""
        border = self.below(constant, strict=not strict)
        return Border(border.bound, not border.strict)


Arithmetic = Steps | Binary32


def _bits(value: float) -> int:
    """The number of a binary32 in their order; 0.0 has 0."""
    (raw,) = struct.unpack("<i", struct.pack("<f", value))
    return int(raw) if raw >= 0 else -(raw & 0x7FFFFFFF)


def _of_bits(bits: int) -> Fraction:
    (value,) = struct.unpack("<f", struct.pack("<I", bits if bits >= 0 else -bits | 0x80000000))
    return Fraction(value)


def _nearest(value: Fraction) -> Fraction:
    """The binary32 nearest to a number, ties to even."""
    start = _bits(float(value))
    around = [start - 1, start, start + 1]
    return _of_bits(min(around, key=lambda bits: (abs(_of_bits(bits) - value), bits % 2)))


def _neighbour(value: Fraction, direction: int) -> Fraction:
    return _of_bits(_bits(float(value)) + direction)


def _is_even(value: Fraction) -> bool:
    return _bits(float(value)) % 2 == 0


def rounded(plant: Plant, name: str, bus: Bus | None) -> Plant:
    """The model with leaves that decide by the rounded state.

    Its state space is one step wider at each end, since a leaf may act in half a step more. Runs start where they did.

    Raises:
        CompileError: A leaf compares a sum of variables; a variable has no signal, or the signal no steps.
    """
    arithmetics = [_arithmetic(one, name, bus) for one in plant.variables]
    leaves = {leaf.id: _leaf(leaf, arithmetics) for leaf in plant.leaves.values()}
    return replace(plant, leaves=leaves, room=tuple(kind.spacing for kind in arithmetics))


def _arithmetic(variable: Variable, name: str, bus: Bus | None) -> Arithmetic:
    largest = max(abs(variable.low), abs(variable.high))
    if name == BINARY32:
        if largest > _LARGEST:
            raise CompileError(variable.place, f"the range of '{variable.name}' is too large for binary32")
        return Binary32(largest)
    if not variable.signal:
        raise CompileError(
            variable.place, f"variable '{variable.name}' has no signal, so it has no steps", "give it: signal = …"
        )
    signal = signal_of(bus, variable.signal) if bus is not None else None
    if signal is None or signal.is_float:
        raise CompileError(variable.place, f"'{variable.signal}' has no steps: it is floating point")
    return Steps(abs(Fraction(signal.scale)), Fraction(signal.offset))


def _leaf(leaf: LeafModel, arithmetics: list[Arithmetic]) -> LeafModel:
    def of(formula: Formula, place: Place) -> Formula:
        parts = (_part(part, arithmetics, _sums(leaf, place)) for part in formula.parts)
        return Formula(formula.width, tuple(part for part in parts if not part.is_empty))

    regions = {status: of(formula, leaf.place) for status, formula in leaf.regions.items()}
    return replace(leaf, regions=regions, modes=tuple(_mode(mode, of) for mode in leaf.modes))


def _mode(mode: Mode, of: Callable[[Formula, Place], Formula]) -> Mode:
    return replace(mode, when=of(mode.when, mode.place))


def _sums(leaf: LeafModel, place: Place) -> CompileError:
    message = f"leaf '{leaf.id}' compares a sum of variables, and nobody says how its C rounds that"
    return CompileError(place, message, "such a model can be verified over the reals only")


def _part(part: Polyhedron, arithmetics: list[Arithmetic], error: CompileError) -> Polyhedron:
    atoms = []
    for one in part.atoms:
        places = [place for place, value in enumerate(one.direction) if value]
        if not places:
            atoms.append(one)
            continue
        if len(places) > 1:
            raise error
        sign = one.direction[places[0]]
        arithmetic = arithmetics[places[0]]
        unit = tuple(int(place == places[0]) for place in range(part.width))
        if sign > 0:
            border = arithmetic.below(one.bound / sign, strict=one.strict)
            atoms.append(Atom(unit, border.bound, border.strict))
        else:
            border = arithmetic.above(one.bound / sign, strict=one.strict)
            atoms.append(Atom(tuple(-value for value in unit), -border.bound, border.strict))
    return Polyhedron(part.width, atoms)
