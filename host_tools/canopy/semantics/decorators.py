# SPDX-License-Identifier: MIT
"""The decorators: each class is a row of the table in docs/semantics.md."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics.node import COMPLETED, Node, reached
from canopy.semantics.spec import FAILURE, RUNNING, SKIPPED, SUCCESS


class Decorator(Node):
    """What decorators share: a child that is done, completed or SKIPPED, is reset."""

    def child_runs(self) -> bool:
        return self.children[0].code == RUNNING

    def tick_child(self) -> int:
        status = self.children[0].tick()
        if status != RUNNING:
            self.reset_all()
        return status


class Inverter(Decorator):
    def tick_children(self) -> int:
        status = self.tick_child()
        return {SUCCESS: FAILURE, FAILURE: SUCCESS}.get(status, status)


class ForceSuccess(Decorator):
    def tick_children(self) -> int:
        status = self.tick_child()
        return SUCCESS if status in COMPLETED else status


class ForceFailure(Decorator):
    def tick_children(self) -> int:
        status = self.tick_child()
        return FAILURE if status in COMPLETED else status


class Counting(Decorator):
    """Repeat and RetryUntilSuccessful: one cycle a tick, RUNNING in between (rule 3)."""

    counted: ClassVar[int] = SUCCESS

    def begin(self) -> None:
        self.cycles = 0

    def reset(self) -> None:
        """A node that is reset starts anew, also after SKIPPED."""
        super().reset()
        self.begin()

    def tick_children(self) -> int:
        wanted = self.spec.parameters[0]
        if wanted == 0:
            return self.counted
        status = self.tick_child()
        if status not in COMPLETED:
            return status
        if status == self.counted:
            self.cycles += 1
            if wanted < 0 or self.cycles < wanted:
                return RUNNING
        self.begin()
        return status


class Repeat(Counting):
    pass


class RetryUntilSuccessful(Counting):
    counted = FAILURE


class KeepRunningUntilFailure(Decorator):
    def tick_children(self) -> int:
        status = self.tick_child()
        return RUNNING if status == SUCCESS else status


class Delay(Decorator):
    def begin(self) -> None:
        self.deadline: int | None = None
        self.over = False

    def reset(self) -> None:
        """A node that is reset starts anew, also after SKIPPED."""
        super().reset()
        self.begin()

    def tick_children(self) -> int:
        if self.deadline is None:
            self.deadline = self.world.now + 1000 * self.spec.parameters[0]
        self.over = self.over or reached(self.world.now, self.deadline)
        if not self.over:
            return RUNNING
        status = self.tick_child()
        if status in COMPLETED:
            self.begin()
        return status


class Timeout(Decorator):
    def begin(self) -> None:
        self.deadline: int | None = None

    def tick_children(self) -> int:
        if self.deadline is None:
            self.deadline = self.world.now + 1000 * self.spec.parameters[0]
        elif reached(self.world.now, self.deadline):
            self.reset_all()
            self.begin()
            return FAILURE
        status = self.tick_child()
        if status != RUNNING:
            self.begin()
        return status


class RunOnce(Decorator):
    remembered: int | None = None

    def tick_children(self) -> int:
        if self.remembered is not None:
            return SKIPPED if self.spec.parameters[0] else self.remembered
        status = self.tick_child()
        if status in COMPLETED:
            self.remembered = status
        return status
