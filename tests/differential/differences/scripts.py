# SPDX-License-Identifier: MIT
"""The nodes of BehaviorTree.CPP that ask or run scripts, where they differ."""

from __future__ import annotations

from canopy import semantics as model
from canopy.semantics import COMPLETED, Node
from canopy.semantics.spec import ATTRIBUTES, IDLE, RUNNING, SKIPPED
from differential.differences.decorators import Decorator
from differential.differences.node import BtCppNode, was_skipped


class Script(BtCppNode, model.Script):
    pass


class SetBlackboard(BtCppNode, model.SetBlackboard):
    pass


class ScriptCondition(BtCppNode, model.ScriptCondition):
    pass


class Precondition(Decorator, model.Precondition):
    """Once it has let its child be ticked, it does so until that has completed."""

    runs_when_skipped = False
    is_open = False

    def tick_children(self) -> int:
        holds = self.world.run(self.spec.scripts[0])
        if self.is_open and not holds and not self.child_runs():
            self.world.differs("precondition")
        if not self.is_open and not holds:
            return self.spec.parameters[0]
        status = self.tick_child()
        self.is_open = status not in COMPLETED
        return status


class Loop(Decorator, model.Loop):
    """Gets its list when it starts from IDLE, and forgets then that its child was RUNNING when it was halted.

    Where a precondition has answered for it before that, it has no list, or goes on with the old child.
    """

    has_list = False
    child_running = False

    def child_runs(self) -> bool:
        return self.child_running

    def tick_children(self) -> int:
        self.child_running = self.child_running and self.code != IDLE
        if self.child_running and self.code in COMPLETED:
            self.world.differs("loop goes on")
        return super().tick_children()

    def tick_child(self) -> int:
        status = super().tick_child()
        self.child_running = status == RUNNING
        return status

    def starts(self) -> bool:
        if self.code in COMPLETED or (self.code == RUNNING and self.was_skipped):
            self.world.differs("loop goes on")
        return self.code == IDLE

    def take(self) -> bool:
        self.has_list = self.starts() or self.has_list
        return self.has_list and super().take()


class Switch(BtCppNode, model.Switch):
    """Does not reset a child that was SKIPPED, until another one completes. This is only shown."""

    runs_when_skipped = False

    def begin(self) -> None:
        self.running: Node | None = None

    def tick_children(self) -> int:
        child = self.children[self.case()]
        if self.running is not None and self.running is not child:
            self.running.reset()
        status = child.tick()
        self.running = child if status == RUNNING else None
        if status == SKIPPED:
            self.keeps_count([child])
        if status in COMPLETED:
            self.reset_all()
        return status


class Attributes(BtCppNode, model.Attributes):
    """There no node of its own: what it has to say becomes the status of the node below."""

    def tick(self) -> int:
        child = self.children[0]
        expected = self.before_start()
        ran = child.code == RUNNING
        status = None if child.code in COMPLETED else self.precondition()
        if child.code in COMPLETED or (ran and was_skipped(child)):
            halted = ran and status is not None
            if status != expected or (halted and self.has_on_halted()):
                self.world.differs("attributes")
        if status is None:
            status = child.tick()
            if status == SKIPPED:
                self.keeps_count([child])
        elif status in COMPLETED:
            child.code = status
        self.completed(status)
        self.code = child.code
        self.was_skipped = status == SKIPPED
        return status

    def has_on_halted(self) -> bool:
        return self.spec.scripts[ATTRIBUTES.index("_onHalted")] is not None

    def reset(self) -> None:
        child = self.children[0]
        if child.code == RUNNING:
            if was_skipped(child) and self.has_on_halted():
                self.world.differs("attributes")
            self.halt()
        child.reset()
        self.code = IDLE

    def halt(self) -> None:
        child = self.children[0]
        assert isinstance(child, BtCppNode)
        child.halt()
        self.code = IDLE
        self.run("_onHalted")
