# SPDX-License-Identifier: MIT
"""Writes conformance_table.inc from model.py; with --check, says whether the file is what would be written.

PYTHONPATH=tests python -m unit.conformance.make_table [--check]
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator
from pathlib import Path

from unit.conformance import model

TABLE = Path(__file__).with_name("conformance_table.inc")
STATUSES = "SFRK"

HEADER = """\
/* SPDX-License-Identifier: MIT */
/*
 * Conformance table: what every control node and decorator without scripts does. Made by make_table.py from model.py,
 * which is docs/semantics.md as a program; do not edit. test_conformance.c walks it.
 *
 * "@ node children parameters..." begins a node. Its rows are the node's behaviour as a machine with states; 0 is the
 * start. "state | children return | node returns | calls | next state"
 *   children return  one letter a child: S success, F failure, R running, K skipped, . not asked; or halt or reset,
 *                    with :letters when a child is asked then
 *   calls            in order: a ticked, a' ticked while it is RUNNING, a! halted; - none
 * One row is one millisecond. Every path of rows is a test: so the rows hold every combination of statuses for any
 * number of ticks, and a status that is not asked for is not written out four times.
 */
"""


def cases() -> Iterator[tuple[str, int, tuple[int, ...]]]:
    """Every node with its numbers of children and its parameters."""
    for name in ("Sequence", "SequenceWithMemory", "AsyncSequence", "ReactiveSequence"):
        yield from ((name, children, ()) for children in (1, 2, 3))
    for name in ("Fallback", "AsyncFallback", "ReactiveFallback"):
        yield from ((name, children, ()) for children in (1, 2, 3))
    for children, counts in (
        (1, (-1, 1)),
        (2, (-1, 1)),
        (2, (1, 2)),
        (3, (-1, 1)),
        (3, (2, 2)),
        (3, (1, -1)),
        (3, (-2, 3)),
    ):
        yield "Parallel", children, counts
    for children, most in ((1, 1), (2, 1), (3, 1), (3, 2), (3, -1)):
        yield "ParallelAll", children, (most,)
    for children, needed in ((1, 1), (2, 1), (2, 2), (3, 1), (3, 2), (3, 3), (3, -1)):
        yield "ReactiveParallel", children, (needed,)
    for name in ("IfThenElse", "WhileDoElse"):
        yield from ((name, children, ()) for children in (2, 3))
    yield from (("TryCatch", children, (catch_on_halt,)) for catch_on_halt in (0, 1) for children in (2, 3))
    for name in ("Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure"):
        yield name, 1, ()
    for name in ("Repeat", "RetryUntilSuccessful"):
        yield from ((name, 1, (most,)) for most in (-1, 0, 1, 2, 3))
    for name in ("Delay", "Timeout"):
        yield from ((name, 1, (milliseconds,)) for milliseconds in (0, 1, 2))
    yield from (("RunOnce", 1, (then_skip,)) for then_skip in (0, 1))


class NotAnsweredError(Exception):
    """The node asks for one more child than has been answered."""


def start(name: str, children: int, parameters: tuple[int, ...]) -> model.Node:
    """A fresh node."""
    kind: type[model.Node] = getattr(model, name)
    return kind(children, *parameters)


def operation_of(step: str) -> str:
    """Of "haltS": halt. Of a tick: nothing."""
    return step.rstrip(STATUSES)


def answers_of(step: str) -> str:
    """Of "haltS": S."""
    return step[len(operation_of(step)) :]


def replay(fresh: model.Node, steps: list[str]) -> tuple[model.Node, list[int]]:
    """Take the steps; also which children the last one asked, in order."""
    asked: list[int] = []
    for step in steps:
        asked = []
        answers = iter(answers_of(step))

        def answer(child: int, answers: Iterator[str] = answers, asked: list[int] = asked) -> str:
            asked.append(child)
            try:
                return next(answers)
            except StopIteration:
                raise NotAnsweredError from None

        {"": fresh.tick, "halt": fresh.halt, "reset": fresh.reset}[operation_of(step)](answer)
    return fresh, asked


def rows(name: str, children: int, parameters: tuple[int, ...]) -> Iterator[str]:
    """The machine, breadth first. A step of a tick is the answers in the order in which children are asked."""
    numbers: dict[tuple[object, ...], int] = {start(name, children, parameters).state(): 0}
    histories: list[list[str]] = [[]]
    for number in itertools.count():
        if number == len(histories):
            return
        waiting = ["", "halt", "reset"]
        while waiting:
            step = waiting.pop(0)
            try:
                node, asked = replay(start(name, children, parameters), [*histories[number], step])
            except NotAnsweredError:
                waiting[:0] = [step + status for status in STATUSES]
                continue
            if node.state() not in numbers:
                numbers[node.state()] = len(histories)
                histories.append([*histories[number], step])
            answered = dict(zip(asked, answers_of(step), strict=True))
            letters = "".join(answered.get(child, ".") for child in range(children))
            operation = operation_of(step)
            shown = f"{operation}:{letters}" if operation and answered else operation or letters
            yield f"{number} | {shown} | {node.status} | {node.calls or '-'} | {numbers[node.state()]}"


def table() -> str:
    """The whole file."""
    lines = [HEADER]
    for name, children, parameters in cases():
        lines.append(f'"@ {" ".join([name, str(children), *map(str, parameters)])}",\n')
        lines.extend(f'"{row}",\n' for row in rows(name, children, parameters))
    return "".join(lines)


def main() -> int:
    """Write or check the file."""
    text = table()
    if sys.argv[1:] != ["--check"]:
        TABLE.write_text(text, encoding="utf-8")
        return 0
    if TABLE.read_text(encoding="utf-8") != text:
        print(f"{TABLE} is not what model.py says: run {Path(__file__).name} and read the difference", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
