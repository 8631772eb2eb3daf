# SPDX-License-Identifier: MIT
"""The nodes that ask or run scripts: each class is a row of the tables in docs/semantics.md."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics.decorators import Decorator
from canopy.semantics.node import COMPLETED, Node, reached
from canopy.semantics.spec import ATTRIBUTES, FAILURE, RUNNING, SKIPPED, SUCCESS


class Script(Node):
    def tick_children(self) -> int:
        self.world.run(self.spec.scripts[0])
        return SUCCESS


class SetBlackboard(Script):
    pass


class ScriptCondition(Node):
    def tick_children(self) -> int:
        return SUCCESS if self.world.run(self.spec.scripts[0]) else FAILURE


class TestNode(Node):
    """Parameters: the status, and the time in ms. Its scripts are those of TEST_SCRIPTS."""

    def tick_children(self) -> int:
        status, milliseconds = self.spec.parameters
        if self.code != RUNNING:
            self.deadline = self.world.now + 1000 * milliseconds
        if not reached(self.world.now, self.deadline):
            return RUNNING
        on_success, on_failure, post = self.spec.scripts
        if status in COMPLETED:
            self.world.run(on_success if status == SUCCESS else on_failure)
        self.world.run(post)
        return status


class Precondition(Decorator):
    def tick_children(self) -> int:
        if self.child_runs() or self.world.run(self.spec.scripts[0]):
            return self.tick_child()
        return self.spec.parameters[0]


class Attributes(Decorator):
    """The pre- and postconditions of the node below, which has none of its own."""

    def run(self, name: str) -> bool:
        return self.world.run(self.spec.scripts[ATTRIBUTES.index(name)])

    def holds(self) -> bool:
        """Whether _while, if there is one, is true."""
        return self.spec.scripts[ATTRIBUTES.index("_while")] is None or self.run("_while")

    def precondition(self) -> int | None:
        """The status that a precondition gives; None when the node may be ticked."""
        if self.child_runs():
            if self.holds():
                return None
            self.reset_all()
            self.run("_onHalted")
            return SKIPPED
        return self.before_start()

    def before_start(self) -> int | None:
        """The status that a precondition gives when the node is not RUNNING."""
        if self.run("_failureIf"):
            return FAILURE
        if self.run("_successIf"):
            return SUCCESS
        return SKIPPED if self.run("_skipIf") or not self.holds() else None

    def tick_children(self) -> int:
        status = self.precondition()
        if status is None:
            status = self.tick_child()
        self.completed(status)
        return status

    def completed(self, status: int) -> None:
        """The postconditions."""
        if status in COMPLETED:
            self.run("_onSuccess" if status == SUCCESS else "_onFailure")
            self.run("_post")

    def on_halt(self) -> None:
        super().on_halt()
        self.run("_onHalted")


class EntryUpdated(Node):
    """What the three share that ask whether an entry has been written since they last asked."""

    seen = 0

    def is_new(self) -> bool:
        script = self.spec.scripts[0]
        assert script is not None
        seen, self.seen = self.seen, self.world.updates[script.entry]
        return seen != self.seen


class WasEntryUpdated(EntryUpdated):
    def tick_children(self) -> int:
        return SUCCESS if self.is_new() else FAILURE


class SkipUnlessUpdated(EntryUpdated, Decorator):
    otherwise: ClassVar[int] = SKIPPED

    def tick_children(self) -> int:
        if self.child_runs() or self.is_new():
            return self.tick_child()
        return self.otherwise


class WaitValueUpdate(SkipUnlessUpdated):
    otherwise = RUNNING


class Loop(Decorator):
    """One item a tick of the list 1 to `value`, from the first one whenever the node was not RUNNING."""

    taken = 0

    def starts(self) -> bool:
        return self.code != RUNNING

    def take(self) -> bool:
        script = self.spec.scripts[0]
        assert script is not None
        if self.starts():
            self.taken = 0
        if self.taken == script.value:
            return False
        self.taken += 1
        self.world.write(script.entry, self.taken)
        return True

    def tick_children(self) -> int:
        if not self.child_runs() and not self.take():
            return self.spec.parameters[0]
        return FAILURE if self.tick_child() == FAILURE else RUNNING


class Switch(Node):
    def case(self) -> int:
        """The child whose case matches: case k is the number k; the last child when there is none."""
        script = self.spec.scripts[0]
        assert script is not None
        value = self.world.entries[script.entry]
        return value if 0 <= value < len(self.children) else len(self.children) - 1

    def tick_children(self) -> int:
        child = self.children[self.case()]
        for other in self.children:
            if other is not child and other.code == RUNNING:
                other.reset()
        status = child.tick()
        if status != RUNNING:
            child.reset()
        return status
