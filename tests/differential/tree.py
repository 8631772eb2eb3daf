# SPDX-License-Identifier: MIT
"""A tree under test: its nodes, what its leaves answer in every tick, and the times of the ticks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from canopy.compiler.node_types import node_types

IDLE, RUNNING, SUCCESS, FAILURE, SKIPPED = range(5)
STATUS_NAMES = ("IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED")
WAS = 8
"""CANOPY_STATUS_WAS: in a status code, the node is IDLE and the low bits keep what it was."""

START, CONTINUE, HALTED = range(3)
CALL_NAMES = ("start", "running", "halted")
"""Kinds of leaf calls: the one function of a Condition or SyncAction, or on_start; on_running; on_halted."""

USER_LEAVES = ("Condition", "SyncAction", "StatefulAction")
BUILT_IN_LEAVES = ("AlwaysSuccess", "AlwaysFailure", "Sleep")

MANY = 0xFFFF


class Shape(NamedTuple):
    """What a kind of node needs: bounds of its number of children, and the XML attributes that are its parameters."""

    least: int
    most: int
    parameters: tuple[str, ...] = ()


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
}


@cache
def engine_kinds() -> frozenset[str]:
    """The kinds of nodes that both this test and the engine know: SHAPES and nodes.def."""
    return frozenset(SHAPES) & frozenset(node_types())


@dataclass
class Spec:
    """A node with what is below it. `answers`: what a leaf of the user's answers, one byte a tick."""

    kind: str
    children: list[Spec]
    parameters: tuple[int, ...] = ()
    answers: bytes = b""

    def walk(self) -> Iterator[Spec]:
        """This node and all below it, depth first."""
        yield self
        for child in self.children:
            yield from child.walk()

    def depth(self) -> int:
        """Number of levels."""
        return 1 + max((child.depth() for child in self.children), default=0)


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
        self._lines(self.root, 2, lines, iter(range(MANY)))
        lines += ["  </BehaviorTree>", "</root>", f"now [us]: {' '.join(map(str, self.times))}"]
        if self.halt_after is not None:
            lines.append(f"the whole tree is halted after {self.halt_after} ticks")
        return "\n".join(lines)

    def _lines(self, spec: Spec, level: int, lines: list[str], numbers: Iterator[int]) -> None:
        head = f"{'  ' * level}<{spec.kind} name={quoteattr(str(next(numbers)))}{attributes(spec)}"
        if spec.children:
            lines.append(head + ">")
            for child in spec.children:
                self._lines(child, level + 1, lines, numbers)
            lines.append(f"{'  ' * level}</{spec.kind}>")
        else:
            answers = "".join("IRSFK"[answer] if answer < 5 else "?" for answer in spec.answers)
            lines.append(head + "/>" + (f" <!-- answers {answers} -->" if answers else ""))


def attributes(spec: Spec) -> str:
    """The parameters as XML attributes, each with a space before it."""
    return "".join(
        f' {name}="{value}"' for name, value in zip(SHAPES[spec.kind].parameters, spec.parameters, strict=True)
    )


class Outcome(NamedTuple):
    """What one tick showed; `status` is None for a halt of the whole tree.

    `calls`: (number of the leaf's node, kind of call) in order; `codes`: a status code a node.
    """

    status: int | None
    calls: list[tuple[int, int]]
    codes: bytes


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
