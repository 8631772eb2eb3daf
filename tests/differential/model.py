# SPDX-License-Identifier: MIT
"""Runs the reference model, canopy.semantics, on a tree under test."""

from __future__ import annotations

from canopy.semantics import NODES, Node, World, build
from differential.tree import ENTRIES, Outcome, Result, Tree


class ModelTree:
    """A tree of the model. `nodes`: which class stands for which kind of node."""

    def __init__(self, tree: Tree, world: World | None = None, nodes: dict[str, type[Node]] = NODES) -> None:
        self.tree = tree
        self.world = world or World(len(ENTRIES))
        self.nodes = build(tree.root, self.world, nodes)
        self.root = self.nodes[0]

    def _outcome(self, status: int | None) -> Outcome:
        calls, self.world.calls = self.world.calls, []
        return Outcome(status, calls, bytes([node.code for node in self.nodes]), tuple(self.world.entries))

    def tick(self, number: int) -> Outcome:
        """Tick `number`, from 0. A tree that completed starts again with the next tick."""
        self.world.tick_number = number
        self.world.now = self.tree.times[number]
        return self._outcome(self.root.tick())

    def halt(self) -> Outcome:
        """Halts the whole tree: every RUNNING node once, deepest first; every node is IDLE afterwards."""
        self.root.reset()
        for node in self.nodes:
            node.reset()
        return self._outcome(None)


def run_model(tree: Tree, nodes: dict[str, type[Node]] = NODES) -> Result:
    """Runs the model over all ticks of a tree."""
    model = ModelTree(tree, nodes=nodes)
    outcomes = []
    for number in range(len(tree.times)):
        outcomes.append(model.tick(number))
        if tree.halt_after == number + 1:
            outcomes.append(model.halt())
    return Result(outcomes, model.world.faults, model.world.fault_node)
