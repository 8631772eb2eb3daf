# SPDX-License-Identifier: MIT
"""The exact arithmetic below `canopy verify` against a solver, on random inequalities."""

from __future__ import annotations

import random
from fractions import Fraction

from canopy.verify.expression import parse_formula
from canopy.verify.linear import Atom, Formula, Polyhedron, nice_point
from canopy.verify.model import number
from canopy.verify.simplex import Empty, Point
from canopy.verify.smt import all_of, script
from canopy.verify.solvers import decide
from canopy.verify.units import Unit, parse_unit


def polyhedron(chance: random.Random, width: int) -> Polyhedron:
    atoms = []
    for _ in range(chance.randint(1, 7)):
        direction = tuple(chance.randint(-3, 3) for _ in range(width))
        atoms.append(Atom(direction, Fraction(chance.randint(-6, 6), chance.randint(1, 4)), chance.random() < 0.4))
    return Polyhedron(width, atoms)


def test_emptiness_is_what_a_solver_says_and_comes_with_its_proof() -> None:
    chance = random.Random(1)
    empty = 0
    for _ in range(1500):
        one = polyhedron(chance, chance.randint(1, 4))
        answer = one.answer
        said = decide(script([all_of(one.atoms)]), "z3")
        assert said == ("unsat" if isinstance(answer, Empty) else "sat")
        if isinstance(answer, Point):
            assert one.holds(answer.at)
            assert one.holds(nice_point(one))
            continue
        empty += 1
        factors = answer.multipliers
        assert all(factor >= 0 for factor in factors)
        for index in range(one.width):
            assert sum(f * atom.direction[index] for f, atom in zip(factors, one.atoms, strict=True)) == 0
        bound = sum((f * atom.bound for f, atom in zip(factors, one.atoms, strict=True)), Fraction(0))
        strict = any(f and atom.strict for f, atom in zip(factors, one.atoms, strict=True))
        assert bound < 0 or (bound == 0 and strict)
    assert 200 < empty < 1300


def test_a_supremum_is_the_least_bound() -> None:
    chance = random.Random(2)
    bounded = 0
    for _ in range(600):
        one = polyhedron(chance, 2)
        direction = (chance.randint(-2, 2), chance.randint(-2, 2))
        if one.is_empty or not any(direction):
            continue
        top = one.supremum(direction)
        if top is None:
            assert not one.meet([Atom(tuple(-d for d in direction), Fraction(-1000), False)]).is_empty
            continue
        bounded += 1
        beyond = Atom(tuple(-d for d in direction), -top.bound, not top.strict)
        assert one.meet([beyond]).is_empty
        near = Atom(tuple(-d for d in direction), -top.bound + Fraction(1, 10**6), True)
        assert not one.meet([near]).is_empty
    assert bounded > 100


def test_a_projection_has_the_states_that_some_choice_goes_with() -> None:
    chance = random.Random(3)
    for _ in range(120):
        one = polyhedron(chance, 3)
        if one.is_empty:
            continue
        flat = one.eliminated(2)
        for _ in range(5):
            x, y = Fraction(chance.randint(-8, 8), 2), Fraction(chance.randint(-8, 8), 2)
            fixed = [Atom((s, 0, 0), s * x, False) for s in (1, -1)] + [Atom((0, s, 0), s * y, False) for s in (1, -1)]
            assert flat.holds((x, y)) is not one.meet(fixed).is_empty


def test_complement_and_disjoint_parts_are_the_same_sets() -> None:
    chance = random.Random(4)
    for _ in range(80):
        one = Formula(2, tuple(polyhedron(chance, 2) for _ in range(3)))
        other, parts = ~one, one.disjoint().parts
        for _ in range(30):
            state = (Fraction(chance.randint(-9, 9), 3), Fraction(chance.randint(-9, 9), 3))
            assert one.holds(state) is not other.holds(state)
            assert sum(part.holds(state) for part in parts) == int(one.holds(state))


def test_formulas_mean_what_python_would_say() -> None:
    texts = [
        "x1 > 0 and not x2 < 0.5",
        "not (x1 > 0 or x2 >= 1) or x1 == x2",
        "0 <= x1 < 1 <= x2",
        "x1 != 1 and (x1 - x2) / 2 <= 3 * 0.5 - -x2",
        "true and not false",
    ]
    units = {"x1": Unit(), "x2": Unit()}
    for text in texts:
        formula = parse_formula(text, units)
        for a in range(-8, 9):
            for b in range(-8, 9):
                x1, x2 = Fraction(a, 4), Fraction(b, 4)
                expected = eval(text, {}, {"x1": x1, "x2": x2, "true": True, "false": False})
                assert formula.holds((x1, x2)) is expected, (text, x1, x2)


def test_numbers_and_units_are_printed_as_they_are_read() -> None:
    assert [number(Fraction(one)) for one in ("0.48", "-0.03", "1/3", "100", "-2.5", "0.0001")] == [
        "0.48", "-0.03", "1/3", "100", "-2.5", "0.0001"
    ]  # fmt: skip
    assert str(parse_unit("m/s^2") * parse_unit("s")) == "m/s"
    assert parse_unit("%/m") * parse_unit("m") == parse_unit("%")
