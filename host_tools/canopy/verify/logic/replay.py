# SPDX-License-Identifier: MIT
"""Runs a circuit's trace in the reference model: the same answers of leaves, scripts and timers, tick by tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, SupportsIndex

from canopy.semantics import EntryUpdated, Loop, Node, Switch, World, build
from canopy.semantics.spec import ATTRIBUTES, IDLE, RUNNING, TEST_SCRIPTS, WAS, Script, Spec
from canopy.verify.logic.board import Fact
from canopy.verify.logic.encode import Encoding
from canopy.verify.logic.memory import Key
from canopy.verify.logic.runner import Runner

EMPTY, MORE = 0, 1 << 30
TIMED = ("Sleep", "Delay", "Timeout", "TestNode")


@dataclass(frozen=True)
class Moment:
    """What one tick did to a node: its status after it, what it returned in it (IDLE: not ticked), was it halted."""

    code: int
    returned: int
    halted: bool


@dataclass(frozen=True)
class Inputs:
    """What one tick of a trace is given: the answer of each leaf, and of what is free, by node and what is asked.

    `bits`, `numbers`: what messages are fresh, what signals are, what leaves write (memory.Key).
    """

    answers: Mapping[int, int]
    free: Mapping[tuple[int, str], bool]
    bits: Mapping[Key, bool] = field(default_factory=dict)
    numbers: Mapping[Key, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Shot:
    """What one tick did: to each node, and to each entry, in steps; and which facts of the formula are true after it.

    Of open entries nothing is known: they have 0 here.
    """

    moments: tuple[Moment, ...]
    facts: tuple[bool, ...] = ()
    entries: tuple[int, ...] = ()


def from_circuit(encoding: Encoding, ticks: list[dict[int, bool]]) -> tuple[list[Inputs], list[Shot]]:
    """Simulates the circuit: what its inputs mean, and what nodes and entries do, per tick."""
    state: dict[int, bool] = {}
    inputs, shots = [], []
    scripts, memory = encoding.scripts, encoding.scripts.memory
    for given in ticks:
        state, values = encoding.circuit.step(state, given)

        def holds(literal: int, values: list[bool] = values) -> bool:
            return values[literal >> 1] ^ bool(literal & 1)

        def only(statuses: Mapping[int, int], holds: Callable[[int], bool] = holds) -> int:
            found = [status for status, literal in statuses.items() if holds(literal)]
            assert len(found) <= 1, "a node has one status"
            return found[0] if found else IDLE

        inputs.append(
            Inputs(
                {number: only(chosen) for number, chosen in encoding.plan.answers.items()},
                {key: holds(literal) for key, literal in scripts.free.items()},
                {key: holds(literal) for key, literal in memory.bits.items()} if memory is not None else {},
                {key: word.value(holds) for key, word in memory.numbers.items()} if memory is not None else {},
            )
        )
        moments = tuple(Moment(only(c.now), only(c.returned), holds(c.halted)) for c in encoding.cells)
        entries = tuple(0 if word is None else word.value(holds) for word in memory.held()) if memory else ()
        shots.append(Shot(moments, tuple(holds(literal) for literal in encoding.told), entries))
    return inputs, shots


class _Updates(list[int]):
    """How often the entry of a node was written: as the runner knows, or as the trace says."""

    def __init__(self, count: int, runner: Runner | None) -> None:
        super().__init__([0] * count)
        self._runner = runner

    def __getitem__(self, node: SupportsIndex | slice) -> Any:
        known = self._runner.updates_for(int(node)) if self._runner and not isinstance(node, slice) else None
        return super().__getitem__(node) if known is None else known


class _Cases(_Updates):
    """The case of a Switch: as its script says when it is asked, or as the trace says."""

    def __getitem__(self, node: SupportsIndex | slice) -> Any:
        known = self._runner.case(int(node)) if self._runner and not isinstance(node, slice) else None
        return list.__getitem__(self, node) if known is None else known


class _World(World):
    """A world that answers from a trace, or runs what the runner knows."""

    inputs: Inputs

    def __init__(self, count: int, runner: Runner | None) -> None:
        super().__init__(count)
        self._runner = runner
        self.entries = _Cases(count, runner)
        self.updates = _Updates(count, runner)

    def answer(self, node: Node, _kind: int) -> int:
        """What the trace says, or what the leaf returns when something that it reads is stale."""
        answer = self.inputs.answers[node.number]
        return answer if self._runner is None else self._runner.leaf(node.number, answer)

    def run(self, script: Script | None) -> bool:
        """`entry` is the node's number, and `operation` what is asked."""
        if script is None:
            return False
        if self._runner is not None and self._runner.knows(script.entry, script.operation):
            return self._runner.run(script.entry, script.operation)
        if self._runner is not None:
            self._runner.run_unknown(script.entry, script.operation)
        return self.inputs.free.get((script.entry, script.operation), False)

    def write(self, entry: int, value: int) -> None:
        """Nobody reads what the scripts of the model write: the runner has the entries."""


_NAMES = {"Attributes": ATTRIBUTES, "TestNode": TEST_SCRIPTS}


def _prepared(spec: Spec, number: int) -> tuple[Spec, int]:
    """A copy whose scripts ask the trace, and the number after its last node's."""
    names = _NAMES.get(spec.kind, ("is true",))
    named = zip(names, spec.scripts, strict=bool(spec.scripts))
    scripts = tuple(None if script is None else Script(name, number) for name, script in named)
    children, after = [], number + 1
    for child in spec.children:
        made, after = _prepared(child, after)
        children.append(made)
    return replace(spec, children=children, scripts=scripts), after


class Replay:
    """The reference model under a trace. `period_us`: length of a tick [µs]; None: timers answer from the trace.

    `runner`: the tree's scripts and entries; None: scripts answer from the trace. `facts`: what is told of each tick.
    """

    def __init__(
        self, root: Spec, period_us: int | None, runner: Runner | None = None, facts: Sequence[Fact] = ()
    ) -> None:
        prepared, count = _prepared(root, 0)
        self._period_us = period_us
        self._runner = runner
        self._facts = facts
        self._world = _World(count, runner)
        self._nodes = build(prepared, self._world)
        self._returned: dict[int, int] = {}
        self._halted: set[int] = set()
        for node in self._nodes:
            self._watch(node)

    def _watch(self, node: Node) -> None:
        """Notes what the node returns, and that it is halted."""
        tick, on_halt = node.tick, node.on_halt

        def noting_tick() -> int:
            self._returned[node.number] = tick()
            return self._returned[node.number]

        def noting_halt() -> None:
            self._halted.add(node.number)
            on_halt()

        vars(node).update(tick=noting_tick, on_halt=noting_halt)

    def _prepare(self, node: Node, free: Mapping[tuple[int, str], bool]) -> None:
        """Sets what a node will ask for in this tick, where it does not ask the world."""
        yes = free.get((node.number, "is true"), False)
        if isinstance(node, EntryUpdated):
            self._world.updates[node.number] = node.seen + yes
        elif isinstance(node, Loop):
            taken = node.taken if node.code == RUNNING else EMPTY
            node.spec.scripts = (Script("take", node.number, MORE if yes else taken),)
        elif isinstance(node, Switch):
            cases = range(len(node.children) - 1)
            chosen = (case for case in cases if free.get((node.number, f"case {case}"), False))
            self._world.entries[node.number] = next(chosen, len(node.children) - 1)
        if self._period_us is None and node.spec.kind in TIMED and getattr(node, "deadline", None) is not None:
            over = free[node.number, "time is over"]
            vars(node)["deadline"] = self._world.now + (0 if over else 1)

    def tick(self, inputs: Inputs) -> Shot:
        """One tick."""
        if self._runner is not None:
            self._runner.bits, self._runner.numbers = inputs.bits, inputs.numbers
        self._returned.clear()
        self._halted.clear()
        self._world.inputs = inputs
        for node in self._nodes:
            self._prepare(node, inputs.free)
        self._nodes[0].tick()
        self._world.now += 1 if self._period_us is None else self._period_us
        moments = tuple(
            Moment(
                IDLE if node.code >= WAS else node.code,
                self._returned.get(node.number, IDLE),
                node.number in self._halted,
            )
            for node in self._nodes
        )
        if self._runner is None:
            return Shot(moments)
        return Shot(moments, tuple(self._runner.holds(fact) for fact in self._facts), self._runner.held())
