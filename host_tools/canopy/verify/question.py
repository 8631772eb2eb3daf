# SPDX-License-Identifier: MIT
"""A claim as it is asked: the system that it is about, where runs start, and which pieces are the goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.tree import Node, Tree
from canopy.verify.checks import leak, nodes_of
from canopy.verify.linear import Formula, everything
from canopy.verify.model import SUCCESS, Claim, Plant, Step
from canopy.verify.reader import ModelReader
from canopy.verify.regions import Arbitrary, Piece, Regions, pieces
from canopy.verify.sensing import MAX_AGE, ZERO, Sensing
from canopy.verify.system import System

VERDICTS = ("proven", "refuted", "unknown")
COMMON = ("name", "kind", "of", "arbitrary", "disturbance", "error", "age", "expect")
KEYS = {
    "reaches": (*COMMON, "from", "within", "goal"),
    "stays": (*COMMON, "goal"),
    "avoids": (*COMMON, "from", "avoid"),
    "margin": (*COMMON, "inside", "avoid", "at_least"),
    "dwell": (*COMMON, "from", "at_least"),
    "invariant": (*COMMON, "from", "holds", "avoid"),
    "border": ("name", "kind", "of", "arbitrary", "disturbance", "expect", "inside"),
}
NEEDED = {
    "reaches": (),
    "stays": (),
    "avoids": ("avoid",),
    "margin": ("inside", "avoid"),
    "dwell": ("at_least",),
    "invariant": ("holds",),
    "border": (),
}


@dataclass(frozen=True)
class Question:
    """A claim with what it is about. `goal`: the pieces of the goal; `seconds`: how long the answer may take.

    `sensing`: how leaves measure the state; None: they see it as it is. `measured`: the pieces of what they measure.
    """

    claim: Claim
    plant: Plant
    reader: ModelReader
    system: System
    start: Formula
    goal: frozenset[int]
    seconds: float
    sensing: Sensing | None = None
    measured: tuple[Piece, ...] = ()

    def formula(self, key: str) -> Formula:
        """A formula among the claim's options."""
        path = ("claims", str(self.claim.index), key)
        return self.reader.formula(self.claim.options[key], path, f"{key} of '{self.claim.name}'")

    def whole(self, key: str) -> int | None:
        """A whole number among the options, if it is given."""
        value = self.claim.options.get(key)
        if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 0):
            raise CompileError(self.claim.place, f"'{key}' must be a whole number, not {value!r}")
        return value

    @property
    def outside(self) -> list[int]:
        """The pieces that are not the goal."""
        return [index for index in range(len(self.system.pieces)) if index not in self.goal]


def node_named(place: Place, tree: Tree, name: object, what: str) -> Node:
    """A node by its path, or by its name where there is one of that name."""
    nodes = nodes_of(tree.root)
    found = [node for node in nodes if node.path == name] or [node for node in nodes if node.name == name]
    if not found:
        known = [node.name for node in nodes] + [node.path for node in nodes]
        close = nearest(str(name), known)
        help_text = close if close.startswith("did you mean") else "give a node's name, or its path: TREE/NAME"
        raise CompileError(place, f"{what}: the tree has no node '{name}'", help_text)
    if len(found) > 1:
        raise CompileError(
            place,
            f"{what}: the tree has {len(found)} nodes '{name}'",
            f"give the path of one: {', '.join(node.path for node in found)}",
        )
    return found[0]


def _check_keys(claim: Claim) -> None:
    what = f"claim '{claim.name}' ({claim.kind})"
    for key in claim.options:
        if key not in KEYS[claim.kind]:
            raise CompileError(claim.place, f"{what} has no key '{key}'", nearest(key, KEYS[claim.kind]))
    for key in NEEDED[claim.kind]:
        if key not in claim.options:
            raise CompileError(claim.place, f"{what} needs the key '{key}'")
    if claim.options.get("expect", "proven") not in VERDICTS:
        raise CompileError(
            claim.place, f"{what} expects {claim.options['expect']!r}", f"expected one of: {', '.join(VERDICTS)}"
        )


def _disturbed(step: Step, more: Sequence[tuple[Fraction, Fraction]]) -> Step:
    """With a further disturbance of what moves."""
    noise = tuple(
        (low + add[0], high + add[1]) if step.moves(index) else (low, high)
        for index, ((low, high), add) in enumerate(zip(step.noise, more, strict=True))
    )
    return replace(step, noise=noise)


def _arbitrary(claim: Claim, reader: ModelReader, tree: Tree) -> dict[str, Arbitrary]:
    path = ("claims", str(claim.index), "arbitrary")
    result = {}
    for name, raw in reader.table(claim.options.get("arbitrary", {}), path, "'arbitrary'").items():
        node = node_named(claim.place, tree, name, "arbitrary")
        result[node.path] = Arbitrary(reader.shorter(raw, path, reader.names))
    return result


def _sensing(claim: Claim, reader: ModelReader) -> Sensing | None:
    """How the leaves measure, if the claim says that."""
    width = len(reader.names)
    error, age = [ZERO] * width, [0] * width
    path = ("claims", str(claim.index), "error")
    for name, raw in reader.table(claim.options.get("error", {}), path, "'error'").items():
        low, high = error[reader.index(name, path)] = reader.interval(raw, path, f"error of {name}")
        if not low <= 0 <= high:
            raise reader.fail(path, f"error of {name}: 0 is not in it", "write for example [-0.02, 0.02]")
    path = ("claims", str(claim.index), "age")
    given = claim.options.get("age", {})
    for name, raw in (given if isinstance(given, dict) else dict.fromkeys(reader.names, given)).items():
        if isinstance(raw, bool) or not isinstance(raw, int) or not 0 <= raw <= MAX_AGE:
            raise reader.fail(path, f"age of {name} must be a number of steps, 0 to {MAX_AGE}, not {raw!r}")
        age[reader.index(name, path)] = raw
    return Sensing(tuple(error), tuple(age)) if any(age) or any(one != ZERO for one in error) else None


def _made(claim: Claim, plant: Plant, reader: ModelReader, tree: Tree) -> list[Piece]:
    """The pieces of the claim's subtree, with the claim's disturbance."""
    options = claim.options
    root = node_named(claim.place, tree, options["of"], "of") if "of" in options else tree.root
    made = pieces(Regions(plant, _arbitrary(claim, reader, tree)), root)
    if "disturbance" not in options:
        return made
    path = ("claims", str(claim.index), "disturbance")
    more = [(Fraction(0), Fraction(0))] * plant.width
    for name, raw in reader.table(options["disturbance"], path, "'disturbance'").items():
        more[reader.index(name, path)] = reader.interval(raw, path, f"disturbance of {name}")
    return [replace(piece, step=_disturbed(piece.step, more)) for piece in made]


def _check_kept(claim: Claim, plant: Plant, reader: ModelReader, made: Sequence[Piece]) -> None:
    """What a claim adds to the model must not lead out of the state space."""
    keys = [key for key in ("disturbance", "error", "age") if key in claim.options]
    for piece in made if keys else ():
        found = leak(piece, plant.domain)
        if found is not None:
            raise reader.fail(
                ("claims", str(claim.index), keys[-1]),
                f"with this {' and '.join(keys)} '{piece.label}' leaves the state space: "
                f"from {plant.shown(found[0])} to {plant.shown(found[1])}",
                "widen the range of the variable, or say in the leaf's modes what happens at its end",
            )


def ask(claim: Claim, plant: Plant, reader: ModelReader, tree: Tree, seconds: float) -> Question:
    """Reads a claim.

    Raises:
        CompileError: Something in it is not what it should be.
    """
    _check_keys(claim)
    path = ("claims", str(claim.index))
    options = claim.options
    measured = made = _made(claim, plant, reader, tree)
    sensing = _sensing(claim, reader)
    if sensing is not None:
        made = sensing.applied(made, plant.domain)
    _check_kept(claim, plant, reader, made)
    goal = {index for index, piece in enumerate(made) if piece.status == SUCCESS}
    if "goal" in options:
        made, goal = _split(made, reader.formula(options["goal"], (*path, "goal"), f"goal of '{claim.name}'"))
    start = everything(plant.width)
    if "from" in options:
        start = reader.formula(options["from"], (*path, "from"), f"from of '{claim.name}'")
    start = start & Formula(plant.width, (plant.declared,))
    if start.is_empty:
        raise CompileError(claim.place, f"claim '{claim.name}' starts from no state of the state space")
    system = System(made, plant.domain)
    return Question(claim, plant, reader, system, start, frozenset(goal), seconds, sensing, tuple(measured))


def _split(made: Sequence[Piece], wanted: Formula) -> tuple[list[Piece], set[int]]:
    """The pieces cut by a formula, and which are within it."""
    result: list[Piece] = []
    goal = set()
    for piece in made:
        for inside, formula in ((True, wanted.disjoint()), (False, ~wanted)):
            for part in formula.parts:
                both = piece.states.meet(part)
                if not both.is_empty:
                    goal.update([len(result)] if inside else [])
                    result.append(replace(piece, states=both))
    return result, goal
