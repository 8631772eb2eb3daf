# SPDX-License-Identifier: MIT
"""What the circuits of all nodes share, and the leaves.

A tick goes down and up once: tick() gives a node's status from what its children return. What it abandons is said by
abandon(); settle() then goes down once more, halts and resets, and sets all memory. That is enough, since no node is
reset before it is ticked in the same tick: what a tick resets first is not ticked any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from canopy.semantics.spec import FAILURE, RUNNING, SKIPPED, SUCCESS, Spec
from canopy.verify.logic.board import Reads
from canopy.verify.logic.circuit import FALSE, TRUE, Circuit
from canopy.verify.logic.scripts import Scripts

STATUSES = (RUNNING, SUCCESS, FAILURE, SKIPPED)
Returned = dict[int, int]
"""For each status the literal that says: ticked, and returned it."""


@dataclass
class Plan:
    """What the cells of one tree share. `period_us`: length of a tick [µs]; None: a timer may end in any later tick."""

    circuit: Circuit
    scripts: Scripts
    returns: dict[int, tuple[int, ...]]
    """What each leaf may answer if it is called."""
    reads: dict[int, Reads] = field(default_factory=dict)
    period_us: int | None = None
    answers: dict[int, Returned] = field(default_factory=dict)
    """What each leaf answers."""


class Cell:
    """A node. `old`: its status before the tick, `now`: after it; in both IDLE is that none holds."""

    def __init__(self, plan: Plan, number: int, spec: Spec, children: Sequence[Cell]) -> None:
        self.plan = plan
        self.circuit = plan.circuit
        self.number = number
        self.spec = spec
        self.children = children
        self.old = {status: self.circuit.latch() for status in STATUSES}
        self.now: Returned = {}
        self.ticked = FALSE
        self.returned: Returned = dict.fromkeys(STATUSES, FALSE)
        self.reset = FALSE
        self.halted = FALSE
        self._memory: list[tuple[int, int, int, bool]] = []

    def rule(self, ticked: int) -> Returned:
        """The node's row of the table."""
        raise NotImplementedError

    def tick(self, ticked: int) -> Returned:
        """The node is ticked if the literal holds."""
        self.ticked = ticked
        result = self.rule(ticked)
        self.returned = {status: self.circuit.both(ticked, result.get(status, FALSE)) for status in STATUSES}
        return self.returned

    def remember(self, latch: int, value: int, start: int = FALSE, *, reset: bool = False) -> None:
        """Memory that a tick sets to `value`, and a halt to `start`; with `reset`, being reset does that, too."""
        self._memory.append((latch, value, start, reset))

    def abandon(self, condition: int) -> None:
        """The node is reset, after it was ticked or without, if the condition holds."""
        self.reset = self.circuit.either(self.reset, condition)

    def abandon_all(self, condition: int) -> None:
        """All children are."""
        for child in self.children:
            child.abandon(condition)

    def settle(self) -> None:
        """Halts, resets, and sets the memory."""
        choose, both = self.circuit.choose, self.circuit.both
        kept = {status: choose(self.ticked, self.returned[status], self.old[status]) for status in STATUSES}
        self.halted = both(self.reset, kept[RUNNING])
        self.now = {status: both(self.reset ^ 1, kept[status]) for status in STATUSES}
        for status in STATUSES:
            self.circuit.follow(self.old[status], self.now[status])
        self.abandon_all(self.halted)
        for latch, value, start, on_reset in self._memory:
            after = choose(self.ticked, value, latch)
            self.circuit.follow(latch, choose(self.reset if on_reset else self.halted, start, after))

    def ask(self, what: str, condition: int) -> int:
        """What a script says that is run if the condition holds."""
        return self.plan.scripts.ask(self.number, what, condition)

    def time_is_over(self, milliseconds: int, start: int) -> int:
        """Whether the time has passed since the tick in which `start` held; not to be asked before.

        It passes in every tick, also when the node is not ticked. In the tick of the start only 0 ms are over.
        """
        at_once = TRUE if milliseconds == 0 else FALSE
        if self.plan.period_us is None:
            return self.circuit.choose(start, at_once, self.plan.scripts.anything(self.number, "time is over"))
        ticks = -(-milliseconds * 1000 // self.plan.period_us)
        left = [self.circuit.latch() for _ in range(max(ticks - 1, 0).bit_length())]
        borrow = self.circuit.any(left)
        over = self.circuit.choose(start, at_once, borrow ^ 1)
        for place, bit in enumerate(left):
            flipped = self.circuit.choose(borrow, bit ^ 1, bit)
            borrow = self.circuit.both(borrow, bit ^ 1)
            first = TRUE if max(ticks - 1, 0) >> place & 1 else FALSE
            self.circuit.follow(bit, self.circuit.choose(start, first, flipped))
        return over


class UserLeaf(Cell):
    """Answers anything that it declares, and writes anything; while something it reads is stale it is not called."""

    def rule(self, ticked: int) -> Returned:
        """One or two inputs choose among the statuses."""
        chosen = self.chosen()
        reads = self.plan.reads.get(self.number)
        memory = self.plan.scripts.memory
        known = TRUE if reads is None or memory is None else memory.known(reads.messages, reads.signals)
        if memory is not None:
            memory.called(self.number, self.circuit.both(ticked, known))
        if reads is not None:
            chosen = {status: self.circuit.both(known, literal) for status, literal in chosen.items()}
            chosen[reads.stale] = self.circuit.either(chosen.get(reads.stale, FALSE), known ^ 1)
        self.plan.answers[self.number] = chosen
        return chosen

    def chosen(self) -> Returned:
        """What it answers when it is called."""
        allowed = self.plan.returns[self.number]
        chosen: Returned = {}
        rest = TRUE
        for status in allowed[:-1]:
            wanted = self.circuit.input()
            chosen[status] = self.circuit.both(rest, wanted)
            rest = self.circuit.both(rest, wanted ^ 1)
        chosen[allowed[-1]] = rest
        return chosen


class Constant(Cell):
    """AlwaysSuccess."""

    status = SUCCESS

    def rule(self, ticked: int) -> Returned:
        """Always the same."""
        return {self.status: TRUE}


class AlwaysFailure(Constant):
    """FAILURE."""

    status = FAILURE


class Sleep(Cell):
    """RUNNING until the time is over."""

    def rule(self, ticked: int) -> Returned:
        """Its clock starts when it was not RUNNING."""
        start = self.circuit.both(ticked, self.old[RUNNING] ^ 1)
        over = self.time_is_over(self.spec.parameters[0], start)
        return {SUCCESS: over, RUNNING: over ^ 1}


class Script(Constant):
    """Runs its script."""

    def rule(self, ticked: int) -> Returned:
        """Nothing can stop it: what reads a signal is a ScriptCondition here."""
        self.plan.scripts.run(self.number, "is true", ticked)
        return super().rule(ticked)


class ScriptCondition(Cell):
    """What a script says; whether it was run, of one that only writes."""

    def rule(self, ticked: int) -> Returned:
        """SUCCESS if the script is true."""
        yes = self.ask("is true", ticked)
        return {SUCCESS: yes, FAILURE: yes ^ 1}


class WasEntryUpdated(Cell):
    """Asks in each tick."""

    def rule(self, ticked: int) -> Returned:
        """SUCCESS if the entry was written since."""
        yes = self.plan.scripts.is_new(self.number, ticked)
        return {SUCCESS: yes, FAILURE: yes ^ 1}


class TestNode(Cell):
    """RUNNING until the time is over, then its scripts, and its status."""

    def rule(self, ticked: int) -> Returned:
        """Its clock starts when it was not RUNNING."""
        status, delay = self.spec.parameters
        start = self.circuit.both(ticked, self.old[RUNNING] ^ 1)
        over = self.time_is_over(delay, start)
        done = self.circuit.both(ticked, over)
        script = {SUCCESS: "success_script", FAILURE: "failure_script"}.get(status)
        if script is not None:
            self.plan.scripts.run(self.number, script, done)
        self.plan.scripts.run(self.number, "post_script", done)
        return {status: over, RUNNING: over ^ 1}
