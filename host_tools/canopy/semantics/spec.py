# SPDX-License-Identifier: MIT
"""What a tree of the reference model is made of: nodes, and the scripts that they ask; and the words for statuses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

IDLE, RUNNING, SUCCESS, FAILURE, SKIPPED = range(5)
STATUS_NAMES = ("IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED")
WAS = 8
"""CANOPY_STATUS_WAS: in a status code, the node is IDLE and the low bits keep what it was."""

START, CONTINUE, HALTED = range(3)
CALL_NAMES = ("start", "running", "halted")
"""Kinds of leaf calls: the one function of a Condition or SyncAction, or on_start; on_running; on_halted."""

ATTRIBUTES = ("_failureIf", "_successIf", "_skipIf", "_while", "_onSuccess", "_onFailure", "_post", "_onHalted")

TEST_SCRIPTS = ("success_script", "failure_script", "post_script")

COMPARISONS = ("<", "==")


class Script(NamedTuple):
    """One script: an operation on one of the world's entries. What operations there are, World.run() says."""

    operation: str
    entry: int
    value: int = 0


@dataclass
class Spec:
    """A node with what is below it. `answers`: what a leaf of the user's answers, one byte a tick.

    The pre- and postconditions of a node are a node above it, Attributes, as in the engine.
    """

    kind: str
    children: list[Spec]
    parameters: tuple[int, ...] = ()
    answers: bytes = b""
    scripts: tuple[Script | None, ...] = ()

    def walk(self) -> Iterator[Spec]:
        """This node and all below it, depth first."""
        yield self
        for child in self.children:
            yield from child.walk()

    def depth(self) -> int:
        """Number of levels."""
        return 1 + max((child.depth() for child in self.children), default=0)
