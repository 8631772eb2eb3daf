# SPDX-License-Identifier: MIT
"""Writes conformance_table.inc from the model; with --check, says whether the file is what would be written.

PYTHONPATH=tests python -m unit.conformance.make_table [--check]
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from unit.conformance import model, scripted_model
from unit.conformance.cases import Case, cases, left_out
from unit.conformance.node import Answer, Node, Parameter, Script

TABLE = Path(__file__).with_name("conformance_table.inc")
NODES = Path(__file__).parents[3] / "runtime/include/canopy/nodes.def"

HEADER = """\
/* SPDX-License-Identifier: MIT */
/*
 * Conformance table: what every control node, decorator and built-in leaf does. Made by make_table.py from model.py and
 * scripted_model.py, which are docs/semantics.md as a program; do not edit. test_conformance.c walks it.
 *
 * "@ node children parameters..." begins a node. A parameter is
 *   a number     as in nodes.def; -1 in the place of a script: there is none
 *   ?0,1,2       a script that is asked: its answers
 *   !            a script that is run; what it gives is of no account
 * A Control or Decorator of the user's own has its functions enter, child and halt instead. They answer: S F R K, done
 * with that status (I is none); 1, 2, ... tick that child; N tick the next one, after the last one done with RUNNING.
 *
 * Its rows are the node's behaviour as a machine with states; 0 is the start.
 * "state | children return ? scripts answer | node returns | calls | next state"
 *   children return  one letter a child: S success, F failure, R running, K skipped, . not asked; - no children; or
 *                    halt or reset, with :letters when a child is asked then
 *   scripts answer   in the order in which they are asked; nothing when none is
 *   node returns     F! a fault is counted, too
 *   calls            in order: a ticked, a' ticked while it is RUNNING, a! halted; A the script of the first parameter
 *                    asked or run, B of the second; - none. Of a node of the user's own: E enter, E' enter while it is
 *                    RUNNING, C child, H halt
 * One row is one millisecond. Every path of rows is a test: so the rows hold every combination of statuses and answers
 * for any number of ticks, and what is not asked for is not written out for each that it could be.
 */
"""


@dataclass(frozen=True)
class Step:
    """A tick, a halt or a reset, with what the node is answered in it, in the order in which it asks."""

    operation: str
    answers: tuple[Answer, ...] = ()


class NotAnsweredError(Exception):
    """The node asks for one more thing than has been answered."""

    def __init__(self, options: Sequence[Answer]) -> None:
        """Keep what it may be answered."""
        super().__init__()
        self.options = options


def start(case: Case) -> Node:
    """A fresh node."""
    kind: type[Node] = getattr(model, case.name, None) or getattr(scripted_model, case.name)
    return kind(case.children, *case.parameters)


def replay(case: Case, steps: Sequence[Step]) -> tuple[Node, list[str]]:
    """Take the steps; also the letters of what the last one asked, in order."""
    node = start(case)
    asked: list[str] = []
    for step in steps:
        asked = []
        answers = iter(step.answers)

        def answer(
            letter: str, options: Sequence[Answer], answers: Iterator[Answer] = answers, asked: list[str] = asked
        ) -> Answer:
            asked.append(letter)
            try:
                return next(answers)
            except StopIteration:
                raise NotAnsweredError(options) from None

        {"tick": node.tick, "halt": node.halt, "reset": node.reset}[step.operation](answer)
    return node, asked


def shown(case: Case, step: Step, asked: Sequence[str]) -> str:
    """The step in a row: what each child returns, and what the scripts answer."""
    answered = dict(zip(asked, step.answers, strict=True))
    children = [chr(ord("a") + child) for child in range(case.children)]
    text = "".join(str(answered.get(child, ".")) for child in children) or "-"
    if step.operation != "tick":
        text = f"{step.operation}:{text}" if any(child in answered for child in children) else step.operation
    scripts = [str(answer) for letter, answer in zip(asked, step.answers, strict=True) if letter.isupper()]
    return f"{text}?{','.join(scripts)}" if scripts else text


def rows(case: Case) -> Iterator[str]:
    """The machine, breadth first."""
    numbers: dict[tuple[object, ...], int] = {start(case).state(): 0}
    histories: list[list[Step]] = [[]]
    for number in itertools.count():
        if number == len(histories):
            return
        waiting = [Step("tick"), Step("halt"), Step("reset")]
        while waiting:
            step = waiting.pop(0)
            try:
                node, asked = replay(case, [*histories[number], step])
            except NotAnsweredError as more:
                waiting[:0] = [Step(step.operation, (*step.answers, option)) for option in more.options]
                continue
            if node.state() not in numbers:
                numbers[node.state()] = len(histories)
                histories.append([*histories[number], step])
            status = node.status + ("!" if node.fault else "")
            yield f"{number} | {shown(case, step, asked)} | {status} | {node.calls or '-'} | {numbers[node.state()]}"


def parameter_text(parameter: Parameter) -> str:
    """A parameter in the line that begins a node."""
    if not isinstance(parameter, Script):
        return str(parameter)
    return f"?{','.join(map(str, parameter.answers))}" if parameter.answers else "!"


def table() -> str:
    """The whole file."""
    lines = [HEADER]
    for case in cases():
        lines.append(f'"@ {" ".join([case.name, str(case.children), *map(parameter_text, case.parameters)])}",\n')
        lines.extend(f'"{row}",\n' for row in rows(case))
    return "".join(lines)


def main() -> int:
    """Write or check the file."""
    missing = left_out(NODES.read_text(encoding="utf-8"), cases())
    if missing:
        print(f"cases.py has not: {', '.join(missing)}", file=sys.stderr)
        return 1
    text = table()
    if sys.argv[1:] != ["--check"]:
        TABLE.write_text(text, encoding="utf-8")
        return 0
    if TABLE.read_text(encoding="utf-8") != text:
        print(f"{TABLE} is not what the model says: run {Path(__file__).name} and read the difference", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
