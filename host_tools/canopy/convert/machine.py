# SPDX-License-Identifier: MIT
"""A tree as a machine that can be put into any state and ticked: the reference model, whose leaves ask the world."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from canopy.convert.equivalence import Answers, AnythingGoes, Key, Shown, State
from canopy.semantics import Node, World, build
from canopy.semantics.spec import HALTED, IDLE, RUNNING, Script, Spec

Program = Callable[["AskingWorld"], Fraction]
"""A script that can be run: gives the value of its last expression."""

_FIXED = ("world", "number", "spec", "children")


@dataclass(frozen=True)
class Use:
    """A node that is a leaf of the user's. Uses with one `key` give one answer a tick.

    `pure`: it only reads, so nobody can tell how often it was asked. `statuses`: those that it can return.
    """

    name: str
    key: Key
    statuses: tuple[int, ...]
    pure: bool


@dataclass(frozen=True)
class SignalInput:
    """A signal of the bus, and the raw values that are tried: physical value = raw * scale + offset."""

    scale: Fraction
    offset: Fraction
    raws: tuple[int, ...]

    def physical(self, raw: int) -> Fraction:
        """The physical value, exactly."""
        return raw * self.scale + self.offset


@dataclass
class RunnableTree:
    """A tree of the reference model, what its leaves are (by number of the node), and its scripts."""

    root: Spec
    uses: dict[int, Use]
    programs: list[Program] = field(default_factory=list)
    entries: tuple[str, ...] = ()
    signals: dict[str, SignalInput] = field(default_factory=dict)


class AskingWorld(World):
    """A world whose leaves and signals answer what a comparison wants to try."""

    def __init__(self, tree: RunnableTree, decide: Callable[[Use, Answers], int]) -> None:
        super().__init__(len(tree.entries))
        self.tree = tree
        self._decide = decide
        self.answers = Answers(AnythingGoes())

    def answer(self, node: Node, _kind: int) -> int:
        """What the comparison wants."""
        return self._decide(self.tree.uses[node.number], self.answers)

    def run(self, script: Script | None) -> bool:
        """Runs a script of the tree; `entry` is its number."""
        return script is not None and self.tree.programs[script.entry](self) != 0

    def signal(self, name: str) -> Fraction:
        """A signal's physical value in this tick."""
        known = self.tree.signals[name]
        return known.physical(self.answers.ask(name, known.raws))

    def fresh(self, message: str) -> bool:
        """Is the message fresh in this tick?"""
        return bool(self.answers.ask(f"{message}.fresh", (1, 0)))


def ask_each(use: Use, answers: Answers) -> int:
    """Every leaf answers for itself, as it likes."""
    return answers.ask(use.key, use.statuses)


WORK = 5_000_000
"""Nodes that are put into a state in one comparison, some ten seconds."""


def affordable(limit: int, tree: RunnableTree) -> int:
    """As many cases as asked for, or fewer where the tree is so large that each takes long."""
    return min(limit, max(1_000, WORK // sum(1 for _ in tree.root.walk())))


def _frozen(value: object) -> Hashable:
    return tuple(sorted(value.items())) if isinstance(value, dict) else value


class TreeMachine:
    """A tree as a Machine.

    `show` makes of a tick's status and its leaves' calls what an observer sees; `decide` says what a leaf answers.
    `part`: it is a part of a tree, and what is above may halt it instead of ticking it.
    """

    def __init__(
        self,
        tree: RunnableTree,
        show: Callable[[int, Sequence[tuple[Use, int]]], Shown],
        decide: Callable[[Use, Answers], int] = ask_each,
        *,
        part: bool = False,
    ) -> None:
        self.tree = tree
        self._show = show
        self._part = part
        self._world = AskingWorld(tree, decide)
        self._nodes = build(tree.root, self._world)
        self._fixed = [{name: vars(node)[name] for name in _FIXED} for node in self._nodes]
        self._first = self._save()

    def start(self) -> State:
        """The state before the first tick."""
        return self._first

    def _save(self) -> State:
        """The memory of all nodes and entries. Of a status only RUNNING matters to what comes."""
        memory = []
        for node in self._nodes:
            if node.code != RUNNING:
                node.code = IDLE
            memory.append(tuple((k, _frozen(v)) for k, v in sorted(vars(node).items()) if k not in _FIXED))
        return tuple(memory), tuple(self._world.entries)

    def _load(self, state: State) -> None:
        memory, entries = state
        for node, fixed, saved in zip(self._nodes, self._fixed, memory, strict=True):
            vars(node).clear()
            vars(node).update(fixed)
            vars(node).update({name: dict(value) if isinstance(value, tuple) else value for name, value in saved})
        self._world.entries = list(entries)

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """One tick."""
        self._load(state)
        self._world.answers = answers
        self._world.calls.clear()
        if self._part and self._nodes[0].code == RUNNING and answers.ask("halted from above", (0, 1)):
            self._nodes[0].reset()
            status = IDLE
        else:
            status = self._nodes[0].tick()
        calls = [(self.tree.uses[number], kind) for number, kind in self._world.calls if number in self.tree.uses]
        shown = self._show(status, calls)
        return self._save(), shown


def show_calls(status: int, calls: Sequence[tuple[Use, int]]) -> Shown:
    """Everything that matters: the root's status, and each call of a leaf that acts, in order."""
    return status, tuple((use.key, kind) for use, kind in calls if not use.pure)


def show_acting(status: int, calls: Sequence[tuple[Use, int]]) -> Shown:
    """The paper's r and f: the root's status, and which leaves act, whichever use of theirs it is."""
    return status, tuple(use.name for use, kind in calls if not use.pure and kind != HALTED)
