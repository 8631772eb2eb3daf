# SPDX-License-Identifier: MIT
"""Steps of a proof as SMT-LIB formulas over v0, v1, …: each has no solution if the step is right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

from canopy.verify.invariant import Invariant, combined
from canopy.verify.linear import Atom, Formula, Polyhedron, substituted
from canopy.verify.ranking import Ranking
from canopy.verify.system import System, widened
from canopy.verify.unroll import Found

MAX_NAMES = 64


def _number(value: Fraction) -> str:
    size = f"{abs(value.numerator)}.0"
    text = size if value.denominator == 1 else f"(/ {size} {value.denominator}.0)"
    return f"(- {text})" if value < 0 else text


def _atom(one: Atom) -> str:
    terms = [f"(* {_number(Fraction(d))} v{i})" for i, d in enumerate(one.direction) if d]
    total = f"(+ 0.0 {' '.join(terms)})" if terms else "0.0"
    return f"({'<' if one.strict else '<='} {total} {_number(one.bound)})"


def all_of(atoms: Iterable[Atom], *more: str) -> str:
    """The conjunction."""
    return f"(and true {' '.join([*map(_atom, atoms), *more])})"


def any_of(parts: Iterable[str]) -> str:
    """The disjunction."""
    return f"(or false {' '.join(parts)})"


def script(steps: Sequence[str]) -> str:
    """All steps at once: satisfiable if one of them is wrong."""
    names = "".join(f"(declare-const v{index} Real)\n" for index in range(MAX_NAMES))
    return f"{names}(assert {any_of(steps)})\n"


def _lead(system: System, index: int, inside: Sequence[Atom], target: Polyhedron) -> list[Atom]:
    """(State, choices) of a piece, and of `inside`, that lead into `target`."""
    one = system.open[index]
    total = one.states.width
    after = [substituted(item, one.maps) for item in target.atoms]
    return [*one.states.atoms, *(widened(item, total) for item in inside), *after]


def _not_after(system: System, index: int, kept: Polyhedron) -> str:
    maps = system.open[index].maps
    return f"(not {all_of(substituted(item, maps) for item in kept.atoms)})"


def leads(system: System, index: int, target: Polyhedron, inside: Sequence[Atom] = ()) -> str:
    """A step from a piece, and from `inside`, into `target`."""
    return all_of(_lead(system, index, inside, target))


def held_by(part: Polyhedron, kept: Formula) -> str:
    """A state of a polyhedron that is not in a set."""
    return all_of(part.atoms, *(f"(not {all_of(one.atoms)})" for one in kept.parts))


def meets(one: Polyhedron, other: Polyhedron) -> str:
    """A state of both."""
    return all_of([*one.atoms, *other.atoms])


def invariant_steps(invariant: Invariant) -> list[str]:
    """A start that is not in it, or a step that leaves it."""
    system = invariant.system
    kept = [invariant.states(index) for index in range(len(system.pieces))]
    steps = []
    for index, piece in enumerate(system.pieces):
        known = kept[index]
        starts = any_of(all_of(part.atoms) for part in invariant.start.parts)
        outside = [f"(not {all_of(known.atoms)})"] if known is not None else []
        steps.append(all_of(piece.states.atoms, starts, *outside))
        for source, states in enumerate(kept):
            if states is not None:
                missed = [_not_after(system, source, known)] if known is not None else []
                steps.append(all_of(_lead(system, source, states.atoms, piece.states), *missed))
    return steps


def excluded_steps(invariant: Invariant, bad: Formula) -> list[str]:
    """A state of the invariant that is bad."""
    reached = (invariant.states(index) for index in range(len(invariant.system.pieces)))
    return [all_of([*one.atoms, *part.atoms]) for one in reached for part in bad.parts if one is not None]


def ranking_steps(invariant: Invariant, ranking: Ranking) -> list[str]:
    """A step back in the order, or one within a piece that is slower than said, or ends beyond."""
    system = invariant.system
    steps = []
    for place, one in enumerate(ranking.leaving):
        states = invariant.states(one.piece)
        assert states is not None
        for other in ranking.leaving[:place]:
            target = system.pieces[other.piece].states
            steps.append(all_of(_lead(system, one.piece, states.atoms, target)))
        again = _lead(system, one.piece, states.atoms, system.pieces[one.piece].states)
        if one.direction is None:
            steps.append(all_of(again))
            continue
        after = combined(one.direction, system.open[one.piece].maps)
        before = widened(Atom(one.direction, Fraction(0), False), len(after.coefficients)).direction
        gain = [a - b for a, b in zip(after.coefficients, before, strict=True)]
        terms = " ".join(f"(* {_number(value)} v{i})" for i, value in enumerate(gain))
        steps.append(all_of(again, f"(< (+ {terms}) {_number(one.speed - after.constant)})"))
        below = Atom(one.direction, one.low, True)
        above = Atom(one.direction, one.high, False).negation
        steps += [all_of([*states.atoms, below]), all_of([*states.atoms, above])]
    return steps


def backward_steps(system: System, found: Found, bad: Formula, start: Formula) -> list[str]:
    """A bad state or a predecessor that the set of unrolling has not, or a start that it has."""
    known: dict[int, list[Polyhedron]] = {index: [] for index in range(len(system.pieces))}
    for index, states in found.levels[0] if found.levels else ():
        known[index].append(states)
    missed = {index: [f"(not {all_of(one.atoms)})" for one in sets] for index, sets in known.items()}
    steps = []
    for index, piece in enumerate(system.pieces):
        steps += [all_of([*piece.states.atoms, *part.atoms], *missed[index]) for part in bad.parts]
        for sets in known.values():
            steps += [all_of(_lead(system, index, (), one), *missed[index]) for one in sets]
        steps += [all_of([*one.atoms, *part.atoms]) for one in known[index] for part in start.parts]
    return steps


def level_steps(system: System, outside: Sequence[int], found: Found, start: Formula) -> list[str]:
    """A state that is one level further away than the unrolling knows, or a start on the last level."""
    steps = []
    for nearer, further in zip(found.levels, found.levels[1:], strict=False):
        missed: dict[int, list[str]] = {index: [] for index in outside}
        for index, states in further:
            missed[index].append(f"(not {all_of(states.atoms)})")
        for index in outside:
            steps += [all_of(_lead(system, index, (), states), *missed[index]) for _, states in nearer]
    last = found.levels[-1] if found.levels else ()
    steps += [all_of([*states.atoms, *part.atoms]) for _, states in last for part in start.parts]
    return steps
