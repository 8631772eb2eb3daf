# SPDX-License-Identifier: MIT
"""Compares runs of the engine, of the model, and of BehaviorTree.CPP, tick by tick."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from canopy.semantics.spec import CALL_NAMES, STATUS_NAMES
from differential.differences import Explained, run_differing_model
from differential.engine import run_engine
from differential.model import run_model
from differential.shown import Shown
from differential.shrink import shrink
from differential.tally import Tally
from differential.tree import ENTRIES, Outcome, Result, Tree, code_name

BATCH = 500


@dataclass
class Report:
    """What was compared. `tally`: how strictly, with BehaviorTree.CPP."""

    trees: int = 0
    ticks: int = 0
    tally: Tally = field(default_factory=Tally)
    failures: list[tuple[Tree, str]] = field(default_factory=list)


def outcome_text(outcome: Outcome) -> str:
    """One tick in words."""
    if outcome.status is None:
        head = "halt of the tree"
    else:
        head = STATUS_NAMES[outcome.status] if outcome.status < len(STATUS_NAMES) else f"status {outcome.status}"
    calls = ", ".join(f"{node} {CALL_NAMES[kind]}" for node, kind in outcome.calls)
    entries = ", ".join(f"{name} {value}" for name, value in zip(ENTRIES, outcome.entries, strict=True))
    return f"{head}; calls: {calls or 'none'}; nodes: {', '.join(map(code_name, outcome.codes))}; entries: {entries}"


def first_difference(named: dict[str, list[Outcome]]) -> str | None:
    """Where two runs part, in words; None when they are the same."""
    (one, ones), (other, others) = named.items()
    for number, (mine, theirs) in enumerate(zip(ones, others, strict=False)):
        if mine != theirs:
            before = f"\n  before: {outcome_text(ones[number - 1])}" if number else ""
            return f"outcome {number}:\n  {one}: {outcome_text(mine)}\n  {other}: {outcome_text(theirs)}{before}"
    if len(ones) != len(others):
        return f"{one} gave {len(ones)} outcomes, {other} {len(others)}"
    return None


# --- The engine and the model -----------------------------------------------------------------------------------------

Model = Callable[[Tree], Result]


def engine_against_model(runner: Path, tree: Tree, model: Model = run_model) -> str | None:
    """How the engine differs from the model on one tree."""
    return _engine_difference(run_engine(runner, [tree])[0], model(tree))


def _engine_difference(engine: Result, model: Result) -> str | None:
    if engine == model:
        return None
    faults = f"faults: engine {engine.faults} (last: node {engine.fault_node}), "
    faults += f"model {model.faults} (last: node {model.fault_node})"
    return first_difference({"engine": engine.outcomes, "model": model.outcomes}) or faults


def compare_with_model(runner: Path, trees: list[Tree], model: Model = run_model) -> Report:
    """Runs trees in the engine and in the model."""
    report = Report()
    for begin in range(0, len(trees), BATCH):
        batch = trees[begin : begin + BATCH]
        for tree, engine in zip(batch, run_engine(runner, batch), strict=True):
            expected = model(tree)
            report.trees += 1
            report.ticks += len(expected.outcomes)
            difference = _engine_difference(engine, expected)
            if difference:
                report.failures.append((tree, difference))
    return report


# --- BehaviorTree.CPP -------------------------------------------------------------------------------------------------

Differing = Callable[[Tree], Explained]


class BtCppRun(NamedTuple):
    """The outcomes of one tree, and the message of the exception that ended it, or ""."""

    outcomes: list[Outcome]
    thrown: str


def run_btcpp(trees: list[Tree]) -> list[BtCppRun]:
    """Runs trees in BehaviorTree.CPP."""
    folder = str(Path(__file__).parents[1])
    process = subprocess.run(
        [sys.executable, "-m", "differential.btcpp_runner"],
        input=pickle.dumps(trees),
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([folder, os.environ.get("PYTHONPATH", "")])},
        check=True,
        timeout=600,
    )
    return [BtCppRun(*result) for result in pickle.loads(process.stdout)]


def _ways_shown(shown: Shown, our: Outcome, their: Outcome) -> set[str] | None:
    """In which ways statuses are shown otherwise after a tick that is the same; None when it is not."""
    if (our.status, our.calls, our.entries) != (their.status, their.calls, their.entries):
        return None
    return shown.otherwise(our, their)


def _engine_differs(tree: Tree, explained: Explained, ours: list[Outcome], run: BtCppRun, tally: Tally) -> str | None:
    """The first tick before any rule fired in which engine and BehaviorTree.CPP differ, in words. Counts the ticks."""
    shown = Shown(tree)
    theirs = run.outcomes
    ticks = len(ours)  # those that BehaviorTree.CPP did not run any more included
    strict = next((number for number, fired in enumerate(explained.fired) if fired), ticks)
    for number, (our, their) in enumerate(zip(ours[:strict], theirs, strict=False)):
        ways = _ways_shown(shown, our, their)
        if ways is None:
            return (
                f"outcome {number}, no rule fired:\n  engine: {outcome_text(our)}\n"
                f"  BehaviorTree.CPP: {outcome_text(their)}"
            )
        tally.identical += not ways
        tally.shown.update(ways)
    tally.trees += 1
    tally.ticks += ticks
    tally.strict_ticks += strict
    tally.thrown += bool(run.thrown)
    if strict == ticks:
        tally.strict_trees += 1
        return None
    rest = zip(ours[strict:], theirs[strict:], strict=False)
    same = sum(_ways_shown(shown, our, their) is not None for our, their in rest)
    tally.excuse(explained.fired[strict], ticks - strict, same)
    return None


def compare_with_btcpp(runner: Path, trees: list[Tree], differing: Differing = run_differing_model) -> Report:
    """Runs trees in BehaviorTree.CPP, the differing model, and the engine."""
    report = Report()
    batches = [trees[begin : begin + BATCH] for begin in range(0, len(trees), BATCH)]
    with ThreadPoolExecutor(2) as ahead:  # BehaviorTree.CPP runs the next trees while these are looked at
        results = ahead.map(run_btcpp, batches)
        _add_batches(report, runner, batches, results, differing)
    return report


def _add_batches(
    report: Report,
    runner: Path,
    batches: list[list[Tree]],
    results: Iterator[list[BtCppRun]],
    differing: Differing,
) -> None:
    for batch, result in zip(batches, results, strict=True):
        for tree, engine, run in zip(batch, run_engine(runner, batch), result, strict=True):
            explained = differing(tree)
            report.trees += 1
            report.ticks += len(run.outcomes)
            difference = first_difference({"BehaviorTree.CPP": run.outcomes, "expected of it": explained.outcomes})
            if difference is None and bool(run.thrown) != explained.thrown:
                difference = f"BehaviorTree.CPP threw {run.thrown!r}; an exception was expected: {explained.thrown}"
            if difference is None:
                difference = _engine_differs(tree, explained, engine.outcomes, run, report.tally)
            if difference:
                report.failures.append((tree, difference))


# --- What a failure says ----------------------------------------------------------------------------------------------


def smallest_failure(report: Report, difference: Callable[[Tree], str | None]) -> tuple[Tree, str]:
    """The smallest tree that still fails, made from the smallest of the failures, and how it fails."""
    tree = min((tree for tree, _ in report.failures), key=lambda tree: sum(1 for _ in tree.root.walk()))
    tree = shrink(tree, lambda smaller: difference(smaller) is not None)
    return tree, difference(tree) or "(it failed once, and now it does not)"
