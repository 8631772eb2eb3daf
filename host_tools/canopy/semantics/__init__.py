# SPDX-License-Identifier: MIT
"""The reference model of a tick: docs/semantics.md in its executable form, one class a node, plainly recursive.

Slow and simple on purpose. A node's `tick_children` is its row of the table; what all nodes have in common (storing the
status, halting exactly once, resetting) is said once, in Node. The conformance table and random trees run through it
and the engine (docs/differential.md); `canopy convert` and `canopy fmt --simplify` check their results in it.
"""

from __future__ import annotations

import itertools

from canopy.semantics.control import (
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
from canopy.semantics.decorators import (
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
from canopy.semantics.leaves import (
    AlwaysFailure,
    AlwaysSuccess,
    Condition,
    Sleep,
    StatefulAction,
    SyncAction,
    UserLeaf,
)
from canopy.semantics.node import COMPLETED, Node, World
from canopy.semantics.scripts import (
    Attributes,
    EntryUpdated,
    Loop,
    Precondition,
    Script,
    ScriptCondition,
    SetBlackboard,
    SkipUnlessUpdated,
    Switch,
    TestNode,
    WaitValueUpdate,
    WasEntryUpdated,
)
from canopy.semantics.spec import Spec

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
    "TestNode",
    "Timeout",
    "TryCatch",
    "UserLeaf",
    "WaitValueUpdate",
    "WasEntryUpdated",
    "WhileDoElse",
    "World",
    "build",
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
        WasEntryUpdated, Loop, Switch, TestNode,
    )
}  # fmt: skip


def build(root: Spec, world: World, nodes: dict[str, type[Node]] = NODES) -> list[Node]:
    """The nodes of a tree, the root first, in the order of the file. `nodes`: the class of each kind of node."""
    numbers = itertools.count()
    made: list[Node] = []

    def make(spec: Spec) -> Node:
        number = next(numbers)
        node = nodes[spec.kind](world, number, spec, [make(child) for child in spec.children])
        made.append(node)
        return node

    make(root)
    return sorted(made, key=lambda node: node.number)
