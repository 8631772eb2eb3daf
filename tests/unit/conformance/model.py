# SPDX-License-Identifier: MIT
"""One node over leaf children, as docs/semantics.md describes it: the source of the conformance table.

Written from the text alone, without a look at the engine, so that a misreading would have to be made twice. A child
is a StatefulAction that returns what the table says. Here are the nodes that have no scripts of their own; their
parameters may come from entries. (When these are looked at was in no text: that was taken from the engine, and written
down.) The other nodes are in scripted_model.py.
"""

from __future__ import annotations

from unit.conformance.node import Node


class Sequence(Node):
    """Sequence; with go_on F, Fallback."""

    go_on = "S"
    keeps_index = False
    yields = False

    def forget(self) -> None:
        """Start at the first child."""
        self.index = 0
        self.skipped: frozenset[int] = frozenset()

    def on_halt(self) -> None:
        """The place is kept by a node with memory; what was skipped before it, by none."""
        self.skipped = frozenset()
        if not self.keeps_index:
            self.forget()

    def memory(self) -> tuple[object, ...]:
        """The place, and which children before it were skipped."""
        return (self.index, self.skipped)

    def on_tick(self) -> str:
        """Go through the children from the index on."""
        while self.index < self.children:
            started_now = self.child_status[self.index] != "R"
            status = self.run(self.index)
            if status == "R":
                return "R"
            if status == "K":
                self.skipped |= {self.index}
            elif status != self.go_on:
                self.on_halt()
                return status
            self.index += 1
            if status == self.go_on and self.yields and started_now and self.index < self.children:
                return "R"
        result = "K" if len(self.skipped) == self.children else self.go_on
        self.forget()
        return result


class Fallback(Sequence):
    """The mirror image."""

    go_on = "F"


class SequenceWithMemory(Sequence):
    """FAILURE and a halt keep the index."""

    keeps_index = True


class AsyncSequence(Sequence):
    """RUNNING between two children when the first completed in the tick it was started in."""

    yields = True


class AsyncFallback(Fallback):
    """The mirror image."""

    yields = True


class ReactiveSequence(Node):
    """The paper's Sequence, Algorithm 2."""

    go_on = "S"

    def on_tick(self) -> str:
        """Start at child 0."""
        all_skipped = True
        for child in range(self.children):
            status = self.run(child)
            if status == "R":
                self.others_running(child)
                return "R"
            if status == "K":
                continue
            all_skipped = False
            if status != self.go_on:
                return status
        return "K" if all_skipped else self.go_on

    def state(self) -> tuple[object, ...]:
        """Only which child is RUNNING matters: each tick starts anew."""
        return self.running()


class ReactiveFallback(ReactiveSequence):
    """The paper's Fallback, Algorithm 1."""

    go_on = "F"


def threshold(written: int, children: int) -> int:
    """Negative: from N+1 down."""
    return written if written >= 0 else children + 1 + written


class Parallel(Node):
    """Parameters: success_count, failure_count."""

    def on_tick(self) -> str:
        """Tick those that have not completed; test the thresholds after each."""
        skipped = 0
        for child in range(self.children):
            if self.child_status[child] in "SF":
                continue
            skipped += self.run(child) == "K"
            successes, failures = self.child_status.count("S"), self.child_status.count("F")
            wanted, failure_count = self.parameter(0), threshold(self.parameter(1), self.children)
            success_count = threshold(wanted, self.children)
            if successes + (skipped if wanted < 0 else 0) >= success_count:
                return "S"
            if failures >= failure_count or self.children - failures < success_count:
                return "F"
        return "K" if skipped == self.children else "R"


class ParallelAll(Node):
    """Parameter: max_failures."""

    def on_tick(self) -> str:
        """Tick those that have not completed; wait for all."""
        for child in range(self.children):
            if self.child_status[child] not in "SF":
                self.run(child)
        if "R" in self.child_status:
            return "R"
        if self.child_status.count("K") == self.children:
            return "K"
        return "F" if self.child_status.count("F") >= threshold(self.parameter(0), self.children) else "S"


class ReactiveParallel(Node):
    """The paper's Parallel, Algorithm 3. Parameter: success_count."""

    def on_tick(self) -> str:
        """Tick all of them."""
        for child in range(self.children):
            self.run(child)
        counted = self.children - self.child_status.count("K")
        if counted == 0:
            return "K"
        needed = max(threshold(self.parameter(0), counted), 1)
        if self.child_status.count("S") >= needed:
            return "S"
        return "F" if self.child_status.count("F") > counted - needed else "R"

    def state(self) -> tuple[object, ...]:
        """All are ticked in every tick, so only which are RUNNING matters."""
        return self.running()


class IfThenElse(Node):
    """The condition is not asked again while a branch runs."""

    def forget(self) -> None:
        """The condition is next."""
        self.place = 0

    def memory(self) -> tuple[object, ...]:
        """Which child is under way."""
        return (self.place,)

    def on_tick(self) -> str:
        """Ask the condition, then run a branch."""
        if self.place == 0:
            condition = self.run(0)
            if condition in "RK":
                return condition
            self.place = 1 if condition == "S" else 2
        if self.place >= self.children:
            self.place = 0
            return "F"
        status = self.run(self.place)
        if status != "R":
            self.place = 0
        return status


class WhileDoElse(Node):
    """The condition is asked every tick."""

    def on_tick(self) -> str:
        """Ask the condition, halt the other branch, run this one."""
        condition = self.run(0)
        if condition in "RK":
            return condition
        branch, other = (1, 2) if condition == "S" else (2, 1)
        if other < self.children:
            self.reset_child(other)
        return self.run(branch) if branch < self.children else "F"

    def state(self) -> tuple[object, ...]:
        """Each tick starts at the condition, so only which are RUNNING matters."""
        return self.running()


class TryCatch(Node):
    """All children but the last as a Sequence; the last one when that fails. Parameter: catch_on_halt."""

    def forget(self) -> None:
        """Start at the first child."""
        self.index = 0
        self.catching = False
        self.skipped: frozenset[int] = frozenset()

    def memory(self) -> tuple[object, ...]:
        """The place, and which children were skipped."""
        return (self.index, self.catching, self.skipped)

    def on_halt(self) -> None:
        """The handler gets its one tick, unless it was under way."""
        if self.status == "R" and self.parameter(0) and not self.catching:
            self.run(self.children - 1)
            self.reset_child(self.children - 1)
        self.forget()

    def on_tick(self) -> str:
        """The Sequence, or the handler."""
        last = self.children - 1
        while not self.catching and self.index < last:
            status = self.run(self.index)
            if status == "R":
                return "R"
            if status == "F":
                self.catching = True
                for child in range(last):
                    self.reset_child(child)
            if status == "K":
                self.skipped |= {self.index}
            self.index += 1
        result = "K" if len(self.skipped) == last else "S"
        if self.catching:
            if self.run(last) == "R":
                return "R"
            result = "F"
        self.forget()
        return result


class Result(Node):
    """A decorator that changes the child's result."""

    results = "SF"

    def on_tick(self) -> str:
        """Change SUCCESS and FAILURE, pass the rest on."""
        status = self.run(0)
        return {"S": self.results[0], "F": self.results[1]}.get(status, status)


class Inverter(Result):
    """Swapped."""

    results = "FS"


class ForceSuccess(Result):
    """SUCCESS."""

    results = "SS"


class ForceFailure(Result):
    """FAILURE."""

    results = "FF"


class KeepRunningUntilFailure(Result):
    """RUNNING until FAILURE."""

    results = "RF"


class Repeat(Node):
    """Parameter: num_cycles."""

    again = "S"

    def forget(self) -> None:
        """No cycle done."""
        self.count = 0

    def memory(self) -> tuple[object, ...]:
        """Cycles done."""
        return (self.count,)

    def on_tick(self) -> str:
        """One cycle a tick."""
        if self.parameter(0) == 0:
            self.count = 0
            return self.again
        status = self.run(0)
        most = self.parameter(0)
        if status in "RK":
            return status
        if most >= 0:
            self.count += 1
        if status != self.again or 0 <= most <= self.count:
            self.count = 0
            return status
        self.reset_child(0)
        return "R"


class RetryUntilSuccessful(Repeat):
    """The mirror image."""

    again = "F"


class Delay(Node):
    """Parameter: delay_msec."""

    def forget(self) -> None:
        """The clock does not run."""
        self.left: int | None = None

    def memory(self) -> tuple[object, ...]:
        """Milliseconds left."""
        return (self.left,)

    def pass_time(self) -> None:
        """Less is left."""
        self.left = max(self.left - 1, 0) if self.left is not None else None

    def on_tick(self) -> str:
        """Wait, then tick the child."""
        if self.left is None:
            self.left = self.parameter(0)
        if self.left > 0:
            return "R"
        status = self.run(0)
        if status in "SF":
            self.left = None
        return status


class Timeout(Delay):
    """Parameter: msec."""

    def on_tick(self) -> str:
        """Ask the clock before each further tick of the child."""
        if self.left is not None and self.left == 0:
            self.left = None
            return "F"
        if self.left is None:
            self.left = self.parameter(0)
        status = self.run(0)
        if status != "R":
            self.left = None
        return status


class RunOnce(Node):
    """Parameter: then_skip."""

    def forget(self) -> None:
        """It has not run."""
        self.remembered = ""

    def on_halt(self) -> None:
        """A halt does not forget it."""

    def memory(self) -> tuple[object, ...]:
        """The first completion."""
        return (self.remembered,)

    def on_tick(self) -> str:
        """Once."""
        if self.remembered:
            return "K" if self.parameter(0) else self.remembered
        status = self.run(0)
        if status in "SF":
            self.remembered = status
        return status
