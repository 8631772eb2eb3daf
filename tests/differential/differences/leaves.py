# SPDX-License-Identifier: MIT
"""The leaves of BehaviorTree.CPP, where they differ."""

from __future__ import annotations

from canopy import semantics as model
from canopy.semantics import COMPLETED
from canopy.semantics.spec import RUNNING, SKIPPED
from differential.differences.node import BtCppNode


class Condition(BtCppNode, model.Condition):
    pass


class SyncAction(BtCppNode, model.SyncAction):
    def tick(self) -> int:
        self.code = self.tick_children()  # of all nodes, this one stores SKIPPED
        return self.code


class StatefulAction(BtCppNode, model.StatefulAction):
    def tick_children(self) -> int:
        if self.code in COMPLETED:
            return self.code  # it was not reset: see "no else" and "while"
        status = super().tick_children()
        if status == SKIPPED and self.code == RUNNING:
            self.world.differs("skipped action")
        return status

    def on_halt(self) -> None:
        if self.code == RUNNING:
            super().on_halt()


class AlwaysSuccess(BtCppNode, model.AlwaysSuccess):
    pass


class AlwaysFailure(BtCppNode, model.AlwaysFailure):
    pass
