# SPDX-License-Identifier: MIT
"""The decorators of BehaviorTree.CPP, where they differ."""

from __future__ import annotations

from canopy import semantics as model
from canopy.semantics import COMPLETED
from canopy.semantics.spec import IDLE, RUNNING, SKIPPED
from differential.differences.node import BtCppNode, was_skipped


class Decorator(BtCppNode, model.Decorator):
    def child_runs(self) -> bool:
        return super().child_runs() and not was_skipped(self.children[0])

    def tick_child(self) -> int:
        status = self.children[0].tick()
        if status in COMPLETED:
            self.reset_all()
        elif status == SKIPPED:
            self.keeps_count(self.children)
        return status


class Inverter(Decorator, model.Inverter):
    pass


class ForceSuccess(Decorator, model.ForceSuccess):
    pass


class ForceFailure(Decorator, model.ForceFailure):
    pass


class Counting(Decorator, model.Counting):
    def begin(self) -> None:
        super().begin()
        self.has_kept_count = False

    def has_count(self) -> bool:
        return self.cycles > 0 and self.spec.parameters[0] > 0

    def keep_count(self) -> None:
        self.has_kept_count = self.has_count()

    def tick_children(self) -> int:
        if self.has_kept_count:
            self.world.differs("skipped count")
            self.has_kept_count = False
        while True:
            asynchronous = self.children[0].code != IDLE
            cycles = self.cycles
            status = super().tick_children()
            if status == SKIPPED:
                self.reset_all()
            if not (asynchronous and self.cycles > cycles and status == RUNNING):
                return status
            self.world.differs("same tick")


class Repeat(Counting, model.Repeat):
    pass


class RetryUntilSuccessful(Counting, model.RetryUntilSuccessful):
    pass


class KeepRunningUntilFailure(Decorator, model.KeepRunningUntilFailure):
    def tick_children(self) -> int:
        status = super().tick_children()
        if status != SKIPPED:
            return status
        self.world.differs("keep running")
        return RUNNING


class RunOnce(Decorator, model.RunOnce):
    def tick(self) -> int:
        before = self.code
        remembered = self.remembered is not None
        status = super().tick()
        if remembered and status == SKIPPED:
            self.code = before
        return status
