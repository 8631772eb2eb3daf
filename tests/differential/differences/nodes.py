# SPDX-License-Identifier: MIT
"""Which class stands for which kind of node."""

from __future__ import annotations

from canopy.semantics import Node
from differential.differences.control import (
    AsyncFallback,
    AsyncSequence,
    Fallback,
    IfThenElse,
    Parallel,
    ParallelAll,
    ReactiveFallback,
    ReactiveSequence,
    Sequence,
    SequenceWithMemory,
    WhileDoElse,
)
from differential.differences.decorators import (
    ForceFailure,
    ForceSuccess,
    Inverter,
    KeepRunningUntilFailure,
    Repeat,
    RetryUntilSuccessful,
    RunOnce,
)
from differential.differences.leaves import AlwaysFailure, AlwaysSuccess, Condition, StatefulAction, SyncAction
from differential.differences.scripts import (
    Attributes,
    Loop,
    Precondition,
    Script,
    ScriptCondition,
    SetBlackboard,
    Switch,
)

NODES: dict[str, type[Node]] = {
    node.__name__: node
    for node in (
        Condition, SyncAction, StatefulAction, AlwaysSuccess, AlwaysFailure,
        Sequence, SequenceWithMemory, AsyncSequence, ReactiveSequence, Fallback, AsyncFallback, ReactiveFallback,
        Parallel, ParallelAll, IfThenElse, WhileDoElse,
        Inverter, ForceSuccess, ForceFailure, Repeat, RetryUntilSuccessful, KeepRunningUntilFailure, RunOnce,
        Script, ScriptCondition, SetBlackboard, Precondition, Attributes, Loop, Switch,
    )
}  # fmt: skip
"""The kinds of nodes that can be compared. It has no ReactiveParallel, and cannot be given a clock (Delay, Timeout,
Sleep); TryCatch is newer (4.9) than what behaviortreepy holds (4.8.2). SkipUnlessUpdated, WaitValueUpdate and
WasEntryUpdated forget there what they have seen when they are halted, and the first two do not halt their child."""
