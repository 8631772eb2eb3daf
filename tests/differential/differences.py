# SPDX-License-Identifier: MIT
"""BehaviorTree.CPP as this project knows it: the reference model, changed by nothing but the listed differences.

A class overrides exactly the place where BehaviorTree.CPP acts otherwise, and calls `differs` in the ticks in which
that changes what happens. A run of BehaviorTree.CPP is explained when this model gives the same; and up to the first
tick in which a rule fired, the engine has to give the same as BehaviorTree.CPP, too. docs/differential.md lists them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from differential import model
from differential.model import COMPLETED, ModelTree, Node, World
from differential.tree import ATTRIBUTES, FAILURE, IDLE, RUNNING, SKIPPED, Outcome, Spec, Tree

RULES: dict[str, str] = {
    "skipped condition": "IfThenElse and WhileDoElse throw when their condition is SKIPPED",
    "no else": "a two-child IfThenElse does not reset its condition after a FAILURE, nor ask a stateful one again",
    "while": "WhileDoElse does not ask a stateful condition again that has completed, until its branch is done",
    "keep running": "KeepRunningUntilFailure turns a SKIPPED child into RUNNING",
    "same tick": "Repeat and RetryUntilSuccessful begin the next cycle in the tick that ends an asynchronous one",
    "memory yields": "SequenceWithMemory yields after every child that completes in the tick it was started in",
    "skipped count": "a SKIPPED Repeat or RetryUntilSuccessful is RUNNING there, and loses its count at other times",
    "skipped action": "a RUNNING action that answers SKIPPED stays RUNNING there",
    "attributes": "preconditions are asked of what is IDLE there: not of a SKIPPED inner node, nor of an old condition",
    "precondition": "Precondition does not ask again after a SKIPPED child or a halt, until its child has completed",
    "loop goes on": "a Loop that was SKIPPED, or completed and was not reset, does not start its list again",
    "on halted": "halting the whole tree runs every _onHalted, also of nodes that are not RUNNING",
    "stale skips": "a Sequence or Fallback that completed and was not reset counts the children it skipped then",
}
"""The differences that change what happens. What only looks different is in shown.py."""


class ThrownError(Exception):
    """BehaviorTree.CPP throws an exception in this tick."""


class BtCppWorld(World):
    """Notes which rules fired in the tick under way."""

    def __init__(self) -> None:
        super().__init__()
        self.fired: set[str] = set()

    def differs(self, rule: str) -> None:
        assert rule in RULES
        self.fired.add(rule)


class BtCppNode(Node):
    """SKIPPED is not stored: a leaf stays what it was, and most inner nodes stay RUNNING."""

    world: BtCppWorld
    was_skipped = False
    runs_when_skipped: ClassVar[bool] = True

    def tick(self) -> int:
        status = self.tick_children()
        self.was_skipped = status == SKIPPED
        if status != SKIPPED:
            self.code = status
        elif self.children and self.runs_when_skipped:
            self.code = RUNNING
        return status

    def reset(self) -> None:
        if self.code == RUNNING:
            self.on_halt()
        self.code = IDLE

    def keeps_count(self, skipped: list[Node]) -> None:
        """The node does not reset these children."""
        if any(isinstance(node, Counting) and node.cycles for node in map(bare, skipped)):
            self.world.differs("skipped count")


def was_skipped(node: Node) -> bool:
    """Whether it answered SKIPPED the last time."""
    return isinstance(node, BtCppNode) and node.was_skipped


def bare(node: Node) -> Node:
    """The node itself, where Attributes stand above it."""
    return node.children[0] if isinstance(node, Attributes) else node


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


class AlwaysSuccess(BtCppNode, model.AlwaysSuccess):
    pass


class AlwaysFailure(BtCppNode, model.AlwaysFailure):
    pass


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


class Decorator(BtCppNode, model.Decorator):
    def child_runs(self) -> bool:
        return super().child_runs() and not was_skipped(self.children[0])

    def tick_child(self) -> int:
        status = self.children[0].tick()
        if status in COMPLETED:
            self.reset_all()
        elif status == SKIPPED:
            self.keeps_count(self.children)
        return status


class Inverter(Decorator, model.Inverter):
    pass


class ForceSuccess(Decorator, model.ForceSuccess):
    pass


class ForceFailure(Decorator, model.ForceFailure):
    pass


class Counting(Decorator, model.Counting):
    def tick_children(self) -> int:
        while True:
            asynchronous = self.children[0].code != IDLE
            cycles = self.cycles
            status = super().tick_children()
            if status == SKIPPED:
                self.reset_all()
            if not (asynchronous and self.cycles > cycles and status == RUNNING):
                return status
            self.world.differs("same tick")

    def on_halt(self) -> None:
        if self.was_skipped and self.cycles:
            self.world.differs("skipped count")
        super().on_halt()


class Repeat(Counting, model.Repeat):
    pass


class RetryUntilSuccessful(Counting, model.RetryUntilSuccessful):
    pass


class KeepRunningUntilFailure(Decorator, model.KeepRunningUntilFailure):
    def tick_children(self) -> int:
        status = super().tick_children()
        if status != SKIPPED:
            return status
        self.world.differs("keep running")
        return RUNNING


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
    """Gets its list when it starts from IDLE; where a precondition has answered for it before that, it has none."""

    has_list = False

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
        if child.code in COMPLETED or (child.code == RUNNING and was_skipped(child)):
            self.world.differs("attributes")
        status = None if child.code in COMPLETED else self.precondition()
        if status is None:
            status = child.tick()
        elif status in COMPLETED:
            child.code = status
        self.completed(status)
        self.code = child.code
        self.was_skipped = status == SKIPPED
        return status

    def reset(self) -> None:
        child = self.children[0]
        if child.code == RUNNING:
            if was_skipped(child):
                self.world.differs("attributes")
            self.halt_node()
        child.reset()
        self.code = IDLE

    def halt_node(self) -> None:
        self.children[0].reset()
        self.code = IDLE
        self.run("_onHalted")


class RunOnce(Decorator, model.RunOnce):
    def tick(self) -> int:
        before = self.code
        remembered = self.remembered is not None
        status = super().tick()
        if remembered and status == SKIPPED:
            self.code = before
        return status


NODES: dict[str, type[Node]] = {
    node.__name__: node
    for node in (
        Condition, SyncAction, StatefulAction, AlwaysSuccess, AlwaysFailure,
        Sequence, SequenceWithMemory, AsyncSequence, ReactiveSequence, Fallback, AsyncFallback, ReactiveFallback,
        Parallel, ParallelAll, IfThenElse, WhileDoElse,
        Inverter, ForceSuccess, ForceFailure, Repeat, RetryUntilSuccessful, KeepRunningUntilFailure, RunOnce,
        Script, ScriptCondition, SetBlackboard, Precondition, Attributes, Loop, Switch,
    )
}  # fmt: skip
"""The kinds of nodes that can be compared. It has no ReactiveParallel, and cannot be given a clock (Delay, Timeout,
Sleep); TryCatch is newer (4.9) than what behaviortreepy holds (4.8.2). SkipUnlessUpdated, WaitValueUpdate and
WasEntryUpdated forget there what they have seen when they are halted, and the first two do not halt their child."""


@dataclass
class Explained:
    """What BehaviorTree.CPP has to give, and which rules fired in which outcome (numbered as the outcomes)."""

    outcomes: list[Outcome]
    thrown: bool
    fired: list[set[str]]


class BtCppTree(ModelTree):
    """Halts every node when the whole tree is halted, RUNNING or not."""

    world: BtCppWorld

    def halt(self) -> Outcome:
        for node in (self.root, *self.nodes):
            if not isinstance(node, Attributes):
                node.reset()
                continue
            if node.spec.scripts[ATTRIBUTES.index("_onHalted")] is not None:
                self.world.differs("on halted")
            node.halt_node()
        return self._outcome(None)


def _shown_codes(differing: ModelTree) -> bytes:
    return bytes([IDLE if isinstance(node, Attributes) else node.code for node in differing.nodes])


def run_differing_model(tree: Tree) -> Explained:
    """Runs the reference model with BehaviorTree.CPP's differences, up to an exception."""
    world = BtCppWorld()
    differing = BtCppTree(tree, world, NODES)
    explained = Explained([], False, [])
    for number in range(len(tree.times)):
        try:
            outcome = differing.tick(number)
        except ThrownError:
            explained.fired.append(world.fired)
            explained.thrown = True
            return explained
        if outcome.status in COMPLETED:  # then BehaviorTree.CPP resets the root
            differing.root.code = IDLE
            bare(differing.root).code = IDLE
        explained.outcomes.append(outcome._replace(codes=_shown_codes(differing)))
        explained.fired.append(world.fired)
        world.fired = set()
        if tree.halt_after == number + 1:
            explained.outcomes.append(differing.halt()._replace(codes=_shown_codes(differing)))
            explained.fired.append(world.fired)
            world.fired = set()
    return explained


def _element(spec: Spec) -> Spec:
    """What the XML has in its place: Attributes are not an element, but stand on the one below."""
    while spec.kind == "Attributes":
        spec = spec.children[0]
    return spec


def can_load(tree: Tree) -> bool:
    """Whether BehaviorTree.CPP accepts the tree: a ReactiveSequence may have one child that is an AsyncSequence."""
    return all(
        spec.kind != "ReactiveSequence" or [_element(child).kind for child in spec.children].count("AsyncSequence") < 2
        for spec in tree.root.walk()
    )
