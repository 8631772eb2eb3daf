# SPDX-License-Identifier: MIT
"""The reference model of a tick: docs/semantics.md in its executable form, one class a node, plainly recursive.

Slow and simple on purpose. A node's `tick_children` is its row of the table; what all nodes have in common (storing the
status, halting exactly once, resetting) is said once, in Node.
"""

from __future__ import annotations

import itertools

from differential.model.control import (
    AsyncFallback,
    AsyncSequence,
    Fallback,
    IfThenElse,
    InOrder,
    Parallel,
    ParallelAll,
    Reactive,
    ReactiveFallback,
    ReactiveParallel,
    ReactiveSequence,
    Remembering,
    Sequence,
    SequenceWithMemory,
    TryCatch,
    WhileDoElse,
)
from differential.model.decorators import (
    Counting,
    Decorator,
    Delay,
    ForceFailure,
    ForceSuccess,
    Inverter,
    KeepRunningUntilFailure,
    Repeat,
    RetryUntilSuccessful,
    RunOnce,
    Timeout,
)
from differential.model.leaves import (
    AlwaysFailure,
    AlwaysSuccess,
    Condition,
    Sleep,
    StatefulAction,
    SyncAction,
    UserLeaf,
)
from differential.model.node import COMPLETED, Node, World
from differential.model.scripts import (
    Attributes,
    EntryUpdated,
    Loop,
    Precondition,
    Script,
    ScriptCondition,
    SetBlackboard,
    SkipUnlessUpdated,
    Switch,
    WaitValueUpdate,
    WasEntryUpdated,
)
from differential.tree import Outcome, Result, Spec, Tree

__all__ = [
    "COMPLETED",
    "NODES",
    "AlwaysFailure",
    "AlwaysSuccess",
    "AsyncFallback",
    "AsyncSequence",
    "Attributes",
    "Condition",
    "Counting",
    "Decorator",
    "Delay",
    "EntryUpdated",
    "Fallback",
    "ForceFailure",
    "ForceSuccess",
    "IfThenElse",
    "InOrder",
    "Inverter",
    "KeepRunningUntilFailure",
    "Loop",
    "ModelTree",
    "Node",
    "Parallel",
    "ParallelAll",
    "Precondition",
    "Reactive",
    "ReactiveFallback",
    "ReactiveParallel",
    "ReactiveSequence",
    "Remembering",
    "Repeat",
    "RetryUntilSuccessful",
    "RunOnce",
    "Script",
    "ScriptCondition",
    "Sequence",
    "SequenceWithMemory",
    "SetBlackboard",
    "SkipUnlessUpdated",
    "Sleep",
    "StatefulAction",
    "Switch",
    "SyncAction",
    "Timeout",
    "TryCatch",
    "UserLeaf",
    "WaitValueUpdate",
    "WasEntryUpdated",
    "WhileDoElse",
    "World",
    "run_model",
]

NODES: dict[str, type[Node]] = {
    node.__name__: node
    for node in (
        Condition, SyncAction, StatefulAction, AlwaysSuccess, AlwaysFailure, Sleep,
        Sequence, SequenceWithMemory, AsyncSequence, ReactiveSequence, Fallback, AsyncFallback, ReactiveFallback,
        Parallel, ParallelAll, ReactiveParallel, IfThenElse, WhileDoElse, TryCatch,
        Inverter, ForceSuccess, ForceFailure, Repeat, RetryUntilSuccessful, KeepRunningUntilFailure,
        Delay, Timeout, RunOnce,
        Script, ScriptCondition, SetBlackboard, Precondition, Attributes, SkipUnlessUpdated, WaitValueUpdate,
        WasEntryUpdated, Loop, Switch,
    )
}  # fmt: skip


class ModelTree:
    """A tree of the model. `nodes`: which class stands for which kind of node."""

    def __init__(self, tree: Tree, world: World | None = None, nodes: dict[str, type[Node]] = NODES) -> None:
        self.tree = tree
        self.world = world or World()
        self.nodes: list[Node] = []
        self._classes = nodes
        self._numbers = itertools.count()
        self.root = self._build(tree.root)
        self.nodes.sort(key=lambda node: node.number)

    def _build(self, spec: Spec) -> Node:
        number = next(self._numbers)
        children = [self._build(child) for child in spec.children]
        node = self._classes[spec.kind](self.world, number, spec, children)
        self.nodes.append(node)
        return node

    def _outcome(self, status: int | None) -> Outcome:
        calls, self.world.calls = self.world.calls, []
        return Outcome(status, calls, bytes([node.code for node in self.nodes]), tuple(self.world.entries))

    def tick(self, number: int) -> Outcome:
        """Tick `number`, from 0. A tree that completed starts again with the next tick."""
        self.world.tick_number = number
        self.world.now = self.tree.times[number]
        return self._outcome(self.root.tick())

    def halt(self) -> Outcome:
        """Halts the whole tree: every RUNNING node once, deepest first; every node is IDLE afterwards."""
        self.root.reset()
        for node in self.nodes:
            node.reset()
        return self._outcome(None)


def run_model(tree: Tree, nodes: dict[str, type[Node]] = NODES) -> Result:
    """Runs the model over all ticks of a tree."""
    model = ModelTree(tree, nodes=nodes)
    outcomes = []
    for number in range(len(tree.times)):
        outcomes.append(model.tick(number))
        if tree.halt_after == number + 1:
            outcomes.append(model.halt())
    return Result(outcomes, model.world.faults, model.world.fault_node)
