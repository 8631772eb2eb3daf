# SPDX-License-Identifier: MIT
"""The circuits of the control nodes: each class is a row of the table in docs/semantics.md."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics.spec import FAILURE, RUNNING, SKIPPED, SUCCESS
from canopy.verify.logic.cells import STATUSES, Cell, Returned
from canopy.verify.logic.circuit import FALSE, TRUE


def _opposite(status: int) -> int:
    return FAILURE if status == SUCCESS else SUCCESS


class InOrder(Cell):
    """One child after the other. One latch a child says where it is; one, that a child was not SKIPPED so far."""

    go_on: ClassVar[int] = SUCCESS
    yields: ClassVar[bool] = False
    keeps_index: ClassVar[bool] = False

    def rule(self, ticked: int) -> Returned:
        """RUNNING and the status that ends it stop; the rest goes on at the next child."""
        circuit, both, either = self.circuit, self.circuit.both, self.circuit.either
        at = [circuit.latch(start=index == 0) for index in range(len(self.children))]
        counted = circuit.latch()
        stays: list[int] = []
        arrived, some, ended, running = FALSE, counted, FALSE, FALSE
        yielded = FALSE
        for index, child in enumerate(self.children):
            started = child.old[RUNNING] ^ 1
            reached = either(both(ticked, at[index]), arrived)
            status = child.tick(reached)
            end = status[_opposite(self.go_on)]
            stay = either(status[RUNNING], yielded)
            yielded = FALSE
            some = either(some, status[self.go_on])
            arrived = either(status[self.go_on], status[SKIPPED])
            if self.yields and index + 1 < len(self.children):
                yielded = both(status[self.go_on], started)
                arrived = both(arrived, yielded ^ 1)
                running = either(running, yielded)
            running = either(running, status[RUNNING])
            ended = either(ended, end)
            stays.append(either(stay, end) if self.keeps_index else stay)
        self._remember(at, stays, counted, some, running)
        self.abandon_all(either(ended, arrived))
        return {
            RUNNING: running,
            _opposite(self.go_on): ended,
            self.go_on: both(arrived, some),
            SKIPPED: both(arrived, some ^ 1),
        }

    def _remember(self, at: list[int], stays: list[int], counted: int, some: int, running: int) -> None:
        """Where it goes on. One that keeps its index keeps it in a halt, which is one at RUNNING, too."""
        later = self.circuit.any(stays[1:])
        for index, latch in enumerate(at):
            value = self.circuit.any(stays[1:]) ^ 1 if index == 0 else stays[index]
            if self.keeps_index:
                self.circuit.follow(latch, self.circuit.choose(self.ticked, value, latch))
            else:
                self.remember(latch, value, TRUE if index == 0 else FALSE)
        # What a node that forgot its count and kept its index has passed cannot all have been SKIPPED any more.
        kept = self.circuit.both(running, some)
        if not self.keeps_index:
            self.remember(counted, kept)
            return
        self.remember(
            counted,
            self.circuit.choose(running, some, later),
            self.circuit.choose(self.ticked, later, at[0] ^ 1),
        )


class Fallback(InOrder):
    """The mirror image."""

    go_on = FAILURE


class AsyncSequence(InOrder):
    """Yields after a child that completed at once."""

    yields = True


class AsyncFallback(Fallback):
    """Yields after a child that completed at once."""

    yields = True


class SequenceWithMemory(InOrder):
    """Goes on at the child that failed or was halted."""

    keeps_index = True


class ReactiveSequence(Cell):
    """Starts at the first child in every tick."""

    go_on: ClassVar[int] = SUCCESS

    def rule(self, ticked: int) -> Returned:
        """What comes after a RUNNING child is reset."""
        either = self.circuit.either
        arrived, some, ended, running = ticked, FALSE, FALSE, FALSE
        for child in self.children:
            child.abandon(running)
            status = child.tick(arrived)
            arrived = either(status[self.go_on], status[SKIPPED])
            some = either(some, status[self.go_on])
            running = either(running, status[RUNNING])
            ended = either(ended, status[_opposite(self.go_on)])
        self.abandon_all(either(ended, arrived))
        return {
            RUNNING: running,
            _opposite(self.go_on): ended,
            self.go_on: self.circuit.both(arrived, some),
            SKIPPED: self.circuit.both(arrived, some ^ 1),
        }


class ReactiveFallback(ReactiveSequence):
    """The mirror image."""

    go_on = FAILURE


class Remembering(Cell):
    """Parallel and ParallelAll: two latches a child say that it has completed, and how."""

    def begin(self) -> None:
        """Makes the latches."""
        self.good = [self.circuit.latch() for _ in self.children]
        self.bad = [self.circuit.latch() for _ in self.children]

    def threshold(self, value: int) -> int:
        """A negative one counts down from N + 1."""
        return value if value >= 0 else max(len(self.children) + 1 + value, 0)

    def tick_child(self, index: int, ticked: int) -> Returned:
        """Ticks a child that has not completed."""
        done = self.circuit.either(self.good[index], self.bad[index])
        return self.children[index].tick(self.circuit.both(ticked, done ^ 1))

    def finish(self, results: list[Returned], over: int) -> None:
        """Remembers what has completed, and forgets it when the node is done."""
        for latches, status in ((self.good, SUCCESS), (self.bad, FAILURE)):
            for latch, result in zip(latches, results, strict=True):
                self.remember(latch, self.circuit.both(self.circuit.either(latch, result[status]), over ^ 1))
        self.abandon_all(over)


def _reached(counted: list[int], needed: int) -> int:
    """Has a unary count reached a number?"""
    if needed <= 0:
        return TRUE
    return counted[needed - 1] if needed <= len(counted) else FALSE


class Parallel(Remembering):
    """Asks its thresholds after each child."""

    def rule(self, ticked: int) -> Returned:
        """Once one is met, the rest of the children are not ticked."""
        self.begin()
        circuit, count = self.circuit, len(self.children)
        enough, too_many = self.threshold(self.spec.parameters[0]), self.threshold(self.spec.parameters[1])
        too_many = min(too_many, count - enough + 1)
        good = circuit.count(self.good, max(enough, 1))
        bad = circuit.count(self.bad, max(too_many, 1))
        going, success, failure, skipped = ticked, FALSE, FALSE, ticked
        results = []
        for index in range(count):
            status = self.tick_child(index, going)
            results.append(status)
            counts = [status[SUCCESS], status[SKIPPED]] if self.spec.parameters[0] < 0 else [status[SUCCESS]]
            good = circuit.add(good, counts, len(good))
            bad = circuit.add(bad, [status[FAILURE]], len(bad))
            skipped = circuit.both(skipped, status[SKIPPED])
            won = circuit.both(going, _reached(good, enough))
            lost = circuit.all((going, won ^ 1, _reached(bad, too_many)))
            success, failure = circuit.either(success, won), circuit.either(failure, lost)
            going = circuit.all((going, won ^ 1, lost ^ 1))
        skipped = circuit.both(skipped, going)
        self.finish(results, circuit.any((success, failure, skipped)))
        return {SUCCESS: success, FAILURE: failure, SKIPPED: skipped, RUNNING: circuit.both(going, skipped ^ 1)}


class ParallelAll(Remembering):
    """Ends when no child is RUNNING any more."""

    def rule(self, ticked: int) -> Returned:
        """Then the failures are counted."""
        self.begin()
        circuit = self.circuit
        results = [self.tick_child(index, ticked) for index in range(len(self.children))]
        skipped = circuit.all(result[SKIPPED] for result in results)
        running = circuit.any(result[RUNNING] for result in results)
        failures = [circuit.either(old, new[FAILURE]) for old, new in zip(self.bad, results, strict=True)]
        most = self.threshold(self.spec.parameters[0])
        failed = _reached(circuit.count(failures, max(most, 1)), most)
        over = circuit.both(ticked, running ^ 1)
        ends = circuit.both(over, skipped ^ 1)
        self.finish(results, over)
        return {
            SKIPPED: skipped,
            RUNNING: running,
            FAILURE: circuit.both(ends, failed),
            SUCCESS: circuit.both(ends, failed ^ 1),
        }


class ReactiveParallel(Cell):
    """Counts in every tick; SKIPPED children do not count."""

    def rule(self, ticked: int) -> Returned:
        """With N - K children counted: M successes are enough, more than N - K - M failures too many."""
        circuit, count, written = self.circuit, len(self.children), self.spec.parameters[0]
        results = [child.tick(ticked) for child in self.children]
        good, bad = [one[SUCCESS] for one in results], [one[FAILURE] for one in results]
        not_counted = [one[SKIPPED] for one in results]
        none = circuit.all(not_counted)
        if written >= 0:
            enough = max(written, 1)
            won = _reached(circuit.count(good, enough), enough)
            needed = count - enough + 1
            lost = _reached(circuit.count([*bad, *not_counted], max(needed, 1)), needed)
        else:
            needed = count + 1 + written
            won = circuit.both(
                circuit.any(good), _reached(circuit.count([*good, *not_counted], max(needed, 1)), needed)
            )
            all_failed = circuit.all(circuit.either(b, k) for b, k in zip(bad, not_counted, strict=True))
            lost = circuit.either(_reached(circuit.count(bad, -written), -written), all_failed)
        counts = circuit.both(ticked, none ^ 1)
        success = circuit.both(counts, won)
        failure = circuit.all((counts, won ^ 1, lost))
        over = circuit.any((none, success, failure))
        self.abandon_all(over)
        return {SKIPPED: none, SUCCESS: success, FAILURE: failure, RUNNING: circuit.both(ticked, over ^ 1)}


class IfThenElse(Cell):
    """Two latches say which branch runs."""

    def rule(self, ticked: int) -> Returned:
        """The condition is asked while no branch runs."""
        circuit, both, either = self.circuit, self.circuit.both, self.circuit.either
        at = [circuit.latch(), circuit.latch()]
        asked = self.children[0].tick(both(ticked, circuit.any(at) ^ 1))
        go = [either(both(ticked, at[0]), asked[SUCCESS]), either(both(ticked, at[1]), asked[FAILURE])]
        branches = [child.tick(condition) for child, condition in zip(self.children[1:], go, strict=False)]
        result = {status: circuit.any(one[status] for one in branches) for status in STATUSES}
        if len(self.children) == 2:
            result[FAILURE] = either(result[FAILURE], go[1])
        result[SKIPPED] = either(result[SKIPPED], asked[SKIPPED])
        self.abandon_all(circuit.any((result[SUCCESS], result[FAILURE], result[SKIPPED])))
        for index, latch in enumerate(at):
            self.remember(latch, branches[index][RUNNING] if index < len(branches) else FALSE)
        result[RUNNING] = either(result[RUNNING], asked[RUNNING])
        return result


class WhileDoElse(Cell):
    """Without memory."""

    def rule(self, ticked: int) -> Returned:
        """The branch that is not taken is halted."""
        circuit, either = self.circuit, self.circuit.either
        asked = self.children[0].tick(ticked)
        go = [asked[SUCCESS], asked[FAILURE]]
        branches = [child.tick(condition) for child, condition in zip(self.children[1:], go, strict=False)]
        for child, condition in zip(self.children[1:], reversed(go), strict=False):
            child.abandon(condition)
        result = {status: circuit.any(one[status] for one in branches) for status in STATUSES}
        if len(self.children) == 2:
            result[FAILURE] = either(result[FAILURE], go[1])
        result[SKIPPED] = either(result[SKIPPED], asked[SKIPPED])
        self.abandon_all(circuit.any((result[SUCCESS], result[FAILURE], result[SKIPPED])))
        result[RUNNING] = either(result[RUNNING], asked[RUNNING])
        return result


class TryCatch(Cell):
    """One latch a child says where it is; the last one, that it cleans up."""

    def rule(self, ticked: int) -> Returned:
        """A Sequence of all but the last."""
        circuit, both, either = self.circuit, self.circuit.both, self.circuit.either
        at = [circuit.latch(start=index == 0) for index in range(len(self.children))]
        counted = circuit.latch()
        arrived, failed, some, running = FALSE, FALSE, counted, FALSE
        stays = []
        for child, latch in zip(self.children[:-1], at, strict=False):
            status = child.tick(either(both(ticked, latch), arrived))
            arrived = either(status[SUCCESS], status[SKIPPED])
            some = either(some, status[SUCCESS])
            failed = either(failed, status[FAILURE])
            running = either(running, status[RUNNING])
            stays.append(status[RUNNING])
        last = self.children[-1].tick(either(both(ticked, at[-1]), failed))
        caught = both(self.children[-1].ticked, last[RUNNING] ^ 1)
        stays.append(last[RUNNING])
        for child in self.children[:-1]:
            child.abandon(failed)
        self.abandon_all(either(caught, arrived))
        for index, latch in enumerate(at):
            value = circuit.any(stays[1:]) ^ 1 if index == 0 else stays[index]
            self.remember(latch, value, TRUE if index == 0 else FALSE)
        self.remember(counted, both(running, some))
        return {
            RUNNING: either(running, last[RUNNING]),
            FAILURE: caught,
            SUCCESS: both(arrived, some),
            SKIPPED: both(arrived, some ^ 1),
        }
