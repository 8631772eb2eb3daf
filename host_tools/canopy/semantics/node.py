# SPDX-License-Identifier: MIT
"""What holds for every node of the model, and what the nodes of one running tree share."""

from __future__ import annotations

from canopy.semantics.spec import COMPARISONS, FAILURE, IDLE, RUNNING, SUCCESS, WAS, Script, Spec

COMPLETED = (SUCCESS, FAILURE)
TIME_MASK = (1 << 64) - 1


class World:
    """What the nodes of one running tree share: the time, the log of the leaves' calls, and the entries of scripts."""

    def __init__(self, entries: int = 0) -> None:
        self.now = 0
        self.tick_number = 0
        self.calls: list[tuple[int, int]] = []
        self.faults = 0
        self.fault_node = 0xFFFF  # none yet
        self.entries = [0] * entries
        self.updates = [0] * entries

    def answer(self, node: Node, _kind: int) -> int:
        """What a leaf of the user's answers when it is called."""
        return node.spec.answers[self.tick_number]

    def write(self, entry: int, value: int) -> None:
        self.entries[entry] = value
        self.updates[entry] += 1

    def run(self, script: Script | None) -> bool:
        """Runs an assignment or asks a comparison; without a script, nothing is true."""
        if script is None:
            return False
        value = self.entries[script.entry]
        if script.operation in COMPARISONS:
            return value < script.value if script.operation == "<" else value == script.value
        self.write(script.entry, script.value + (value if script.operation == "+=" else 0))
        return True


def reached(now: int, deadline: int) -> bool:
    """Whether `deadline` is over, with times that wrap around at 64 bits."""
    return (now - deadline) & TIME_MASK < 1 << 63


class Node:
    """What holds for every node. `code` is its status, or WAS + the last one when it has been reset to IDLE."""

    def __init__(self, world: World, number: int, spec: Spec, children: list[Node]) -> None:
        self.world = world
        self.number = number
        self.spec = spec
        self.children = children
        self.code = IDLE
        self.begin()

    def begin(self) -> None:
        """Sets the node's memory to that of a node that starts anew."""

    def tick_children(self) -> int:
        """The node's row of the table: ticks children as it needs to, and gives the node's status."""
        raise NotImplementedError

    def tick(self) -> int:
        """Ticks the node and stores its status."""
        status = self.tick_children()
        self.code = status
        return status

    def on_halt(self) -> None:
        """What halting a RUNNING node does: its children are reset, the deepest first, and it starts anew."""
        self.reset_all()
        self.begin()

    def reset(self) -> None:
        """Makes the node IDLE, having halted it if it was RUNNING."""
        if self.code == RUNNING:
            self.on_halt()
        if IDLE < self.code < WAS:
            self.code += WAS

    def reset_all(self) -> None:
        """Halts the RUNNING children, and makes all children IDLE."""
        for child in self.children:
            child.reset()
