# SPDX-License-Identifier: MIT
"""Decides a formula about a tree, and replays what refutes it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from canopy.semantics.spec import IDLE, STATUS_NAMES, Spec
from canopy.verify.logic.board import Board, Fact
from canopy.verify.logic.encode import Encoding
from canopy.verify.logic.engine import EngineError, decide
from canopy.verify.logic.formula import Formula
from canopy.verify.logic.monitor import holds, literal
from canopy.verify.logic.replay import Inputs, Replay, Shot, from_circuit
from canopy.verify.logic.runner import Runner
from canopy.verify.logic.subject import LogicTree


class DisagreementError(EngineError):
    """Circuit and reference model disagree about a trace: a fault of Canopy."""


@dataclass(frozen=True)
class Verdict:
    """proven, refuted or unknown. `reason`: why it is unknown. `trace`, `inputs`: what happens, tick by tick.

    `assumed`: nodes that may answer in the circuit what they cannot in the tree.
    """

    verdict: str
    reason: str
    seconds: float
    inputs: tuple[Inputs, ...] = ()
    trace: tuple[Shot, ...] = ()
    assumed: frozenset[int] = frozenset()


def decided(
    root: Spec,
    returns: Mapping[int, tuple[int, ...]],
    formula: Formula,
    period_us: int | None,
    seconds: float,
    board: Board | None = None,
    facts: Sequence[Fact] = (),
) -> Verdict:
    """Does a formula hold in each tick of each run, if what is not known may be anything at any time?

    `returns`: what each leaf may answer, by number of the node. `period_us`: from tick to tick [us]; None: timers may
    end at any time. `board`: entries and scripts; None: they may be anything.

    Raises:
        EngineError: berkeley-abc is missing, or its answer cannot be read.
        DisagreementError: A refutation does not happen in the reference model.
    """
    begin = time.perf_counter()
    encoding = Encoding(root, returns, period_us, board, facts)
    answer = decide(encoding.circuit, literal(encoding, formula) ^ 1, seconds)
    if answer.verdict != "refuted":
        return Verdict(answer.verdict, answer.reason, time.perf_counter() - begin)
    inputs, expected = from_circuit(encoding, list(answer.ticks))
    runner = Runner(board, encoding.scripts.unknown) if board is not None else None
    replay = Replay(root, period_us, runner, facts)
    trace = [replay.tick(one) for one in inputs]
    if trace != expected or holds(formula, trace)[-1]:
        raise DisagreementError(
            "the trace that refutes the formula does not happen in the reference model",
            "this is a fault of canopy verify: please report it, with the tree and the formula",
        )
    assumed = frozenset(encoding.scripts.assumed)
    return Verdict("refuted", "", time.perf_counter() - begin, tuple(inputs), tuple(trace), assumed)


def ask(tree: LogicTree, formula: Formula, period_ms: int | None, seconds: float) -> Verdict:
    """Does a formula hold in each tick of each run of the tree? `period_ms`: from tick to tick [ms]; None: not known.

    Unknown: also when what refutes it needs an answer that only the circuit takes for free.

    Raises:
        EngineError, DisagreementError: as decided().
    """
    period_us = None if period_ms is None else 1000 * period_ms
    verdict = decided(tree.spec(), tree.returns, formula, period_us, seconds, tree.board, tree.facts)
    ticked = {number for shot in verdict.trace for number, moment in enumerate(shot.moments) if moment.returned != IDLE}
    why = tree.assumed(ticked & verdict.assumed, ticked, period_ms)
    return replace(verdict, verdict="unknown", reason=why) if why else verdict


def called(tree: LogicTree, inputs: Inputs, shot: Shot) -> list[tuple[str, str]]:
    """What the leaves that were ticked answered: path, and status."""
    return [
        (tree.nodes[number].path.lstrip("/"), STATUS_NAMES[status])
        for number, status in inputs.answers.items()
        if shot.moments[number].returned != IDLE
    ]
