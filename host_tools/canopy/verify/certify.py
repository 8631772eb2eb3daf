# SPDX-License-Identifier: MIT
"""Writes certificates: canopy.certificate says what has to be shown, and the numbers for it are found here."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from fractions import Fraction
from math import lcm
from pathlib import Path
from typing import Any

from canopy.certificate.check import FORMAT, Evidence, encoded, needed
from canopy.certificate.formula import Part, RejectedError, Row, Union
from canopy.certificate.obligations import Claim as Asked
from canopy.certificate.obligations import Rows, longest
from canopy.certificate.system import Files
from canopy.certificate.system import Piece as Plain
from canopy.verify.invariant import Invariant, directions
from canopy.verify.linear import Affine, Atom, Formula, Polyhedron, atom
from canopy.verify.model import Claim, Step
from canopy.verify.ranking import Leaving, Ranking, rank
from canopy.verify.regions import Piece
from canopy.verify.simplex import Empty, solve
from canopy.verify.system import System
from canopy.verify.unroll import Limit, into

Json = Any
LISTS = ("absent", "backward", "inside", "invariant", "proofs", "ranking")


def _polyhedron(part: Part, width: int) -> Polyhedron:
    return Polyhedron(width, [atom(Affine(row.coefficients, -row.bound), strict=row.strict) for row in part])


def _formula(union: Union, width: int) -> Formula:
    parts = (_polyhedron(part, width) for part in union)
    return Formula(width, tuple(part for part in parts if not part.is_empty))


def _piece(plain: Plain, width: int) -> Piece:
    sums = tuple(Affine(one.coefficients, one.constant) for one in plain.step.sums)
    step = Step(sums, plain.step.noise, plain.step.shorter)
    return Piece(
        _polyhedron(plain.rows, width), plain.status, "+".join(plain.acting) or plain.status, step, plain.acting
    )


def _rows(atoms: Iterable[Atom]) -> Json:
    return [[[str(value) for value in one.direction], str(one.bound), one.strict] for one in atoms]


def _proof(rows: Rows) -> Json:
    """Multipliers that sum the rows up to nothing.

    Raises:
        RejectedError: The rows have a solution.
    """
    scales = [lcm(*(value.denominator for value in row.coefficients)) for row in rows]
    whole = [
        (tuple(int(value * scale) for value in row.coefficients), row.bound * scale, row.strict)
        for row, scale in zip(rows, scales, strict=True)
    ]
    answer = solve(whole, len(rows[0].coefficients))
    if not isinstance(answer, Empty):
        raise RejectedError("what was found does not show the claim")
    scaled = (m * scale for m, scale in zip(answer.multipliers, scales, strict=True))
    return [[place, str(multiplier)] for place, multiplier in enumerate(scaled) if multiplier]


class _Chooser(Evidence):
    """Evidence whose answers are made while they are asked for."""

    def __init__(self, content: dict[str, Any], width: int) -> None:
        super().__init__(content, width)
        self.chosen: list[int] = []

    def inside(self, rows: Rows, piece: int) -> int:
        """The first member that has all solutions of the rows, or -1."""
        width = len(rows[0].coefficients)
        solutions = _polyhedron(tuple(rows), width)
        which = -1
        if not solutions.is_empty:
            which = next(
                index
                for index, (other, member) in enumerate(self.backward)
                if other == piece and solutions.within(_polyhedron(_wide(member, width), width))
            )
        self.chosen.append(which)
        return which


def _wide(part: Part, width: int) -> Part:
    return tuple(
        Row((*row.coefficients, *(Fraction(0),) * (width - len(row.coefficients))), row.bound, row.strict)
        for row in part
    )


def certificate(claim: Claim, tree: Path, model: Path, seconds: float = 60) -> bytes:
    """A certificate of a claim of `model` on `tree`.

    Raises:
        RejectedError: None can be made: it is a kind of claim that has none, or the claim is not proven this way.
    """
    files = Files(tree, model)
    asked = Asked(files, claim.index)
    width = files.width
    system = System([_piece(one, width) for one in asked.pieces], _polyhedron(files.domain[0], width))
    start, bad = _formula(asked.start, width), _formula(asked.bad, width)
    content: dict[str, Json] = {key: [] for key in LISTS}
    content |= {"format": FORMAT, "claim": claim.index, "name": claim.options.get("name"), "bound": None}
    content |= {
        "tree": hashlib.sha256(files.tree_bytes).hexdigest(),
        "model": hashlib.sha256(files.model_bytes).hexdigest(),
    }
    invariant = Invariant(system, start, directions(system, [start, bad]))
    kept = [invariant.states(index) for index in range(len(system.pieces))]
    if asked.kind == "reaches":
        content |= _ranked(asked, invariant)
        content["invariant"] = [None if one is None else _rows(one.atoms) for one in kept]
    elif all(one is None or one.meet(part).is_empty for one in kept for part in bad.parts):
        content["invariant"] = [None if one is None else _rows(one.atoms) for one in kept]
    else:
        found = into(system, bad, start, Limit(seconds))
        if not found.complete or found.trace:
            raise RejectedError("the claim is not proven")
        content["backward"] = [[piece, _rows(states.atoms)] for piece, states in found.levels[0]]
    evidence = _Chooser(content, width)
    content["proofs"] = [_proof(rows) for rows in needed(asked, evidence)]
    content["inside"] = evidence.chosen
    if asked.kind == "reaches":
        content["bound"] = longest(evidence.ranking, evidence.absent)
        within = claim.options.get("within")
        if within is not None and content["bound"] > within:
            raise RejectedError(f"the ranking shows {content['bound']} steps only, not {within}")
    return encoded(content)


def _ranked(asked: Asked, invariant: Invariant) -> dict[str, Json]:
    outside = [index for index, piece in enumerate(asked.pieces) if piece.status != "SUCCESS"]
    ranking = rank(invariant, outside)
    if not isinstance(ranking, Ranking):
        raise RejectedError(ranking)
    order = ranking.leaving
    absent = [
        [first, second]
        for first in range(len(order))
        for second in range(first + 1, len(order))
        if invariant.crossing(order[first].piece, order[second].piece) is None
    ]
    return {"ranking": [_leaving(one, invariant) for one in order], "absent": absent}


def _leaving(one: Leaving, invariant: Invariant) -> Json:
    if one.direction is None:
        return [one.piece, None, "0", "0", "0", ""]
    states = invariant.states(one.piece)
    assert states is not None
    top = states.supremum(one.direction)
    assert top is not None
    end = "" if not one.open else "high" if top.strict else "low"
    return [one.piece, [str(value) for value in one.direction], str(one.speed), str(one.low), str(one.high), end]
