# SPDX-License-Identifier: MIT
"""The control nodes: each class is a row of the table in docs/semantics.md."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics.node import COMPLETED, Node
from canopy.semantics.spec import FAILURE, RUNNING, SKIPPED, SUCCESS


class InOrder(Node):
    """What the nodes share that tick their children one after the other and remember where they are."""

    go_on: ClassVar[int] = SUCCESS
    """The status of a child after which the next one is ticked; the other completed one ends the node."""
    yields: ClassVar[bool] = False
    keeps_index: ClassVar[bool] = False

    def begin(self) -> None:
        self.index = 0
        self.skipped = 0

    def on_halt(self) -> None:
        index = self.index
        super().on_halt()
        if self.keeps_index:
            self.index = index

    def tick_children(self) -> int:
        while self.index < len(self.children):
            child = self.children[self.index]
            started = child.code != RUNNING
            status = child.tick()
            if status == RUNNING:
                return RUNNING
            if status == SKIPPED:
                self.skipped += 1
            elif status != self.go_on:
                return self.ended_by(status)
            self.index += 1
            if status == self.go_on and started and self.index < len(self.children) and self.yields_now():
                return RUNNING
        all_skipped = self.skipped == len(self.children)
        self.reset_all()
        self.begin()
        return SKIPPED if all_skipped else self.go_on

    def yields_now(self) -> bool:
        """Asked when a child has completed in the tick it was started in, and another one follows."""
        return self.yields

    def ended_by(self, status: int) -> int:
        self.reset_all()
        self.begin()
        return status


class Sequence(InOrder):
    pass


class SequenceWithMemory(InOrder):
    keeps_index = True

    def ended_by(self, status: int) -> int:
        self.reset_all()
        self.skipped = 0
        return status


class AsyncSequence(InOrder):
    yields = True


class Fallback(InOrder):
    go_on = FAILURE


class AsyncFallback(InOrder):
    go_on = FAILURE
    yields = True


class Reactive(Node):
    """The paper's Algorithms 1 and 2: begins with the first child in every tick."""

    go_on: ClassVar[int] = SUCCESS

    def tick_children(self) -> int:
        all_skipped = True
        for index, child in enumerate(self.children):
            status = child.tick()
            all_skipped = all_skipped and status == SKIPPED
            if status == RUNNING:
                for later in self.children[index + 1 :]:  # the earlier ones are not RUNNING any more
                    later.reset()
                return RUNNING
            if status not in (SKIPPED, self.go_on):
                self.reset_all()
                return status
        self.reset_all()
        return SKIPPED if all_skipped else self.go_on


class ReactiveSequence(Reactive):
    pass


class ReactiveFallback(Reactive):
    go_on = FAILURE


class Remembering(Node):
    """What Parallel and ParallelAll share: a completed child is remembered, and not ticked again."""

    def begin(self) -> None:
        self.done: dict[int, int] = {}

    def count(self, status: int) -> int:
        return list(self.done.values()).count(status)

    def threshold(self, parameter: int) -> int:
        """A threshold; a negative one counts down from N + 1."""
        value = self.spec.parameters[parameter]
        return value if value >= 0 else max(len(self.children) + 1 + value, 0)

    def complete(self, status: int) -> int:
        self.begin()
        self.reset_all()
        return status


class Parallel(Remembering):
    def tick_children(self) -> int:
        enough, too_many = self.threshold(0), self.threshold(1)
        skipped = 0
        for index, child in enumerate(self.children):
            if index not in self.done:
                status = child.tick()
                if status == SKIPPED:
                    skipped += 1
                elif status in COMPLETED:
                    self.done[index] = status
            successes, failures = self.count(SUCCESS), self.count(FAILURE)
            if self.spec.parameters[0] < 0:
                successes += skipped
            if successes >= enough:
                return self.complete(SUCCESS)
            if failures >= too_many or len(self.children) - failures < enough:
                return self.complete(FAILURE)
        return self.complete(SKIPPED) if skipped == len(self.children) else RUNNING


class ParallelAll(Remembering):
    def tick_children(self) -> int:
        skipped = 0
        for index, child in enumerate(self.children):
            if index not in self.done:
                status = child.tick()
                if status == SKIPPED:
                    skipped += 1
                elif status in COMPLETED:
                    self.done[index] = status
        if skipped == len(self.children):
            return self.complete(SKIPPED)
        if skipped + len(self.done) < len(self.children):
            return RUNNING
        return self.complete(FAILURE if self.count(FAILURE) >= self.threshold(0) else SUCCESS)


class ReactiveParallel(Node):
    """The paper's Algorithm 3."""

    def tick_children(self) -> int:
        statuses = [child.tick() for child in self.children]
        counted = len(statuses) - statuses.count(SKIPPED)
        written = self.spec.parameters[0]
        enough = max(written if written >= 0 else counted + 1 + written, 1)
        if counted == 0:
            self.reset_all()
            return SKIPPED
        if statuses.count(SUCCESS) >= enough:
            self.reset_all()
            return SUCCESS
        if statuses.count(FAILURE) > counted - enough:
            self.reset_all()
            return FAILURE
        return RUNNING


class IfThenElse(Node):
    def begin(self) -> None:
        self.branch = 0

    def tick_children(self) -> int:
        if self.branch == 0:
            status = self.children[0].tick()
            if status == RUNNING:
                return RUNNING
            if status == SKIPPED:
                return self.condition_skipped()
            self.branch = 1 if status == SUCCESS else 2
            if self.branch >= len(self.children):
                return self.no_else()
        status = self.children[self.branch].tick()
        if status != RUNNING:
            self.begin()
            self.reset_all()
        return status

    def condition_skipped(self) -> int:
        self.reset_all()
        return SKIPPED

    def no_else(self) -> int:
        self.begin()
        self.reset_all()
        return FAILURE


class WhileDoElse(Node):
    def tick_children(self) -> int:
        condition = self.children[0].tick()
        if condition == RUNNING:
            return RUNNING
        if condition == SKIPPED:
            return self.condition_skipped()
        branch, other = (1, 2) if condition == SUCCESS else (2, 1)
        if other < len(self.children):
            self.children[other].reset()
        status = self.children[branch].tick() if branch < len(self.children) else FAILURE
        if status != RUNNING:
            self.reset_all()
        return status

    def condition_skipped(self) -> int:
        self.reset_all()
        return SKIPPED


class TryCatch(Node):
    def begin(self) -> None:
        self.index = 0
        self.skipped = 0

    def on_halt(self) -> None:
        self.reset_all()
        if self.spec.parameters[0] and self.index < len(self.children):
            self.children[-1].tick()
            self.children[-1].reset()
        self.begin()

    def tick_children(self) -> int:
        last = len(self.children) - 1
        while self.index < last:
            status = self.children[self.index].tick()
            if status == RUNNING:
                return RUNNING
            if status == FAILURE:
                self.reset_all()
                self.index = len(self.children)
                break
            self.skipped += status == SKIPPED
            self.index += 1
        if self.index > last and self.children[last].tick() == RUNNING:
            return RUNNING
        result = FAILURE if self.index > last else SKIPPED if self.skipped == last else SUCCESS
        self.reset_all()
        self.begin()
        return result
