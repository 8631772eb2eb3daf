# SPDX-License-Identifier: MIT
"""The leaves: those whose functions the user writes, and those that are built in."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics.node import Node, reached
from canopy.semantics.spec import CONTINUE, FAILURE, HALTED, RUNNING, SKIPPED, START, SUCCESS


class UserLeaf(Node):
    """A leaf whose functions the user writes; here they answer what the tree under test says."""

    valid: ClassVar[tuple[int, ...]] = (SUCCESS, FAILURE, SKIPPED)

    def call(self, kind: int) -> int:
        self.world.calls.append((self.number, kind))
        answer = self.world.answer(self, kind)
        if answer in self.valid:
            return answer
        self.world.faults += 1  # rule 7
        self.world.fault_node = self.number
        return FAILURE

    def tick_children(self) -> int:
        return self.call(START)


class Condition(UserLeaf):
    pass


class SyncAction(UserLeaf):
    pass


class StatefulAction(UserLeaf):
    valid = (RUNNING, SUCCESS, FAILURE, SKIPPED)

    def tick_children(self) -> int:
        return self.call(CONTINUE if self.code == RUNNING else START)

    def on_halt(self) -> None:
        self.world.calls.append((self.number, HALTED))


class AlwaysSuccess(Node):
    def tick_children(self) -> int:
        return SUCCESS


class AlwaysFailure(Node):
    def tick_children(self) -> int:
        return FAILURE


class Sleep(Node):
    def tick_children(self) -> int:
        if self.code != RUNNING:
            self.deadline = self.world.now + 1000 * self.spec.parameters[0]
        return SUCCESS if reached(self.world.now, self.deadline) else RUNNING
