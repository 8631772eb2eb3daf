# SPDX-License-Identifier: MIT
"""Polyhedra of two variables as polygons with exact corners."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from canopy.verify.linear import Atom, Formula, Polyhedron, State

Corners = tuple[State, ...]
"""Of a convex set, in order around it: one of a point, two of a segment, three or more of an area."""


def _side(one: Atom, corner: State) -> int:
    """-1 within the border of an inequality, 0 on it, 1 beyond."""
    distance = one.direction[0] * corner[0] + one.direction[1] * corner[1] - one.bound
    return (distance > 0) - (distance < 0)


def _crossing(one: Atom, a: State, b: State) -> State:
    """Where the segment from `a` to `b`, which lie on different sides, meets the border."""
    at_a = one.direction[0] * a[0] + one.direction[1] * a[1]
    at_b = one.direction[0] * b[0] + one.direction[1] * b[1]
    share = (one.bound - at_a) / (at_b - at_a)
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def _clipped(corners: Corners, one: Atom) -> Corners:
    """What is left of a convex set within an inequality, its border included (Sutherland and Hodgman)."""
    kept: list[State] = []
    for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
        if _side(one, a) <= 0:
            kept.append(a)
        if _side(one, a) * _side(one, b) < 0:
            kept.append(_crossing(one, a, b))
    return tuple(dict.fromkeys(kept))


def corners(part: Polyhedron, domain: Polyhedron) -> Corners:
    """The corners of the closure of `part` within `domain`, a rectangle; none where `part` is empty."""
    if part.meet(domain).is_empty:
        return ()
    x, y = ((_least(domain, (-1, 0)), _most(domain, (1, 0))), (_least(domain, (0, -1)), _most(domain, (0, 1))))
    result: Corners = ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
    for one in part.atoms:
        result = _clipped(result, one)
        if not result:
            break
    return result


def _most(domain: Polyhedron, direction: tuple[int, int]) -> Fraction:
    top = domain.supremum(direction)
    assert top is not None
    return top.bound


def _least(domain: Polyhedron, direction: tuple[int, int]) -> Fraction:
    return -_most(domain, direction)


def overlay(sets: dict[str, Formula], domain: Polyhedron) -> dict[tuple[str, ...], list[Polyhedron]]:
    """Divides the state space by which of some sets hold there; the parts do not overlap."""
    cells: list[tuple[tuple[str, ...], Polyhedron]] = [((), domain)]
    for name, formula in sets.items():
        outside = ~formula
        following = []
        for names, cell in cells:
            for held, parts in (((*names, name), formula.disjoint().parts), (names, outside.parts)):
                both = (cell.meet(part) for part in parts)
                following += [(held, part) for part in both if not part.is_empty]
        cells = following
    result: dict[tuple[str, ...], list[Polyhedron]] = {}
    for names, cell in cells:
        result.setdefault(names, []).append(cell)
    return result


def outline(polygons: Sequence[Corners]) -> tuple[tuple[State, State], ...]:
    """The edges of a union of convex polygons that do not overlap, without those that lie between two of them."""
    edges = [(a, b) for one in polygons if len(one) > 2 for a, b in zip(one, (*one[1:], one[0]), strict=True)]
    result = []
    for a, b in edges:
        shared = []  # intervals of the edge, as shares of it, where another polygon runs the other way
        for c, d in edges:
            at_c, at_d = _share(a, b, c), _share(a, b, d)
            if at_c is not None and at_d is not None and at_d < at_c:
                shared.append((max(at_d, Fraction(0)), min(at_c, Fraction(1))))
        reached = Fraction(0)
        for low, high in [*sorted(one for one in shared if one[0] < one[1]), (Fraction(1), Fraction(1))]:
            if low > reached:
                result.append((_between(a, b, reached), _between(a, b, low)))
            reached = max(reached, high)
    return tuple(result)


def _between(a: State, b: State, share: Fraction) -> State:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def _share(a: State, b: State, c: State) -> Fraction | None:
    """Where `c` is on the line from `a` (0) to `b` (1); None: beside it."""
    along, beside = (b[0] - a[0], b[1] - a[1]), (c[0] - a[0], c[1] - a[1])
    if along[0] * beside[1] != along[1] * beside[0]:
        return None
    return (along[0] * beside[0] + along[1] * beside[1]) / (along[0] ** 2 + along[1] ** 2)
