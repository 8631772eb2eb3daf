# SPDX-License-Identifier: MIT
"""Runs the differing model: what BehaviorTree.CPP has to give."""

from __future__ import annotations

from dataclasses import dataclass

from canopy.semantics import COMPLETED
from canopy.semantics.spec import IDLE, RUNNING
from differential.differences.node import BtCppNode, bare, was_skipped
from differential.differences.nodes import NODES
from differential.differences.rules import BtCppWorld, ThrownError
from differential.differences.scripts import Attributes
from differential.model import ModelTree
from differential.tree import Outcome, Tree


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
        assert isinstance(self.root, BtCppNode)
        root_runs = self.root.code == RUNNING and not was_skipped(self.root)
        expected = list(self.world.entries)
        self.root.halt()
        if root_runs:
            expected = list(self.world.entries)
        for node in self.nodes:
            assert isinstance(node, BtCppNode)
            node.halt()
        if self.world.entries != expected:
            self.world.differs("on halted")
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
