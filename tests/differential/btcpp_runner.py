# SPDX-License-Identifier: MIT
"""Runs trees in BehaviorTree.CPP: a process of its own, for its console logger takes the standard output.

That logger is the way to see the inner nodes, which behaviortreepy does not hand out: it writes every change of a
status at once, so what a tick wrote ends where the tick ends. (The file logger writes from a thread of its own, has no
mark between ticks, and loses what is queued when it is closed.)

Reads a pickled list of trees from the standard input, and writes a pickled list of (outcomes, what was thrown).
"""

from __future__ import annotations

import os
import pickle
import re
import sys
from collections.abc import Callable

import behaviortreepy as bt

from canopy.semantics.spec import CONTINUE, HALTED, IDLE, START, STATUS_NAMES, Spec
from differential.generate import NODES_MAX
from differential.tree import ENTRIES, SCRIPTED, SWITCHED, USER_LEAVES, Outcome, Tree, attributes, tag

Answer = Callable[[int, int], object]
_STATUSES = [getattr(bt.NodeStatus, name) for name in STATUS_NAMES]
_NUMBERS = {name.encode(): number for number, name in enumerate(STATUS_NAMES)}
_NOTHING_WRITTEN = (0,) * len(ENTRIES)
# The entry of Switches is declared a text by the tree under test, so only a script can make it the number 0.
_CLEAR = (
    f'<root BTCPP_format="4"><BehaviorTree ID="Clear"><Script code="{ENTRIES[SWITCHED]} := 0"/></BehaviorTree></root>'
)
_CHANGE = re.compile(rb"\]: (\d+) .*-> \x1b\[\d+m([A-Z]+)\x1b")


class Runner:
    """A factory whose leaves answer what the tree under way says."""

    def __init__(self, log: int) -> None:
        self.log = log
        self.calls: list[tuple[int, int]] = []
        self.answers: dict[int, bytes] = {}
        self.tick_number = 0
        self.blackboard: bt.Blackboard | None = None
        self.factory = bt.BehaviorTreeFactory()
        for number in range(NODES_MAX):
            start, go_on, halted = (self._function(number, kind) for kind in (START, CONTINUE, HALTED))
            self.factory.register_simple_condition(f"Condition{number}", start)
            self.factory.register_simple_action(f"SyncAction{number}", start)
            self.factory.register_simple_stateful_action(f"StatefulAction{number}", start, go_on, halted)

    def _function(self, number: int, kind: int) -> Callable[[object], object]:
        def called(_node: object) -> object:
            self.calls.append((number, kind))
            return _STATUSES[self.answers[number][self.tick_number]]

        return called

    def _xml(self, tree: Tree) -> str:
        parts = ['<root BTCPP_format="4"><BehaviorTree ID="Differential">']
        self.answers = {}
        count = 0

        def add(spec: Spec, above: str = "") -> None:
            nonlocal count
            number = count
            count += 1
            if spec.kind == "Attributes":
                add(spec.children[0], attributes(spec))
                return
            name = tag(spec)
            if name in USER_LEAVES:
                name += str(number)
                self.answers[number] = spec.answers
            parts.append(f'<{name} name="{number}"{attributes(spec)}{above}>')
            for child in spec.children:
                add(child)
            parts.append(f"</{name}>")

        add(tree.root)
        self.codes = bytearray([IDLE] * count)
        return "".join([*parts, "</BehaviorTree></root>"])

    def _outcome(self, status: int | None) -> Outcome:
        size = os.lseek(self.log, 0, os.SEEK_CUR)
        for name, now in _CHANGE.findall(os.pread(self.log, size, 0)):
            self.codes[int(name)] = _NUMBERS[now]
        os.ftruncate(self.log, 0)
        os.lseek(self.log, 0, os.SEEK_SET)
        calls, self.calls = self.calls, []
        entries = tuple(map(self.blackboard.get_int, ENTRIES)) if self.blackboard else _NOTHING_WRITTEN
        return Outcome(status, calls, bytes(self.codes), entries)

    def _create(self, tree: Tree) -> bt.Tree:
        self.blackboard = None
        if not tree.kinds() & SCRIPTED:
            return self.factory.create_tree_from_text(self._xml(tree))
        self.blackboard = bt.Blackboard.create()
        for name in ENTRIES[:SWITCHED]:
            self.blackboard.set_int(name, 0)
        running = self.factory.create_tree_from_text(self._xml(tree), self.blackboard)
        self.factory.create_tree_from_text(_CLEAR, self.blackboard).tick_exactly_once()
        return running

    def run(self, tree: Tree) -> tuple[list[Outcome], str]:
        """The outcomes of one tree, up to an exception, and what the exception said."""
        running = self._create(tree)
        logger = bt.StdCoutLogger(running)
        outcomes: list[Outcome] = []
        thrown = ""
        for self.tick_number in range(len(tree.times)):
            try:
                status = running.tick_exactly_once()
            except RuntimeError as error:
                thrown = str(error)
                self._outcome(None)
                break
            outcomes.append(self._outcome(int(status)))
            if tree.halt_after == self.tick_number + 1:
                running.halt_tree()
                outcomes.append(self._outcome(None))
        del logger, running  # in this order: the logger listens to the tree
        self._outcome(None)
        return outcomes, thrown


def main() -> None:
    """Runs the trees of the standard input."""
    trees: list[Tree] = pickle.load(sys.stdin.buffer)
    log = os.memfd_create("log")
    answer_to = os.dup(1)
    os.dup2(log, 1)
    runner = Runner(log)
    results = [runner.run(tree) for tree in trees]
    with os.fdopen(answer_to, "wb") as output:
        pickle.dump(results, output)


if __name__ == "__main__":
    main()
