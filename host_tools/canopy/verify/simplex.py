# SPDX-License-Identifier: MIT
"""Linear programming in exact arithmetic, on the few rows that a model of a robot has.

Everything that `canopy verify` proves is in the end "these linear inequalities have no solution". By Farkas and Motzkin
there is then a sum of them, with multipliers that are not negative, which reads 0 < 0 or 0 <= -1: the certificate. So
this module looks for multipliers, and the state that solves the inequalities, if there is one, is the dual of that.

The tableau holds whole numbers over one common denominator (Edmonds), and Bland's rule makes it end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

Row = tuple[tuple[int, ...], Fraction, bool]
"""coefficients, bound, strict: coefficients · x < bound, or <= if not strict."""


@dataclass(frozen=True)
class Empty:
    """No solution. `multipliers` are those of the given rows, in their order."""

    multipliers: tuple[Fraction, ...]


@dataclass(frozen=True)
class Point:
    """A solution."""

    at: tuple[Fraction, ...]


@dataclass(frozen=True)
class Supremum:
    """The least upper bound of a direction, and the sum of rows that shows it; `strict`: it is not reached."""

    bound: Fraction
    strict: bool
    multipliers: tuple[Fraction, ...]


class _Tableau:
    """min cost · y, matrix · y = right, y >= 0; `right` must not be negative. One artificial column for each row."""

    def __init__(self, matrix: Sequence[Sequence[int]], right: Sequence[int]) -> None:
        count = len(matrix)
        self.width = len(matrix[0])
        self.rows = [[*row, *(int(i == k) for k in range(count)), right[i]] for i, row in enumerate(matrix)]
        self.basis = [self.width + i for i in range(count)]
        self.denominator = 1
        totals = [-sum(column) for column in zip(*self.rows, strict=True)]
        totals[self.width : self.width + count] = [0] * count
        self.objective = totals

    def _pivot(self, row: int, column: int) -> None:
        pivot_row, old = self.rows[row], self.denominator
        pivot = pivot_row[column]
        for other in (*self.rows, self.objective):
            if other is pivot_row:
                continue
            factor = other[column]
            if factor:
                other[:] = [(a * pivot - factor * b) // old for a, b in zip(other, pivot_row, strict=True)]
            elif pivot != old:
                other[:] = [a * pivot // old for a in other]
        self.denominator = pivot
        self.basis[row] = column

    def minimise(self) -> bool:
        """Runs to the optimum; False: there is none, the cost falls without end."""
        while True:
            column = next((j for j in range(self.width) if self.objective[j] < 0), None)
            if column is None:
                return True
            best: tuple[Fraction, int, int] | None = None
            for index, row in enumerate(self.rows):
                if row[column] > 0:
                    candidate = (Fraction(row[-1], row[column]), self.basis[index], index)
                    best = candidate if best is None else min(best, candidate)
            if best is None:
                return False
            self._pivot(best[2], column)

    def leave_artificials(self) -> None:
        """After a feasible phase 1: artificial columns that are still basic, at 0, go out where they can."""
        for index, row in enumerate(self.rows):
            if self.basis[index] < self.width:
                continue
            column = next((j for j in range(self.width) if row[j]), None)
            if column is None:
                continue
            if row[column] < 0:
                row[:] = [-value for value in row]
            self._pivot(index, column)

    def price(self, costs: Sequence[int]) -> None:
        """Replaces the objective: costs of the columns, the artificial ones free."""
        scaled = [cost * self.denominator for cost in costs] + [0] * (len(self.objective) - self.width)
        for index, row in enumerate(self.rows):
            basic = self.basis[index]
            cost = costs[basic] if basic < self.width else 0
            if cost:
                scaled = [a - cost * b for a, b in zip(scaled, row, strict=True)]
        self.objective = scaled

    def solution(self) -> list[Fraction]:
        values = [Fraction(0)] * self.width
        for index, column in enumerate(self.basis):
            if column < self.width:
                values[column] = Fraction(self.rows[index][-1], self.denominator)
        return values

    @property
    def infeasible(self) -> bool:
        return bool(self.objective[-1])

    def duals(self) -> list[Fraction]:
        """Of phase 1: what each row is worth."""
        return [
            1 - Fraction(value, self.denominator) for value in self.objective[self.width : self.width + len(self.rows)]
        ]


def solve(rows: Sequence[Row], variables: int) -> Empty | Point:
    """Decides whether the rows have a common solution."""
    scale = lcm(*(row[1].denominator for row in rows), 1)
    matrix = [[row[0][i] for row in rows] + [0, 0] for i in range(variables)]
    matrix.append([int(row[2]) for row in rows] + [1, 0])  # the row 0 < 1 stands for "the sum is below 0"
    matrix.append([int(row[1] * scale) for row in rows] + [scale, 1])
    tableau = _Tableau(matrix, [0] * variables + [1, 0])
    tableau.minimise()
    if not tableau.infeasible:
        return Empty(tuple(tableau.solution()[: len(rows)]))
    duals = tableau.duals()
    weight = -duals[-1] * scale
    return Point(tuple(dual / weight for dual in duals[:variables]))


def supremum(rows: Sequence[Row], direction: Sequence[int]) -> Supremum | None:
    """The supremum of direction · x over the solutions of the rows, of which there must be some; None: unbounded."""
    signs = [-1 if value < 0 else 1 for value in direction]
    matrix = [[sign * row[0][i] for row in rows] for i, sign in enumerate(signs)]
    if not rows:
        return None
    tableau = _Tableau(matrix, [abs(value) for value in direction])
    tableau.minimise()
    if tableau.infeasible:
        return None
    tableau.leave_artificials()
    scale = lcm(*(row[1].denominator for row in rows))
    tableau.price([int(row[1] * scale) for row in rows])
    if not tableau.minimise():
        raise ValueError("supremum() of inequalities that have no solution")
    multipliers = tuple(tableau.solution())
    bound = sum((m * row[1] for m, row in zip(multipliers, rows, strict=True)), Fraction(0))
    return Supremum(bound, any(m and row[2] for m, row in zip(multipliers, rows, strict=True)), multipliers)
