# SPDX-License-Identifier: MIT
"""The conformance table in the reference model: two programs that were made from docs/semantics.md, by two hands.

Left out is what the reference model does not know: parameters that an entry gives, nodes of the user's own, and
canopy_tree_reset().
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import pytest

from canopy.semantics import NODES, Loop, Node, World
from canopy.semantics.spec import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, Script, Spec
from differential.tree import SCRIPTED
from unit.conformance.cases import Case, cases, left_out
from unit.conformance.make_table import NODES as DEFINITIONS

TABLE = Path(__file__).parents[1] / "unit" / "conformance" / "conformance_table.inc"
STATUSES = {"I": IDLE, "R": RUNNING, "S": SUCCESS, "F": FAILURE, "K": SKIPPED}
LETTERS = {status: letter for letter, status in STATUSES.items()}


@dataclass(frozen=True)
class Row:
    state: int
    operation: str
    children: str
    scripts: tuple[int, ...]
    status: str
    calls: str
    next: int


def row_of(line: str) -> Row:
    state, answers, status, calls, after = line.split(" | ")
    children, _, scripts = answers.partition("?")
    operation, _, asked_then = children.partition(":")
    is_tick = operation not in ("halt", "reset")
    return Row(
        int(state),
        "tick" if is_tick else operation,
        children if is_tick else asked_then,
        tuple(int(answer) for answer in scripts.split(",") if answer),
        status,
        calls.replace("-", ""),
        int(after),
    )


def blocks() -> Iterator[tuple[list[str], list[str]]]:
    """The words of the line that begins a node, and its rows."""
    lines = [line[1:-2] for line in TABLE.read_text(encoding="utf-8").splitlines() if line.startswith('"')]
    starts = [number for number, line in enumerate(lines) if line.startswith("@")]
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        yield lines[start].split()[1:], lines[start + 1 : end]


class Entries:
    """In the place of the entries' values and their counts: what the row says that the script gives."""

    def __init__(self, world: RowWorld) -> None:
        self.world = world

    def __getitem__(self, which: int) -> int:
        return self.world.ask(which)


class RowWorld(World):
    """Answers what the row under test says, and writes the calls down."""

    def __init__(self) -> None:
        super().__init__()
        self.entries = self.updates = cast("list[int]", Entries(self))
        self.made = ""
        self.row: Row
        self.answers: Iterator[int]

    def begin(self, row: Row) -> None:
        self.row, self.made, self.answers = row, "", iter(row.scripts)

    def ask(self, which: int) -> int:
        self.made += "ABCDEFGH"[which]
        return next(self.answers)

    def run(self, script: Script | None) -> bool:
        if script is None:
            return False
        if script.operation == "?":
            return self.ask(script.entry) != 0
        self.made += "ABCDEFGH"[script.entry]
        return True


class RowLeaf(Node):
    world: RowWorld

    def note(self, suffix: str) -> None:
        self.world.made += "abcdefg"[self.number] + suffix

    def tick_children(self) -> int:
        self.note("'" if self.code == RUNNING else "")
        return STATUSES[self.world.row.children[self.number]]

    def on_halt(self) -> None:
        self.note("!")


class RowLoop(Loop):
    """Takes what the row says, not the items of a list."""

    def take(self) -> bool:
        return self.world.run(self.spec.scripts[0])


def is_known(words: list[str]) -> bool:
    scripted = words[0] in (*SCRIPTED, "TestNode")
    return words[0] in NODES and (scripted or not any(word[0] in "?!" for word in words))


def node_of(words: list[str]) -> Node:
    kind, children, *given = words
    world = RowWorld()
    scripts: list[Script | None] = []
    parameters: list[int] = []
    for which, word in enumerate(given):
        if word[0] in "?!":
            scripts.append(Script(word[0], which))
        elif kind == "Attributes" or (kind == "TestNode" and which > 1):
            scripts.append(None)
        else:
            parameters.append(int(word))
    spec = Spec(kind, [], tuple(parameters), scripts=tuple(scripts))
    leaves: list[Node] = [RowLeaf(world, number, Spec("", []), []) for number in range(int(children))]
    return (NODES | {"Loop": RowLoop})[kind](world, int(children), spec, leaves)


def take(node: Node, row: Row) -> tuple[str, str]:
    """The status and the calls."""
    world = node.world
    assert isinstance(world, RowWorld)
    world.begin(row)
    if row.operation == "tick":
        status = node.tick()
    else:
        status = IDLE
        node.reset()
        for child in node.children:
            child.reset()
    world.now += 1000
    assert next(world.answers, None) is None, row
    return LETTERS[status], world.made


def compare(words: list[str], lines: list[str]) -> int:
    """Takes each row by the shortest way to its state. Gives how many were taken."""
    rows = [row for row in map(row_of, lines) if row.operation != "reset"]
    ways: dict[int, list[Row]] = {0: []}
    for row in rows:
        node = node_of(words)
        for step in [*ways[row.state], row]:
            assert take(node, step) == (step.status, step.calls), (words, step)
        ways.setdefault(row.next, [*ways[row.state], row])
    return len(rows)


def test_the_table_is_what_the_reference_model_does() -> None:
    compared = [compare(words, lines) for words, lines in blocks() if is_known(words)]
    assert len(compared) > 300
    assert sum(compared) > 14_000


def test_a_wrong_row_is_found() -> None:
    compare(["Inverter", "1"], ["0 | S | F | a | 0"])
    for line in ("0 | S | S | a | 0", "0 | S | F | a' | 0", "0 | halt | I | a! | 0"):
        with pytest.raises(AssertionError):
            compare(["Inverter", "1"], [line])


def test_a_node_or_parameter_that_the_table_has_not_is_named() -> None:
    definitions = DEFINITIONS.read_text(encoding="utf-8")
    assert left_out(definitions, cases()) == []
    without = [case for case in cases() if case.name != "Switch"]
    assert left_out(definitions, without) == ["Switch"]
    constants = [case for case in cases() if case.name != "Timeout"] + [Case("Timeout", 1, (3,))]
    assert left_out(definitions, constants) == ["Timeout msec"]
    new = 'CANOPY_NODE(COOLDOWN, "Cooldown", DECORATOR, 1, 1, 4, 1, "msec", "Waits.")\n'
    assert left_out(new + definitions, cases()) == ["Cooldown", "Cooldown msec"]
