# SPDX-License-Identifier: MIT
"""A tree with its model, read and checked, and all that is claimed of it decided."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from canopy.compiler.bus_reader import Bus, read_bus
from canopy.compiler.errors import CompileError, nearest
from canopy.compiler.port_types import Options
from canopy.compiler.tree import Tree
from canopy.compiler.tree_reader import read_tree
from canopy.verify.arithmetic import TITLES, rounded
from canopy.verify.checks import check_model
from canopy.verify.claims import Result, decide
from canopy.verify.handover import Handover, handovers
from canopy.verify.model import Claim, Plant
from canopy.verify.reader import ModelReader, read_model
from canopy.verify.regions import Regions, pieces
from canopy.verify.smt import script
from canopy.verify.solvers import decide as ask_solver
from canopy.verify.system import System


@dataclass(frozen=True)
class Subject:
    """What is verified."""

    tree: Tree
    plant: Plant
    reader: ModelReader
    bus: Bus | None = None


def model_path(tree: Path) -> Path:
    """Where the model of a tree is unless something else is said: NAME.plant.toml beside NAME.xml."""
    return tree.with_suffix(".plant.toml")


def load(tree: Path, model: Path, dbc: Path | None = None, node: str = "", options: Options | None = None) -> Subject:
    """Reads tree and model, and checks that they belong together.

    Raises:
        CompileError: They cannot be read, or do not.
    """
    read = read_tree(tree, options) if options is not None else read_tree(tree)
    plant, reader = read_model(model)
    bus = read_bus(dbc, node, 1) if dbc is not None else None
    check_model(plant, read, bus)
    return Subject(read, plant, reader, bus)


def in_arithmetic(subject: Subject, name: str) -> Subject:
    """The same with leaves that decide by rounded states (arithmetic.py).

    Raises:
        CompileError: The model cannot be read so; or in it a step leaves the state space, say.
    """
    plant = rounded(subject.plant, name, subject.bus)
    try:
        check_model(plant, subject.tree, None)
    except CompileError as error:
        raise CompileError(error.place, f"{TITLES[name]}: {error.message}", error.help_text) from error
    return replace(subject, plant=plant)


def chosen(subject: Subject, names: tuple[str, ...]) -> list[Claim]:
    """The claims of these names, or all.

    Raises:
        CompileError: There is no such claim.
    """
    known = {claim.name: claim for claim in subject.plant.claims}
    for name in names:
        if name not in known:
            raise CompileError(subject.reader.file.place("claims"), f"there is no claim '{name}'", nearest(name, known))
    return [known[name] for name in names] if names else list(subject.plant.claims)


def verify(subject: Subject, claim: Claim, seconds: float = 60) -> Result:
    """Decides a claim."""
    return decide(claim, subject.plant, subject.reader, subject.tree, seconds)


def recheck(result: Result, solver: str) -> str:
    """What a solver says of the steps of a proof: agrees, disagrees, or unknown; empty: there is nothing to ask."""
    if result.verdict != "proven" or not result.steps:
        return ""
    return {"unsat": "agrees", "sat": "disagrees"}.get(ask_solver(script(result.steps), solver), "unknown")


def hand_over(subject: Subject) -> list[Handover]:
    """Who hands over to whom in the whole tree (Lemmas 2 and 3), and where a run falls between two."""
    made = pieces(Regions(subject.plant), subject.tree.root)
    return handovers(System(made, subject.plant.domain))
