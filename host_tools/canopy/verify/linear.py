# SPDX-License-Identifier: MIT
"""Convex sets of states, given by linear inequalities with rational numbers, and formulas over such inequalities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import product
from math import gcd, lcm

from canopy.verify.simplex import Empty, Point, Row, Supremum, solve, supremum

State = tuple[Fraction, ...]
Direction = tuple[int, ...]


@dataclass(frozen=True)
class Affine:
    """coefficients · x + constant."""

    coefficients: tuple[Fraction, ...]
    constant: Fraction

    def at(self, state: Sequence[Fraction]) -> Fraction:
        """Its value."""
        return sum((c * x for c, x in zip(self.coefficients, state, strict=True)), self.constant)


@dataclass(frozen=True)
class Atom:
    """direction · x <= bound, or < where `strict`. The direction has whole numbers without a common factor."""

    direction: Direction
    bound: Fraction
    strict: bool

    @property
    def negation(self) -> Atom:
        """The inequality that holds where this one does not."""
        return Atom(tuple(-value for value in self.direction), -self.bound, not self.strict)

    def holds(self, state: Sequence[Fraction]) -> bool:
        """Does a state satisfy it?"""
        value = sum((d * x for d, x in zip(self.direction, state, strict=True)), Fraction(0))
        return value < self.bound if self.strict else value <= self.bound

    @property
    def row(self) -> Row:
        """As the solver takes it."""
        return self.direction, self.bound, self.strict


def atom(expression: Affine, *, strict: bool) -> Atom:
    """The inequality `expression <= 0`, or `< 0`."""
    scale = lcm(*(value.denominator for value in expression.coefficients), 1)
    whole = [int(value * scale) for value in expression.coefficients]
    factor = gcd(*whole)
    if factor == 0:
        return Atom(tuple(whole), -expression.constant, strict)
    return Atom(tuple(value // factor for value in whole), -expression.constant * scale / factor, strict)


def substituted(one: Atom, maps: Sequence[Affine]) -> Atom:
    """The inequality of x that says `one` of (maps(x)): the pre-image."""
    width = len(maps[0].coefficients)
    coefficients = [
        sum((d * m.coefficients[i] for d, m in zip(one.direction, maps, strict=True)), Fraction(0))
        for i in range(width)
    ]
    constant = sum((d * m.constant for d, m in zip(one.direction, maps, strict=True)), -one.bound)
    return atom(Affine(tuple(coefficients), constant), strict=one.strict)


class Polyhedron:
    """The states that satisfy all of some inequalities; of two with one direction the tighter is kept."""

    def __init__(self, width: int, atoms: Iterable[Atom]) -> None:
        tightest: dict[Direction, Atom] = {}
        for one in atoms:
            other = tightest.get(one.direction)
            if other is None or (one.bound, not one.strict) < (other.bound, not other.strict):
                tightest[one.direction] = one
        nothing = tightest.get((0,) * width)
        if nothing is not None and (nothing.bound > 0 or (nothing.bound == 0 and not nothing.strict)):
            del tightest[(0,) * width]  # 0 <= 1 says nothing
        self.width = width
        self.atoms: tuple[Atom, ...] = tuple(tightest[key] for key in sorted(tightest))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Polyhedron) and self.atoms == other.atoms

    def __hash__(self) -> int:
        return hash(self.atoms)

    def meet(self, other: Polyhedron | Iterable[Atom]) -> Polyhedron:
        """The intersection."""
        more = other.atoms if isinstance(other, Polyhedron) else other
        return Polyhedron(self.width, (*self.atoms, *more))

    def holds(self, state: Sequence[Fraction]) -> bool:
        """Is a state in it?"""
        return all(one.holds(state) for one in self.atoms)

    @cached_property
    def answer(self) -> Empty | Point:
        """A point of it, or the proof that there is none."""
        return _solve(self)

    @property
    def is_empty(self) -> bool:
        """Has it no state?"""
        return isinstance(self.answer, Empty)

    def supremum(self, direction: Direction) -> Supremum | None:
        """Of direction · x; None: unbounded. It must not be empty."""
        return _supremum(self, direction)

    def minus(self, other: Polyhedron) -> Iterator[Polyhedron]:
        """What is left without `other`, as disjoint polyhedra that are not empty."""
        kept: list[Atom] = []
        for one in other.atoms:
            part = self.meet([*kept, one.negation])
            if not part.is_empty:
                yield part
            kept.append(one)

    def within(self, other: Polyhedron) -> bool:
        """Is it a subset?"""
        if isinstance(self.answer, Point) and not other.holds(self.answer.at):
            return False  # most questions end here
        return next(self.minus(other), None) is None

    def eliminated(self, keep: int) -> Polyhedron:
        """The projection onto the first `keep` variables (Fourier and Motzkin)."""
        atoms: list[Atom] = list(self.atoms)
        for index in range(self.width - 1, keep - 1, -1):
            atoms = _without(atoms, index)
            atoms = list(_irredundant(Polyhedron(index, atoms)).atoms)
        return Polyhedron(keep, atoms)


@lru_cache(maxsize=200_000)
def _solve(one: Polyhedron) -> Empty | Point:
    return solve([item.row for item in one.atoms], one.width)


@lru_cache(maxsize=200_000)
def _supremum(one: Polyhedron, direction: Direction) -> Supremum | None:
    return supremum([item.row for item in one.atoms], direction)


def _without(atoms: Sequence[Atom], index: int) -> list[Atom]:
    """The inequalities that follow for the variables before `index`, the last one."""
    result = [
        atom(Affine(tuple(map(Fraction, a.direction[:index])), -a.bound), strict=a.strict)
        for a in atoms
        if a.direction[index] == 0
    ]
    above = [a for a in atoms if a.direction[index] > 0]
    below = [a for a in atoms if a.direction[index] < 0]
    for a, b in product(above, below):
        p, q = Fraction(-b.direction[index]), Fraction(a.direction[index])
        coefficients = tuple(p * x + q * y for x, y in zip(a.direction[:index], b.direction[:index], strict=True))
        result.append(atom(Affine(coefficients, -(p * a.bound + q * b.bound)), strict=a.strict or b.strict))
    return result


def _irredundant(one: Polyhedron) -> Polyhedron:
    if one.is_empty:
        return one
    atoms = list(one.atoms)
    for item in one.atoms:
        rest = [other for other in atoms if other is not item]
        if Polyhedron(one.width, [*rest, item.negation]).is_empty:
            atoms = rest
    return Polyhedron(one.width, atoms)


@dataclass(frozen=True)
class Formula:
    """A set of states as a union of polyhedra (disjunctive normal form), and its complement as another one."""

    width: int
    parts: tuple[Polyhedron, ...]

    def holds(self, state: Sequence[Fraction]) -> bool:
        """Is a state in it?"""
        return any(part.holds(state) for part in self.parts)

    def __and__(self, other: Formula) -> Formula:
        both = (a.meet(b) for a, b in product(self.parts, other.parts))
        return Formula(self.width, tuple(part for part in both if not part.is_empty))

    def __or__(self, other: Formula) -> Formula:
        return Formula(self.width, tuple(dict.fromkeys((*self.parts, *other.parts))))

    def __invert__(self) -> Formula:
        """The complement, as disjoint parts."""
        left = [Polyhedron(self.width, ())]
        for part in self.parts:
            left = [rest for one in left for rest in one.minus(part)]
        return Formula(self.width, tuple(left))

    def disjoint(self) -> Formula:
        """The same set in parts that do not overlap."""
        done: list[Polyhedron] = []
        for part in self.parts:
            left = [part]
            for other in done:
                left = [rest for one in left for rest in one.minus(other)]
            done += left
        return Formula(self.width, tuple(done))

    @property
    def is_empty(self) -> bool:
        """Has it no state?"""
        return all(part.is_empty for part in self.parts)

    def point(self) -> State | None:
        """Some state of it."""
        for part in self.parts:
            if isinstance(part.answer, Point):
                return nice_point(part)
        return None


def everything(width: int) -> Formula:
    """All states."""
    return Formula(width, (Polyhedron(width, ()),))


def nothing(width: int) -> Formula:
    """No state."""
    return Formula(width, ())


def nice_point(one: Polyhedron) -> State:
    """A state of a polyhedron that is not empty, with short numbers: extreme where it can be, else round ones."""
    fixed: list[Fraction] = []
    for index in range(one.width):
        unit = tuple(int(i == index) for i in range(one.width))
        chosen: Fraction | None = None
        for direction in (unit, tuple(-value for value in unit)):
            top = one.supremum(direction)
            if top is not None:
                value = top.bound * (1 if direction is unit else -1)
                if not one.meet(_equal(unit, value)).is_empty and (
                    chosen is None or len(str(value)) < len(str(chosen))
                ):
                    chosen = value
        if chosen is None:
            chosen = _inside(one, unit)
        fixed.append(chosen)
        one = one.meet(_equal(unit, chosen))
    return tuple(fixed)


def _equal(direction: Direction, value: Fraction) -> list[Atom]:
    return [Atom(direction, value, False), Atom(tuple(-d for d in direction), -value, False)]


def _inside(one: Polyhedron, unit: Direction) -> Fraction:
    """A value with few digits strictly between the bounds of a variable; a polyhedron that is not empty has one."""
    high, low = one.supremum(unit), one.supremum(tuple(-value for value in unit))
    if high is None and low is None:
        return Fraction(0)
    if high is None or low is None:
        return high.bound - 1 if high is not None else 1 - low.bound if low is not None else Fraction(0)
    bottom, top = -low.bound, high.bound
    for digits in range(40):
        scale = 10**digits
        value = Fraction(int(bottom * scale // 1) + 1, scale)
        if bottom < value < top:
            return value
    return (bottom + top) / 2
