# SPDX-License-Identifier: MIT
"""Runs a circuit's trace in the reference model: the same answers of leaves, scripts and timers, tick by tick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from canopy.semantics import EntryUpdated, Loop, Node, Switch, World, build
from canopy.semantics.spec import ATTRIBUTES, IDLE, RUNNING, WAS, Script, Spec
from canopy.verify.logic.encode import Encoding

EMPTY, MORE = 0, 1 << 30
TIMED = ("Sleep", "Delay", "Timeout")


@dataclass(frozen=True)
class Moment:
    """What one tick did to a node: its status after it, what it returned in it (IDLE: not ticked), was it halted."""

    code: int
    returned: int
    halted: bool


@dataclass(frozen=True)
class Inputs:
    """What one tick of a trace is given: the answer of each leaf, and of what is free, by node and what is asked."""

    answers: Mapping[int, int]
    free: Mapping[tuple[int, str], bool]


def from_circuit(encoding: Encoding, ticks: list[dict[int, bool]]) -> tuple[list[Inputs], list[list[Moment]]]:
    """Simulates the circuit: what its inputs mean, and what the nodes do, per tick."""
    memory: dict[int, bool] = {}
    inputs, moments = [], []
    for given in ticks:
        memory, values = encoding.circuit.step(memory, given)

        def holds(literal: int, values: list[bool] = values) -> bool:
            return values[literal >> 1] ^ bool(literal & 1)

        def only(statuses: Mapping[int, int], holds: Callable[[int], bool] = holds) -> int:
            found = [status for status, literal in statuses.items() if holds(literal)]
            assert len(found) <= 1, "a node has one status"
            return found[0] if found else IDLE

        inputs.append(
            Inputs(
                {number: only(chosen) for number, chosen in encoding.plan.answers.items()},
                {key: holds(literal) for key, literal in encoding.plan.free.items()},
            )
        )
        moments.append([Moment(only(c.now), only(c.returned), holds(c.halted)) for c in encoding.cells])
    return inputs, moments


class _World(World):
    """A world that answers from a trace."""

    inputs: Inputs

    def answer(self, node: Node, _kind: int) -> int:
        """What the trace says."""
        return self.inputs.answers[node.number]

    def run(self, script: Script | None) -> bool:
        """`entry` is the node's number, and `operation` what is asked."""
        return script is not None and self.inputs.free.get((script.entry, script.operation), False)

    def write(self, entry: int, value: int) -> None:
        """Nobody reads what scripts write: their answers are given."""


def _prepared(spec: Spec, number: int) -> tuple[Spec, int]:
    """A copy whose scripts ask the trace, and the number after its last node's."""
    scripts: tuple[Script | None, ...] = spec.scripts
    if spec.kind == "Attributes":
        named = zip(ATTRIBUTES, spec.scripts, strict=True)
        scripts = tuple(None if script is None else Script(name, number) for name, script in named)
    elif spec.scripts:
        scripts = tuple(Script("is true", number) for _ in spec.scripts)
    children, after = [], number + 1
    for child in spec.children:
        made, after = _prepared(child, after)
        children.append(made)
    return replace(spec, children=children, scripts=scripts), after


class Replay:
    """The reference model under a trace. `period_us`: length of a tick [µs]; None: timers answer from the trace."""

    def __init__(self, root: Spec, period_us: int | None) -> None:
        prepared, count = _prepared(root, 0)
        self._period_us = period_us
        self._world = _World(count)
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

    def tick(self, inputs: Inputs) -> list[Moment]:
        """One tick."""
        self._returned.clear()
        self._halted.clear()
        self._world.inputs = inputs
        for node in self._nodes:
            self._prepare(node, inputs.free)
        self._nodes[0].tick()
        self._world.now += 1 if self._period_us is None else self._period_us
        return [
            Moment(
                IDLE if node.code >= WAS else node.code,
                self._returned.get(node.number, IDLE),
                node.number in self._halted,
            )
            for node in self._nodes
        ]
