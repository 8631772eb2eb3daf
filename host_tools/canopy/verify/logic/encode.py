# SPDX-License-Identifier: MIT
"""A tree as a circuit: each tick of the tree is one step of it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from canopy.semantics.spec import Spec
from canopy.verify.logic import cells, control, decorators
from canopy.verify.logic.board import Board, Fact
from canopy.verify.logic.cells import Cell, Plan
from canopy.verify.logic.circuit import TRUE, Circuit
from canopy.verify.logic.scripts import Scripts

CELLS: dict[str, type[Cell]] = {
    "Condition": cells.UserLeaf,
    "SyncAction": cells.UserLeaf,
    "StatefulAction": cells.UserLeaf,
    "AlwaysSuccess": cells.Constant,
    "AlwaysFailure": cells.AlwaysFailure,
    "Sleep": cells.Sleep,
    "Script": cells.Script,
    "SetBlackboard": cells.Script,
    "ScriptCondition": cells.ScriptCondition,
    "WasEntryUpdated": cells.WasEntryUpdated,
    "TestNode": cells.TestNode,
    "Sequence": control.InOrder,
    "SequenceWithMemory": control.SequenceWithMemory,
    "AsyncSequence": control.AsyncSequence,
    "ReactiveSequence": control.ReactiveSequence,
    "Fallback": control.Fallback,
    "AsyncFallback": control.AsyncFallback,
    "ReactiveFallback": control.ReactiveFallback,
    "Parallel": control.Parallel,
    "ParallelAll": control.ParallelAll,
    "ReactiveParallel": control.ReactiveParallel,
    "IfThenElse": control.IfThenElse,
    "WhileDoElse": control.WhileDoElse,
    "TryCatch": control.TryCatch,
    "Switch": decorators.Switch,
    "Inverter": decorators.Inverter,
    "ForceSuccess": decorators.ForceSuccess,
    "ForceFailure": decorators.ForceFailure,
    "Repeat": decorators.Repeat,
    "RetryUntilSuccessful": decorators.RetryUntilSuccessful,
    "KeepRunningUntilFailure": decorators.KeepRunningUntilFailure,
    "Delay": decorators.Delay,
    "Timeout": decorators.Timeout,
    "RunOnce": decorators.RunOnce,
    "Precondition": decorators.Precondition,
    "Attributes": decorators.Attributes,
    "SkipUnlessUpdated": decorators.SkipUnlessUpdated,
    "WaitValueUpdate": decorators.WaitValueUpdate,
    "Loop": decorators.Loop,
}
"""The nodes that have a circuit."""
UPDATES = ("WasEntryUpdated", "SkipUnlessUpdated", "WaitValueUpdate")


class Encoding:
    """The circuit of a tree. `cells`: in the order of the file, as canopy.semantics numbers the nodes.

    `returns`: what each leaf may answer, by its number. `board`: entries and scripts; None: scripts may say anything.
    `facts`: what a formula says besides, and `told` the literal of each.
    """

    def __init__(
        self,
        root: Spec,
        returns: Mapping[int, tuple[int, ...]],
        period_us: int | None,
        board: Board | None = None,
        facts: Sequence[Fact] = (),
    ) -> None:
        self.circuit = Circuit()
        self.scripts = Scripts(self.circuit, board)
        reads = board.reads if board is not None else {}
        self.plan = Plan(self.circuit, self.scripts, dict(returns), reads, period_us)
        numbers = itertools.count()
        made: list[Cell] = []

        def make(spec: Spec) -> Cell:
            number = next(numbers)
            cell = CELLS[spec.kind](self.plan, number, spec, [make(child) for child in spec.children])
            made.append(cell)
            return cell

        top = make(root)
        self.cells = sorted(made, key=lambda cell: cell.number)
        self.scripts.watch(number for number, cell in enumerate(self.cells) if cell.spec.kind in UPDATES)
        top.tick(TRUE)
        self.told = [self.scripts.fact(fact) for fact in facts]
        for cell in self.cells:  # parents first
            cell.settle()
        if self.scripts.memory is not None:
            self.scripts.memory.settle()
