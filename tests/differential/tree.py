# SPDX-License-Identifier: MIT
"""A tree under test: its nodes, what its leaves answer in every tick, and the times of the ticks."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from canopy.compiler.node_types import node_types
from canopy.semantics.spec import ATTRIBUTES, IDLE, SKIPPED, STATUS_NAMES, WAS, Script, Spec

USER_LEAVES = ("Condition", "SyncAction", "StatefulAction")
SCRIPT_LEAVES = ("Script", "ScriptCondition", "SetBlackboard")
"""Leaves that the compiler makes SyncActions and Conditions of, which run a script."""
BUILT_IN_LEAVES = ("AlwaysSuccess", "AlwaysFailure", "Sleep", *SCRIPT_LEAVES, "WasEntryUpdated")

MANY = 0xFFFF


ENTRIES = ("a", "b", "s")
"""The entries that scripts read and write, numbers that begin with 0. In BehaviorTree.CPP a Switch declares its entry a
text, and a Loop declares its own a number: `s` is for Switches, the others are for Loops."""
SWITCHED = ENTRIES.index("s")

OPERATIONS = ("<", "==", ":=", "+=", "value", "updates", "take")
"""What a script does with its entry and its value: a comparison, an assignment; what Switch asks, WasEntryUpdated and
its like, and Loop: the entry's value, how often it was written, the next item of the list 1 to `value`."""
ASSIGNMENTS = (":=", "+=")


def script_text(script: Script) -> str:
    """It as it stands in the XML."""
    name = ENTRIES[script.entry]
    if script.operation == "take":
        return ";".join(str(item) for item in range(1, script.value + 1))
    return f"{{{name}}}" if script.operation in ("value", "updates") else f"{name} {script.operation} {script.value}"


PRECONDITIONS = ATTRIBUTES[:4]


class Shape(NamedTuple):
    """What a kind of node needs: bounds of its number of children, and the XML attributes that are its parameters.

    `scripts`: those that are scripts; `statuses`: those that name a status.
    """

    least: int
    most: int
    parameters: tuple[str, ...] = ()
    scripts: tuple[str, ...] = ()
    statuses: tuple[str, ...] = ()


# From docs/semantics.md; whether the engine knows a kind is looked up in nodes.def (engine_kinds).
SHAPES: dict[str, Shape] = {
    "Condition": Shape(0, 0),
    "SyncAction": Shape(0, 0),
    "StatefulAction": Shape(0, 0),
    "AlwaysSuccess": Shape(0, 0),
    "AlwaysFailure": Shape(0, 0),
    "Sleep": Shape(0, 0, ("msec",)),
    "Sequence": Shape(1, MANY),
    "SequenceWithMemory": Shape(1, MANY),
    "AsyncSequence": Shape(1, MANY),
    "ReactiveSequence": Shape(1, MANY),
    "Fallback": Shape(1, MANY),
    "AsyncFallback": Shape(1, MANY),
    "ReactiveFallback": Shape(1, MANY),
    "Parallel": Shape(1, MANY, ("success_count", "failure_count")),
    "ParallelAll": Shape(1, MANY, ("max_failures",)),
    "ReactiveParallel": Shape(1, MANY, ("success_count",)),
    "IfThenElse": Shape(2, 3),
    "WhileDoElse": Shape(2, 3),
    "TryCatch": Shape(2, MANY, ("catch_on_halt",)),
    "Inverter": Shape(1, 1),
    "ForceSuccess": Shape(1, 1),
    "ForceFailure": Shape(1, 1),
    "Repeat": Shape(1, 1, ("num_cycles",)),
    "RetryUntilSuccessful": Shape(1, 1, ("num_attempts",)),
    "KeepRunningUntilFailure": Shape(1, 1),
    "Delay": Shape(1, 1, ("delay_msec",)),
    "Timeout": Shape(1, 1, ("msec",)),
    "RunOnce": Shape(1, 1, ("then_skip",)),
    "Script": Shape(0, 0, (), ("code",)),
    "ScriptCondition": Shape(0, 0, (), ("code",)),
    "SetBlackboard": Shape(0, 0, (), ("value",)),
    "Precondition": Shape(1, 1, ("else",), ("if",), ("else",)),
    "Attributes": Shape(1, 1, (), ATTRIBUTES),
    "SkipUnlessUpdated": Shape(1, 1, (), ("entry",)),
    "WaitValueUpdate": Shape(1, 1, (), ("entry",)),
    "WasEntryUpdated": Shape(0, 0, (), ("entry",)),
    "Loop": Shape(1, 1, ("if_empty",), ("queue",), ("if_empty",)),
    "Switch": Shape(3, 7, (), ("variable",)),
}
SCRIPTED = frozenset(kind for kind, shape in SHAPES.items() if shape.scripts)


@cache
def engine_kinds() -> frozenset[str]:
    """The kinds of nodes that both this test and the engine know: SHAPES and nodes.def."""
    return frozenset(SHAPES) & frozenset((*node_types(), *SCRIPT_LEAVES))


@dataclass
class Tree:
    """What one run is made of. `times`: `now` of each tick [µs]; `halt_after`: ticks until the whole tree is halted."""

    root: Spec
    times: tuple[int, ...]
    halt_after: int | None = None

    def kinds(self) -> set[str]:
        """The kinds of nodes in it."""
        return {spec.kind for spec in self.root.walk()}

    def text(self) -> str:
        """The tree as BehaviorTree.CPP's XML, the answers of its leaves as comments, and the ticks."""
        lines = ['<root BTCPP_format="4">', '  <BehaviorTree ID="Differential">']
        self._lines(self.root, 2, lines, itertools.count())
        lines += ["  </BehaviorTree>", "</root>", f"now [us]: {' '.join(map(str, self.times))}"]
        if self.halt_after is not None:
            lines.append(f"the whole tree is halted after {self.halt_after} ticks")
        return "\n".join(lines)

    def _lines(self, spec: Spec, level: int, lines: list[str], numbers: Iterator[int], above: str = "") -> None:
        number = next(numbers)
        if spec.kind == "Attributes":
            self._lines(spec.children[0], level, lines, numbers, attributes(spec))
            return
        head = f'{"  " * level}<{tag(spec)} name="{number}"{attributes(spec)}{above}'
        if spec.children:
            lines.append(head + ">")
            for child in spec.children:
                self._lines(child, level + 1, lines, numbers)
            lines.append(f"{'  ' * level}</{tag(spec)}>")
        else:
            answers = "".join("IRSFK"[answer] if answer < 5 else "?" for answer in spec.answers)
            lines.append(head + "/>" + (f" <!-- answers {answers} -->" if answers else ""))


def tag(spec: Spec) -> str:
    """Its name in the XML."""
    if spec.kind == "Switch":
        return f"Switch{len(spec.children) - 1}"
    return "LoopInt" if spec.kind == "Loop" else spec.kind


def attributes(spec: Spec) -> str:
    """The parameters and scripts as XML attributes, each with a space before it."""
    shape = SHAPES[spec.kind]
    values: dict[str, str] = {}
    for name, value in zip(shape.parameters, spec.parameters, strict=True):
        values[name] = STATUS_NAMES[value] if name in shape.statuses else str(value)
    for name, script in zip(shape.scripts, spec.scripts, strict=True):
        if script is not None:
            values[name] = script_text(script)
            if spec.kind == "Loop":
                values["value"] = f"{{{ENTRIES[script.entry]}}}"
            if spec.kind == "SetBlackboard":
                values |= {"value": str(script.value), "output_key": ENTRIES[script.entry]}
    if spec.kind == "Switch":
        values |= {f"case_{place + 1}": str(place) for place in range(len(spec.children) - 1)}
    return "".join(f" {name}={quoteattr(value)}" for name, value in values.items())


class Outcome(NamedTuple):
    """What one tick showed; `status` is None for a halt of the whole tree.

    `calls`: (number of the leaf's node, kind of call) in order; `codes`: a status code a node; `entries`: their values.
    """

    status: int | None
    calls: list[tuple[int, int]]
    codes: bytes
    entries: tuple[int, ...]


class Result(NamedTuple):
    """A whole run: its ticks (the halt of the whole tree among them), and how often a leaf answered nonsense."""

    outcomes: list[Outcome]
    faults: int
    fault_node: int


def code_name(code: int) -> str:
    """A status code in words."""
    if code == IDLE or code > WAS + SKIPPED or SKIPPED < code <= WAS:
        return "IDLE" if code == IDLE else f"code {code}"
    return STATUS_NAMES[code] if code < WAS else f"IDLE (was {STATUS_NAMES[code - WAS]})"
