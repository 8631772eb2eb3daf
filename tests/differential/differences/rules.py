# SPDX-License-Identifier: MIT
"""The rules: how BehaviorTree.CPP differs in what happens, and which of them fired in a tick."""

from __future__ import annotations

from canopy.semantics import World
from differential.tree import ENTRIES

RULES: dict[str, str] = {
    "skipped condition": "IfThenElse and WhileDoElse throw when their condition is SKIPPED",
    "no else": "a two-child IfThenElse does not reset its condition after a FAILURE, nor ask a stateful one again",
    "while": "WhileDoElse does not ask a stateful condition again that has completed, until its branch is done",
    "keep running": "KeepRunningUntilFailure turns a SKIPPED child into RUNNING",
    "same tick": "Repeat and RetryUntilSuccessful begin the next cycle in the tick that ends an asynchronous one",
    "memory yields": "SequenceWithMemory yields after every child that completes in the tick it was started in",
    "skipped count": "a SKIPPED Repeat or RetryUntilSuccessful is RUNNING there, and loses its count at other times",
    "skipped action": "a RUNNING action that answers SKIPPED stays RUNNING there",
    "attributes": "preconditions are asked of what is IDLE there: not of a SKIPPED inner node, nor of an old condition",
    "precondition": "Precondition does not ask again after a SKIPPED child or a halt, until its child has completed",
    "loop goes on": "a Loop that was SKIPPED, or completed and was not reset, does not begin its list or child again",
    "on halted": "halting the whole tree runs every _onHalted, also of nodes that are not RUNNING",
    "stale skips": "a Sequence or Fallback that completed and was not reset counts the children it skipped before",
}
"""The differences that change what happens. What only looks different is in shown.py."""


class ThrownError(Exception):
    """BehaviorTree.CPP throws an exception in this tick."""


class BtCppWorld(World):
    """Notes which rules fired in the tick under way."""

    def __init__(self) -> None:
        super().__init__(len(ENTRIES))
        self.fired: set[str] = set()

    def differs(self, rule: str) -> None:
        assert rule in RULES
        self.fired.add(rule)
