# SPDX-License-Identifier: MIT
"""What holds for every node of BehaviorTree.CPP."""

from __future__ import annotations

from typing import ClassVar

from canopy.semantics import Node
from canopy.semantics.spec import IDLE, RUNNING, SKIPPED
from differential.differences.rules import BtCppWorld


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

    def halt(self) -> None:
        """Halts it, RUNNING or not: with the whole tree, all nodes are halted there."""
        self.on_halt()
        self.code = IDLE

    def keeps_count(self, skipped: list[Node]) -> None:
        """The node does not reset these children, which ours does."""
        for node in map(bare, skipped):
            if isinstance(node, BtCppNode):
                node.keep_count()

    def keep_count(self) -> None:
        """A Repeat or RetryUntilSuccessful goes on with its count when it is ticked the next time."""

    def has_count(self) -> bool:
        """Whether it is a Repeat or RetryUntilSuccessful that would lose its count if it were halted."""
        return False


def was_skipped(node: Node) -> bool:
    """Whether it answered SKIPPED the last time."""
    return isinstance(node, BtCppNode) and node.was_skipped


def bare(node: Node) -> Node:
    """The node itself, where Attributes stand above it."""
    return node.children[0] if node.spec.kind == "Attributes" else node
