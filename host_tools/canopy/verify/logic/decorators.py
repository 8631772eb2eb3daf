# SPDX-License-Identifier: MIT
"""The circuits of the decorators, and of Switch: each class is a row of the tables in docs/semantics.md."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics.spec import ATTRIBUTES, FAILURE, RUNNING, SKIPPED, SUCCESS
from canopy.verify.logic.cells import STATUSES, Cell, Returned
from canopy.verify.logic.circuit import FALSE, TRUE


class Decorator(Cell):
    """A child that is not RUNNING any more is reset."""

    def tick_child(self, ticked: int) -> Returned:
        """Ticks the child, and resets it when it is done."""
        child = self.children[0]
        status = child.tick(ticked)
        child.abandon(self.circuit.both(ticked, status[RUNNING] ^ 1))
        return status

    def child_runs(self) -> int:
        """Was the child RUNNING before this tick?"""
        return self.children[0].old[RUNNING]

    def otherwise(self, status: Returned, condition: int, other: int) -> Returned:
        """The child's status, or `other` if the condition holds, in which it is not ticked."""
        return status | {other: self.circuit.either(status[other], condition)}


class Translated(Decorator):
    """What only gives another status: `becomes`; the others stay."""

    becomes: ClassVar[dict[int, int]] = {}

    def rule(self, ticked: int) -> Returned:
        """Each status is translated."""
        status = self.tick_child(ticked)
        sources = {to: [s for s in STATUSES if self.becomes.get(s, s) == to] for to in STATUSES}
        return {to: self.circuit.any(status[s] for s in found) for to, found in sources.items()}


class Inverter(Translated):
    """SUCCESS and FAILURE swapped."""

    becomes: ClassVar[dict[int, int]] = {SUCCESS: FAILURE, FAILURE: SUCCESS}


class ForceSuccess(Translated):
    """SUCCESS when the child is done."""

    becomes: ClassVar[dict[int, int]] = {FAILURE: SUCCESS}


class ForceFailure(Translated):
    """FAILURE when the child is done."""

    becomes: ClassVar[dict[int, int]] = {SUCCESS: FAILURE}


class KeepRunningUntilFailure(Translated):
    """RUNNING when the child succeeds."""

    becomes: ClassVar[dict[int, int]] = {SUCCESS: RUNNING}


class Repeat(Decorator):
    """Counts the cycles that are done, in binary."""

    counted: ClassVar[int] = SUCCESS

    def rule(self, ticked: int) -> Returned:
        """One cycle a tick."""
        wanted = self.spec.parameters[0]
        if wanted == 0:
            return {self.counted: TRUE}
        status = self.tick_child(ticked)
        other = FAILURE if self.counted == SUCCESS else SUCCESS
        goes_on = status[self.counted]
        last = FALSE
        if wanted > 0:
            bits = [self.circuit.latch() for _ in range((wanted - 1).bit_length())]
            last = self.circuit.all(bit if wanted - 1 >> place & 1 else bit ^ 1 for place, bit in enumerate(bits))
            goes_on = self.circuit.both(status[self.counted], last ^ 1)
            over = self.circuit.either(status[other], self.circuit.both(status[self.counted], last))
            carry = goes_on
            for bit in bits:
                value = self.circuit.choose(carry, bit ^ 1, bit)
                carry = self.circuit.both(carry, bit)
                self.remember(bit, self.circuit.both(value, over ^ 1), reset=True)
        return {
            RUNNING: self.circuit.either(status[RUNNING], goes_on),
            self.counted: self.circuit.both(status[self.counted], last),
            other: status[other],
            SKIPPED: status[SKIPPED],
        }


class RetryUntilSuccessful(Repeat):
    """The mirror image."""

    counted = FAILURE


class Delay(Decorator):
    """Waits, then ticks its child until it has completed."""

    def rule(self, ticked: int) -> Returned:
        """A child that was SKIPPED need not wait again."""
        started, waited = self.circuit.latch(), self.circuit.latch()
        start = self.circuit.both(ticked, started ^ 1)
        over = self.circuit.either(waited, self.time_is_over(self.spec.parameters[0], start))
        status = self.tick_child(self.circuit.both(ticked, over))
        on = self.circuit.either(status[SUCCESS], status[FAILURE]) ^ 1
        self.remember(started, on, reset=True)
        self.remember(waited, self.circuit.both(over, on), reset=True)
        return self.otherwise(status, over ^ 1, RUNNING)


class Timeout(Decorator):
    """Asks the clock before each tick of its child but the first."""

    def rule(self, ticked: int) -> Returned:
        """Time over: the child is halted."""
        started = self.circuit.latch()
        start = self.circuit.both(ticked, started ^ 1)
        over = self.circuit.all((ticked, started, self.time_is_over(self.spec.parameters[0], start)))
        status = self.tick_child(self.circuit.both(ticked, over ^ 1))
        self.children[0].abandon(over)
        self.remember(started, status[RUNNING])
        return self.otherwise(status, over, FAILURE)


class RunOnce(Decorator):
    """A halt does not forget what it remembers."""

    def rule(self, ticked: int) -> Returned:
        """SKIPPED, or the status of the one time."""
        good, bad = self.circuit.latch(), self.circuit.latch()
        known = self.circuit.either(good, bad)
        status = self.tick_child(self.circuit.both(ticked, known ^ 1))
        self.circuit.follow(good, self.circuit.either(good, status[SUCCESS]))
        self.circuit.follow(bad, self.circuit.either(bad, status[FAILURE]))
        if self.spec.parameters[0]:
            return self.otherwise(status, known, SKIPPED)
        return self.otherwise(self.otherwise(status, good, SUCCESS), bad, FAILURE)


class Precondition(Decorator):
    """Ticks its child if a script allows it."""

    def rule(self, ticked: int) -> Returned:
        """Asked while the child is not RUNNING."""
        asked = self.circuit.both(ticked, self.child_runs() ^ 1)
        allowed = self.circuit.either(self.child_runs(), self.answer(asked))
        status = self.tick_child(self.circuit.both(ticked, allowed))
        return self.otherwise(status, allowed ^ 1, self.status())

    def answer(self, asked: int) -> int:
        """The script's."""
        return self.ask("is true", asked)

    def status(self) -> int:
        """What it returns when the child is not ticked."""
        return self.spec.parameters[0]


class SkipUnlessUpdated(Precondition):
    """Asks for the entry, not a script."""

    def answer(self, asked: int) -> int:
        """Was the entry written since?"""
        return self.plan.scripts.is_new(self.number, asked)

    def status(self) -> int:
        """As it is called."""
        return SKIPPED


class WaitValueUpdate(SkipUnlessUpdated):
    """The same with another status."""

    def status(self) -> int:
        """As it is called."""
        return RUNNING


class Loop(Precondition):
    """Whether there is an item is free."""

    def rule(self, ticked: int) -> Returned:
        """RUNNING until the queue is empty or the child fails."""
        taken = self.circuit.either(self.child_runs(), self.answer(self.circuit.both(ticked, self.child_runs() ^ 1)))
        child = self.tick_child(self.circuit.both(ticked, taken))
        status = dict.fromkeys(STATUSES, FALSE)
        status[FAILURE] = child[FAILURE]
        status[RUNNING] = self.circuit.both(taken, child[FAILURE] ^ 1)
        return self.otherwise(status, taken ^ 1, self.status())


class Attributes(Decorator):
    """Preconditions decide; postconditions only write entries."""

    def answer(self, name: str, asked: int) -> int:
        """A script's that is run if `asked` holds; without one, nothing is true."""
        return FALSE if self.spec.scripts[ATTRIBUTES.index(name)] is None else self.ask(name, asked)

    def rule(self, ticked: int) -> Returned:
        """Asked in their order when the child is not RUNNING; _while in every tick."""
        both, runs = self.circuit.both, self.child_runs()
        rest = both(ticked, runs ^ 1)
        failed = both(rest, self.answer("_failureIf", rest))
        rest = both(rest, failed ^ 1)
        succeeded = both(rest, self.answer("_successIf", rest))
        rest = both(rest, succeeded ^ 1)
        skips = both(rest, self.answer("_skipIf", rest))
        rest = both(rest, skips ^ 1)
        runs = both(ticked, runs)
        has_while = self.spec.scripts[ATTRIBUTES.index("_while")] is not None
        holds = self.ask("_while", self.circuit.either(runs, rest)) if has_while else TRUE
        stopped = both(runs, holds ^ 1)
        skipped = self.circuit.any((skips, stopped, both(rest, holds ^ 1)))
        status = self.tick_child(both(self.circuit.either(runs, rest), holds))
        self.children[0].abandon(stopped)
        for condition, other in ((failed, FAILURE), (succeeded, SUCCESS), (skipped, SKIPPED)):
            status = self.otherwise(status, condition, other)
        self.complete(status)
        return status

    def complete(self, status: Returned) -> None:
        """The postconditions."""
        run = self.plan.scripts.run
        run(self.number, "_onSuccess", status[SUCCESS])
        run(self.number, "_onFailure", status[FAILURE])
        run(self.number, "_post", self.circuit.either(status[SUCCESS], status[FAILURE]))


class Switch(Cell):
    """The first case that matches, or the last child."""

    def rule(self, ticked: int) -> Returned:
        """The others are halted, and the child is reset when it is done."""
        cases = self.plan.scripts.cases(self.number, len(self.children) - 1)
        results = []
        for child, case in zip(self.children, [*cases, self.circuit.any(cases) ^ 1], strict=True):
            chosen = self.circuit.both(ticked, case)
            status = child.tick(chosen)
            results.append(status)
            other = self.circuit.all((ticked, chosen ^ 1, child.old[RUNNING]))
            child.abandon(self.circuit.either(other, self.circuit.both(chosen, status[RUNNING] ^ 1)))
        return {status: self.circuit.any(one[status] for one in results) for status in STATUSES}
