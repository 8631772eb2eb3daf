# SPDX-License-Identifier: MIT
"""Checks a certificate: its sums of inequalities read 0 < 0 or 0 <= -1, and they are the sums that are needed."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.certificate.formula import Part, RejectedError, Row
from canopy.certificate.obligations import Claim, Leaving, Rows, longest
from canopy.certificate.system import Files

FORMAT = 1
MAX_BYTES = 64 * 1024 * 1024
MEMBERS = (
    "absent",
    "backward",
    "bound",
    "claim",
    "format",
    "inside",
    "invariant",
    "model",
    "name",
    "proofs",
    "ranking",
    "tree",
)
_NUMBER = re.compile(r"-?\d{1,400}(/[1-9]\d{0,400})?")


def number(text: Any) -> Fraction:
    """A number as certificates write it."""
    if not isinstance(text, str) or _NUMBER.fullmatch(text) is None:
        raise RejectedError(f"{text!r} is not a number")
    return Fraction(text)


def encoded(content: dict[str, Any]) -> bytes:
    """The one text of a certificate, its digest included."""
    body = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    digest = hashlib.sha256(body.encode()).hexdigest()
    return f"{digest}\n{body}\n".encode()


def decoded(text: bytes) -> dict[str, Any]:
    """The content of a certificate file, of which not a bit has changed."""
    if len(text) > MAX_BYTES:
        raise RejectedError("the certificate is too large")
    try:
        content = json.loads(text.decode("ascii").split("\n", 1)[1])
    except (ValueError, IndexError, RecursionError) as error:
        raise RejectedError(f"the certificate cannot be read: {error}") from None
    if not isinstance(content, dict) or tuple(sorted(content)) != MEMBERS or encoded(content) != text:
        raise RejectedError("the certificate is damaged")
    return content


def adds_up(rows: Sequence[Row], proof: Any) -> bool:
    """Does the sum of the rows with these multipliers say 0 < 0, or 0 <= a number below 0?"""
    total: dict[int, Fraction] = {}
    bound, strict = Fraction(0), False
    for item in proof:
        place, multiplier = item
        if type(place) is not int or not 0 <= place < len(rows):
            return False
        factor = number(multiplier)
        if factor <= 0:
            return False
        row = rows[place]
        for index, value in enumerate(row.coefficients):
            if value:
                total[index] = total.get(index, Fraction(0)) + factor * value
        bound += factor * row.bound
        strict = strict or row.strict
    return not any(total.values()) and (bound < 0 or (bound == 0 and strict))


def _part(raw: Any, width: int) -> Part:
    rows = []
    for coefficients, bound, strict in raw:
        if len(coefficients) != width or not isinstance(strict, bool):
            raise RejectedError("an inequality is not one")
        rows.append(Row(tuple(map(number, coefficients)), number(bound), strict))
    return tuple(rows)


def _leaving(raw: Any) -> Leaving:
    piece, direction, speed, low, high, end = raw
    made = None if direction is None else tuple(map(number, direction))
    return Leaving(piece, made, number(speed), number(low), number(high), end)


class Evidence:
    """What a certificate says, in the form that obligations are made of."""

    def __init__(self, content: dict[str, Any], width: int) -> None:
        self.invariant = [None if one is None else _part(one, width) for one in content["invariant"]]
        self.ranking = [_leaving(one) for one in content["ranking"]]
        self.absent = [(first, second) for first, second in content["absent"]]
        self.backward = [(piece, _part(rows, width)) for piece, rows in content["backward"]]
        self._inside = list(content["inside"])
        whole = [*(one.piece for one in self.ranking), *(n for pair in self.absent for n in pair)]
        whole += [*(piece for piece, _ in self.backward), *self._inside]
        if not all(type(value) is int for value in whole):
            raise RejectedError("a place is not a whole number")
        self._next = 0

    def inside(self, _rows: Rows, _piece: int) -> int:
        """The next answer of the certificate."""
        self._next += 1
        if self._next > len(self._inside):
            raise RejectedError("the certificate is too short")
        return int(self._inside[self._next - 1])

    def used_up(self) -> bool:
        """Has every answer been asked for?"""
        return self._next == len(self._inside)


def needed(claim: Claim, evidence: Evidence) -> Iterator[Rows]:
    """All conjunctions that must be empty, in the order of the proofs."""
    yield from claim.model()
    if evidence.backward or not evidence.invariant:
        if claim.kind != "avoids":
            raise RejectedError("this evidence is for another kind of claim")
        yield from claim.backward(evidence.backward, evidence.inside)
        return
    yield from claim.invariant(evidence.invariant)
    if claim.kind == "avoids":
        yield from claim.excluded(evidence.invariant)
    else:
        yield from claim.ranked(evidence.invariant, evidence.ranking, evidence.absent)


def check(certificate: bytes, tree: Path, model: Path) -> str:
    """Says what a certificate shows of a tree and a model.

    Raises:
        RejectedError: It shows nothing.
    """
    content = decoded(certificate)
    if content["format"] != FORMAT:
        raise RejectedError(f"format {content['format']!r} is not known")
    try:
        files = Files(tree, model)
        for what, text in (("tree", files.tree_bytes), ("model", files.model_bytes)):
            if content[what] != hashlib.sha256(text).hexdigest():
                raise RejectedError(f"the {what} is not the one of the certificate")
        claim = Claim(files, content["claim"])
        if content["name"] != claim.options.get("name"):
            raise RejectedError("the claim has another name")
        evidence = Evidence(content, files.width)
        proofs = iter(content["proofs"])
        for count, rows in enumerate(needed(claim, evidence), 1):
            if not adds_up(rows, next(proofs)):
                raise RejectedError(f"step {count} does not add up")
        if next(proofs, None) is not None or not evidence.used_up():
            raise RejectedError("the certificate has more than is needed")
        return _shown(claim, evidence, content["bound"])
    except RejectedError:
        raise
    except (ArithmeticError, AttributeError, LookupError, OSError, StopIteration, TypeError, ValueError) as error:
        raise RejectedError(f"not a certificate that can be read: {error!r}") from None


def _shown(claim: Claim, evidence: Evidence, bound: Any) -> str:
    if claim.kind == "avoids":
        if bound is not None:
            raise RejectedError("a bound is given where there is none")
        return "never"
    steps = longest(evidence.ranking, evidence.absent)
    within = claim.options.get("within")
    if type(bound) is not int or bound != steps or (within is not None and steps > within):
        raise RejectedError(f"the ranking shows {steps} steps, not {bound!r}")
    return f"within {steps} steps"
