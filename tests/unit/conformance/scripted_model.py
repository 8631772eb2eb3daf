# SPDX-License-Identifier: MIT
"""The nodes that have scripts, the built-in leaves, and nodes of the user's own, as docs/semantics.md describes them.

Like model.py written from the text alone.
"""

from __future__ import annotations

from unit.conformance.model import Delay
from unit.conformance.node import Node

STATUS_OF_NUMBER = {1: "R", 2: "S", 3: "F", 4: "K"}


class Precondition(Node):
    """Parameters: if, else."""

    def on_tick(self) -> str:
        """Ask while the child is not RUNNING."""
        if self.child_status[0] != "R" and not self.parameter(0):
            return STATUS_OF_NUMBER[self.parameter(1)]
        return self.run(0)


class Attributes(Node):
    """Parameters: _failureIf, _successIf, _skipIf, _while, _onSuccess, _onFailure, _post, _onHalted."""

    def holds(self, which: int) -> bool:
        """The attribute is given, and true."""
        return bool(self.run_script(which))

    def on_tick(self) -> str:
        """The preconditions, the child, the postconditions."""
        status = self.status_before_post()
        if status in "SF":
            self.run_script(4 if status == "S" else 5)
            self.run_script(6)
        return status

    def status_before_post(self) -> str:
        """What the preconditions say, or the child."""
        was_running = self.child_status[0] == "R"
        if not was_running:
            for which, status in enumerate("FSK"):
                if self.holds(which):
                    return status
        if self.parameters[3] != -1 and not self.holds(3):
            self.reset_child(0)
            if was_running:
                self.on_halt()
            return "K"
        return self.run(0)

    def on_halt(self) -> None:
        """A SKIPPED node is not halted."""
        if self.status == "R":
            self.run_script(7)

    def state(self) -> tuple[object, ...]:
        """Preconditions are asked anew whenever it is not RUNNING."""
        return self.running()


class SkipUnlessUpdated(Node):
    """Parameter: the entry's update counter."""

    not_updated = "K"

    def forget(self) -> None:
        """Nothing has been seen."""
        self.seen = 0

    def on_halt(self) -> None:
        """A halt does not forget it."""

    def memory(self) -> tuple[object, ...]:
        """The counter when the child was last started."""
        return (self.seen,)

    def on_tick(self) -> str:
        """A RUNNING child is ticked in any case."""
        if self.child_status[0] != "R":
            updates = self.parameter(0)
            if updates == self.seen:
                return self.not_updated
            self.seen = updates
        return self.run(0)


class WaitValueUpdate(SkipUnlessUpdated):
    """RUNNING instead of SKIPPED."""

    not_updated = "R"


class WasEntryUpdated(SkipUnlessUpdated):
    """A leaf."""

    def on_tick(self) -> str:
        """Compare and remember."""
        updates = self.parameter(0)
        status = "F" if updates == self.seen else "S"
        self.seen = updates
        return status


class Loop(Node):
    """Parameters: queue, if_empty."""

    def on_tick(self) -> str:
        """One item a tick; a RUNNING child keeps its item."""
        if self.child_status[0] != "R" and not self.parameter(0):
            return STATUS_OF_NUMBER[self.parameter(1)]
        status = self.run(0)
        if status == "F":
            return "F"
        if status != "R":
            self.reset_child(0)
        return "R"


class Switch(Node):
    """Parameter: variable, which gives the place of the case."""

    def on_tick(self) -> str:
        """The last child is the default."""
        case = self.parameter(0)
        child = case if 0 <= case < self.children else self.children - 1
        self.others_running(child)
        return self.run(child)

    def state(self) -> tuple[object, ...]:
        """The variable is asked anew in every tick."""
        return self.running()


class AlwaysSuccess(Node):
    """A leaf."""

    def on_tick(self) -> str:
        """Always."""
        return "S"


class AlwaysFailure(Node):
    """A leaf."""

    def on_tick(self) -> str:
        """Always."""
        return "F"


class Sleep(Delay):
    """A leaf. Parameter: msec."""

    time_at = 0

    def on_tick(self) -> str:
        """Wait."""
        if self.left is None:
            self.left = self.parameter(self.time_at)
        if self.left > 0:
            return "R"
        self.left = None
        return self.when_over()

    def when_over(self) -> str:
        """What follows the time."""
        return "S"


class TestNode(Sleep):
    """A leaf. Parameters: return_status, async_delay, success_script, failure_script, post_script."""

    time_at = 1

    def when_over(self) -> str:
        """The script for the status, the post_script, the status."""
        status = STATUS_OF_NUMBER[self.parameter(0)]
        if status in "SF":
            self.run_script(2 if status == "S" else 3)
        self.run_script(4)
        return status


class Control(Node):
    """A control node of the user's own. Parameters: what its functions enter, child and halt may answer."""

    script_letters = "ECH"

    def on_tick(self) -> str:
        """Only own children, each one later than the one before: else a fault."""
        step = self.run_script(0, "'" if self.status == "R" else "")
        last = 0
        while isinstance(step, int) and last < step <= self.children:
            last = step
            self.run(step - 1)
            step = self.run_script(1)
            if step == "N":
                step = last + 1 if last < self.children else "R"
        if isinstance(step, int) or step not in "SFRK":
            self.fault = True
            return "F"
        return step

    def on_halt(self) -> None:
        """Its function halt, when it is RUNNING."""
        if self.status == "R":
            self.run_script(2)

    def state(self) -> tuple[object, ...]:
        """Whether it is RUNNING, and which children are."""
        return (self.status == "R", *self.running())


class Decorator(Control):
    """The same, with one child."""
