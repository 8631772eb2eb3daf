# SPDX-License-Identifier: MIT
"""A tree as a finite state machine: the paper's Figs. 8 to 11.

Each leaf is a state with three ways out: SUCCESS, FAILURE, RUNNING. A way leads to the leaf that is ticked next in the
same tick, or back to the tick source with the root's status. Between ticks the machine keeps which leaf is RUNNING.

This is for trees of memoryless nodes: there a leaf's answer alone says what is next. What has a memory of its own is
rejected by name.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from canopy.check.facts import Facts
from canopy.check.status_sets import K
from canopy.compiler.errors import CompileError
from canopy.compiler.names import snake
from canopy.compiler.tree import Node, Tree
from canopy.convert.equivalence import Answers, Shown, State
from canopy.convert.read_back import MAX_DEPTH, leaf_key, name_of, statuses_of
from canopy.semantics.spec import CONTINUE, FAILURE, HALTED, RUNNING, START, SUCCESS

USER_LEAVES = ("Condition", "SyncAction", "StatefulAction")


@dataclass(frozen=True)
class Jump:
    """What follows an answer.

    What is RUNNING in `halts` (a range of leaves: first, past the last) is halted; then leaf `target` is ticked, or, if
    that is None, the tick is done with `status`.
    """

    halts: tuple[int, int]
    target: int | None
    status: int = 0

    def halting(self, first: int, end: int) -> Jump:
        """The same, and what is RUNNING among the leaves first to end is halted, too."""
        if self.halts[0] == self.halts[1]:
            return Jump((first, end), self.target, self.status)
        return Jump((min(first, self.halts[0]), max(end, self.halts[1])), self.target, self.status)


@dataclass
class Vertex:
    """A state: a leaf's name and ID as a word, the statuses it can return, and what follows each."""

    name: str
    id: str
    key: object
    statuses: tuple[int, ...]
    is_action: bool
    jumps: dict[int, Jump] = field(default_factory=dict)


@dataclass
class Group:
    """A control node or decorator around the states of leaves: what is in it, in order."""

    name: str
    parts: list[Group | int]


@dataclass
class Machine:
    """The state machine of a tree."""

    name: str
    vertices: list[Vertex]
    begin: Jump
    group: Group


class _Builder:
    def __init__(self, tree: Tree) -> None:
        self._facts = Facts(tree)
        self.vertices: list[Vertex] = []
        self._ranges: dict[int, tuple[int, int]] = {}
        self._place(tree.root, 1)
        count = len(self.vertices)
        self.group = self._group(tree.root)
        done = {status: Jump((0, 0), None, status) for status in (SUCCESS, FAILURE)}
        self._end = count
        self.begin = self._enter(tree.root, done[SUCCESS], done[FAILURE])

    def _place(self, node: Node, depth: int) -> None:
        """Numbers the leaves, and refuses what has no such machine."""
        if depth > MAX_DEPTH:
            raise CompileError(node.place, f"a tree of more than {MAX_DEPTH} levels is not supported here")
        first = len(self.vertices)
        kind = node.type.name
        if K in self._facts.statuses(node):
            raise CompileError(
                node.place,
                f"<{node.xml_name or node.name}> can be SKIPPED, which a state machine has no way out for",
                "let it return SUCCESS or FAILURE",
            )
        if kind == "WhileDoElse" and any(n.type.name == "StatefulAction" for n in self._facts.below(node.children[0])):
            raise CompileError(node.children[0].place, "a condition of <WhileDoElse> that can be RUNNING has a memory")
        if node.leaf is not None and kind in USER_LEAVES:
            statuses = statuses_of(kind)
            name = name_of(node)
            word = self._word(node)
            key = (leaf_key(node), self._facts.nodes.index(node))
            is_pure = kind == "Condition" and node.leaf.state is None and not any(b.target for b in node.bound)
            self.vertices.append(Vertex(name, word, leaf_key(node) if is_pure else key, statuses, not is_pure))
        elif kind not in (*_WAYS, "AlwaysSuccess", "AlwaysFailure") or node.script is not None:
            raise CompileError(
                node.place,
                f"<{node.xml_name or kind}> cannot become states: it has a memory or a script, or several run at once",
                f"what can be converted: {', '.join(_WAYS)}, and your leaves",
            )
        for child in node.children:
            self._place(child, depth + 1)
        self._ranges[id(node)] = (first, len(self.vertices))

    def _word(self, node: Node) -> str:
        word = re.sub(r"\W", "_", node.leaf.id if node.leaf is not None else node.type.name, flags=re.ASCII)
        used = {snake(vertex.id) for vertex in self.vertices}
        number = 2
        candidate = word
        while snake(candidate) in used:
            candidate, number = f"{word}_{number}", number + 1
        return candidate

    def _group(self, node: Node) -> Group:
        parts: list[Group | int] = []
        for child in node.children or [node]:
            first, end = self._ranges[id(child)]
            if child.children:
                parts.append(self._group(child))
            elif first < end:
                parts.append(first)
        return Group(node.name, parts)

    def _enter(self, node: Node, success: Jump, failure: Jump) -> Jump:
        """Where control goes when the node is ticked; `success` and `failure`: what its parent does then."""
        first, end = self._ranges[id(node)]
        kind = node.type.name
        if kind in ("AlwaysSuccess", "AlwaysFailure"):
            return success if kind == "AlwaysSuccess" else failure
        if not node.children:
            running = Jump((end, self._end), None, RUNNING)
            ways = {SUCCESS: success, FAILURE: failure, RUNNING: running}
            self.vertices[first].jumps = {status: ways[status] for status in self.vertices[first].statuses}
            return Jump((0, 0), first)
        return _WAYS[kind](self, node, self._halting(success, node), self._halting(failure, node))

    def _halting(self, jump: Jump, node: Node) -> Jump:
        """The jump, and what is RUNNING below the node is halted, too.

        A node below which nothing can be RUNNING adds nothing: so all ranges of a jump lie in each other, and their
        hull has no other leaf in it.
        """
        first, end = self._ranges[id(node)]
        can_run = any(RUNNING in vertex.statuses for vertex in self.vertices[first:end])
        return jump.halting(first, end) if can_run else jump

    def in_order(self, node: Node, success: Jump, failure: Jump) -> Jump:
        """ReactiveSequence and ReactiveFallback."""
        goes_on = node.type.name == "ReactiveSequence"
        follows = success if goes_on else failure
        for child in reversed(node.children):
            follows = self._enter(child, follows, failure) if goes_on else self._enter(child, success, follows)
        return follows

    def while_do_else(self, node: Node, success: Jump, failure: Jump) -> Jump:
        """WhileDoElse: the branch that is not taken is halted."""
        yes = self._enter(node.children[1], success, failure)
        no = self._enter(node.children[2], success, failure) if len(node.children) == 3 else failure
        if len(node.children) == 3:
            yes = self._halting(yes, node.children[2])
        return self._enter(node.children[0], yes, self._halting(no, node.children[1]))

    def inverter(self, node: Node, success: Jump, failure: Jump) -> Jump:
        """Inverter."""
        return self._enter(node.children[0], failure, success)

    def force_success(self, node: Node, success: Jump, _failure: Jump) -> Jump:
        """ForceSuccess."""
        return self._enter(node.children[0], success, success)

    def force_failure(self, node: Node, _success: Jump, failure: Jump) -> Jump:
        """ForceFailure."""
        return self._enter(node.children[0], failure, failure)

    def keep_running(self, node: Node, _success: Jump, failure: Jump) -> Jump:
        """KeepRunningUntilFailure."""
        first, _ = self._ranges[id(node)]
        return self._enter(node.children[0], Jump((first, self._end), None, RUNNING), failure)


_WAYS = {
    "ReactiveSequence": _Builder.in_order,
    "ReactiveFallback": _Builder.in_order,
    "WhileDoElse": _Builder.while_do_else,
    "Inverter": _Builder.inverter,
    "ForceSuccess": _Builder.force_success,
    "ForceFailure": _Builder.force_failure,
    "KeepRunningUntilFailure": _Builder.keep_running,
}


def to_machine(tree: Tree) -> Machine:
    """The state machine of a tree.

    Raises:
        CompileError: a node has a memory of its own, is a script, or can be SKIPPED.
    """
    builder = _Builder(tree)
    return Machine(tree.id, builder.vertices, builder.begin, builder.group)


class TableMachine:
    """A state machine of leaves, ticked. Its state: which leaf is RUNNING."""

    def __init__(self, vertices: Sequence[Vertex], begin: Jump) -> None:
        self._vertices = vertices
        self._begin = begin

    def start(self) -> State:
        """No leaf is RUNNING."""
        return None

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """One tick."""
        running = state
        started: int | None = None
        calls: list[tuple[object, int]] = []
        jump = self._begin
        while True:
            if isinstance(running, int) and jump.halts[0] <= running < jump.halts[1]:
                calls.append((self._vertices[running].key, HALTED))
                running = None
            if jump.target is None:
                return running if started is None else started, (jump.status, tuple(calls))
            vertex = self._vertices[jump.target]
            if vertex.is_action:
                calls.append((vertex.key, CONTINUE if running == jump.target else START))
            if running == jump.target:
                running = None
            status = answers.ask(vertex.key, vertex.statuses)
            if status == RUNNING:
                started = jump.target
            jump = vertex.jumps[status]
