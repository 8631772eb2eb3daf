# SPDX-License-Identifier: MIT
"""The control nodes of BehaviorTree.CPP, where they differ."""

from __future__ import annotations

from canopy import semantics as model
from canopy.semantics import COMPLETED
from canopy.semantics.spec import FAILURE, IDLE, RUNNING, SKIPPED
from differential.differences.leaves import StatefulAction
from differential.differences.node import BtCppNode, bare
from differential.differences.rules import ThrownError


class InOrder(BtCppNode, model.InOrder):
    def tick_children(self) -> int:
        if self.code == IDLE:
            self.skipped = 0
        elif self.code in COMPLETED and self.skipped:
            self.world.differs("stale skips")
        return super().tick_children()

    def ended_by(self, status: int) -> int:
        skipped = self.skipped
        status = super().ended_by(status)
        self.skipped = skipped
        return status


class Sequence(InOrder, model.Sequence):
    pass


class AsyncSequence(InOrder, model.AsyncSequence):
    pass


class SequenceWithMemory(InOrder, model.SequenceWithMemory):
    def on_halt(self) -> None:
        skipped = self.skipped
        super().on_halt()
        self.skipped = skipped

    def ended_by(self, status: int) -> int:
        for child in self.children[self.index :]:
            child.reset()
        return status

    def yields_now(self) -> bool:
        self.world.differs("memory yields")
        return True


class Fallback(InOrder, model.Fallback):
    pass


class AsyncFallback(InOrder, model.AsyncFallback):
    pass


class Reactive(BtCppNode, model.Reactive):
    """All children but the RUNNING one become IDLE, not only those that were RUNNING. This is only shown."""

    def tick_children(self) -> int:
        all_skipped = True
        for child in self.children:
            status = child.tick()
            if status == SKIPPED:
                if isinstance(child, BtCppNode) and child.has_count():
                    self.world.differs("skipped count")
                child.reset()
                continue
            all_skipped = False
            if status == RUNNING:
                for other in self.children:
                    if other is not child:
                        other.reset()
                return RUNNING
            if status != self.go_on:
                self.reset_all()
                return status
        self.reset_all()
        return SKIPPED if all_skipped else self.go_on


class ReactiveSequence(Reactive, model.ReactiveSequence):
    pass


class ReactiveFallback(Reactive, model.ReactiveFallback):
    pass


class Remembering(BtCppNode, model.Remembering):
    """One that is SKIPPED does not reset its children. This is only shown."""

    def complete(self, status: int) -> int:
        if status != SKIPPED:
            return super().complete(status)
        self.keeps_count(self.children)
        return SKIPPED


class Parallel(Remembering, model.Parallel):
    pass


class ParallelAll(Remembering, model.ParallelAll):
    pass


class IfThenElse(BtCppNode, model.IfThenElse):
    def tick_children(self) -> int:
        if (
            self.branch == 0
            and isinstance(bare(self.children[0]), StatefulAction)
            and self.children[0].code in COMPLETED
        ):
            self.world.differs("no else")
        return super().tick_children()

    def condition_skipped(self) -> int:
        self.world.differs("skipped condition")
        raise ThrownError

    def no_else(self) -> int:
        self.begin()
        return FAILURE


class WhileDoElse(BtCppNode, model.WhileDoElse):
    def tick_children(self) -> int:
        if isinstance(bare(self.children[0]), StatefulAction) and self.children[0].code in COMPLETED:
            self.world.differs("while")
        return super().tick_children()

    def condition_skipped(self) -> int:
        self.world.differs("skipped condition")
        raise ThrownError
