# SPDX-License-Identifier: MIT
"""A state machine of leaves as SCXML and as DOT, and both read back: what was written is what is checked."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.xml_reader import Element as XmlElement
from canopy.compiler.xml_reader import read_xml
from canopy.convert.scxml import NAMESPACE
from canopy.convert.to_fsm import Group, Jump, Machine, Vertex
from canopy.escape.dot import quoted
from canopy.files import read_text
from canopy.fmt.document import Document, Element
from canopy.fmt.writer import write_document
from canopy.semantics.spec import FAILURE, RUNNING, STATUS_NAMES, SUCCESS

EVENTS = {SUCCESS: "success", RUNNING: "running", FAILURE: "failure"}
LETTERS = {SUCCESS: "S", RUNNING: "R", FAILURE: "F"}
SOURCE = "tick_source"
CANOPY = "urn:canopy:fsm"

_EDGE = re.compile(r'"(\w+)" -> "(\w+)" \[label="([SRF]?)", halts="([\w ]*)", returns="(\w*)"\]')


def _halts(machine: Machine, jump: Jump) -> str:
    return " ".join(machine.vertices[index].id for index in range(*jump.halts))


def _transition(machine: Machine, event: str, jump: Jump) -> Element:
    target = SOURCE if jump.target is None else machine.vertices[jump.target].id
    attributes = [("event", event), ("target", target)]
    if jump.target is None:
        attributes.append(("canopy:returns", STATUS_NAMES[jump.status]))
    if jump.halts[0] < jump.halts[1]:
        attributes.append(("canopy:halts", _halts(machine, jump)))
    return Element("transition", attributes)


def write_scxml(machine: Machine) -> str:
    """SCXML: the events are tick, success, running and failure; the boxes of Fig. 11 are states around states.

    canopy:halts names the states of which that one is halted that is RUNNING from an earlier tick; canopy:returns is
    the root's status.
    """

    def leaf(index: int) -> Element:
        vertex = machine.vertices[index]
        ways = [_transition(machine, EVENTS[status], jump) for status, jump in sorted(vertex.jumps.items())]
        return Element("state", [("id", vertex.id), ("canopy:leaf", vertex.name)], list(ways))

    count = 0

    def box(group: Group) -> list[Element]:
        nonlocal count
        count += 1
        name = f"box_{count}"
        inside: list[Element] = []
        for part in group.parts:
            inside += [leaf(part)] if isinstance(part, int) else box(part)
        return [Element("state", [("id", name), ("canopy:node", group.name)], list(inside))] if inside else []

    source = Element("state", [("id", SOURCE)], [_transition(machine, "tick", machine.begin)])
    top = [("xmlns", NAMESPACE), ("xmlns:canopy", CANOPY), ("version", "1.0"), ("name", machine.name)]
    root = Element("scxml", [*top, ("initial", SOURCE)], [source, *box(machine.group)])
    return write_document(Document('<?xml version="1.0" encoding="UTF-8"?>', [root]))


def write_dot(machine: Machine) -> str:
    """DOT: leaves are boxes, edges S, R and F; clusters are the boxes of Fig. 11."""
    lines = [
        f"digraph {quoted(machine.name)} {{",
        "  rankdir=LR;",
        f'  "{SOURCE}" [label="Tick\\nSource", shape=circle];',
    ]
    count = 0

    def box(group: Group, indent: str) -> None:
        nonlocal count
        count += 1
        lines.append(f"{indent}subgraph cluster_{count} {{")
        lines.append(f"{indent}  label={quoted(group.name)};")
        for part in group.parts:
            if isinstance(part, int):
                vertex = machine.vertices[part]
                lines.append(f'{indent}  "{vertex.id}" [label={quoted(vertex.name)}, shape=box];')
            else:
                box(part, f"{indent}  ")
        lines.append(f"{indent}}}")

    def edge(source: str, letter: str, jump: Jump) -> None:
        target = SOURCE if jump.target is None else machine.vertices[jump.target].id
        returns = STATUS_NAMES[jump.status] if jump.target is None else ""
        halts = _halts(machine, jump)
        lines.append(f'  "{source}" -> "{target}" [label="{letter}", halts="{halts}", returns="{returns}"];')

    box(machine.group, "  ")
    edge(SOURCE, "", machine.begin)
    for vertex in machine.vertices:
        for status, jump in sorted(vertex.jumps.items()):
            edge(vertex.id, LETTERS[status], jump)
    return "\n".join([*lines, "}", ""])


class _Table:
    """What was read: the vertices' jumps, by their IDs."""

    def __init__(self, vertices: Sequence[Vertex], place: Place) -> None:
        self._place = place
        self._index = {vertex.id: number for number, vertex in enumerate(vertices)}
        self.vertices = [Vertex(v.name, v.id, v.key, v.statuses, v.is_action) for v in vertices]
        self.begin: Jump | None = None

    def add(self, source: str, status: int | None, target: str, halts: str, returns: str) -> None:
        """One edge; `status` None: from the tick source."""
        try:
            halted = [self._index[name] for name in halts.split()]
            to = None if target == SOURCE else self._index[target]
            if halted and halted != list(range(halted[0], halted[-1] + 1)):
                raise ValueError(halts)
            jump = Jump(
                (halted[0], halted[-1] + 1) if halted else (0, 0), to, STATUS_NAMES.index(returns) if returns else 0
            )
            if status is None:
                self.begin = jump
            else:
                self.vertices[self._index[source]].jumps[status] = jump
        except (KeyError, ValueError) as error:
            raise CompileError(self._place, f"what was written cannot be read back: {error}") from error

    def done(self) -> tuple[list[Vertex], Jump]:
        """Everything."""
        if self.begin is None:
            raise CompileError(self._place, "what was written has no tick source")
        return self.vertices, self.begin


def read_scxml_back(path: Path, vertices: Sequence[Vertex]) -> tuple[list[Vertex], Jump]:
    """The jumps of a file of write_scxml().

    Raises:
        CompileError: it is not one of these leaves.
    """
    table = _Table(vertices, Place(str(path)))
    status_of = {event: status for status, event in EVENTS.items()}
    waiting: list[XmlElement] = [read_xml(path)]
    while waiting:
        element = waiting.pop()
        for child in element.children:
            if child.tag == "transition":
                given = child.attributes
                status = status_of.get(given["event"])
                halts, returns = given.get("canopy:halts", ""), given.get("canopy:returns", "")
                table.add(element.attributes["id"], status, given["target"], halts, returns)
            else:
                waiting.append(child)
    return table.done()


def read_dot_back(path: Path, vertices: Sequence[Vertex]) -> tuple[list[Vertex], Jump]:
    """The jumps of a file of write_dot().

    Raises:
        CompileError: it is not one of these leaves.
    """
    table = _Table(vertices, Place(str(path)))
    status_of = {letter: status for status, letter in LETTERS.items()}
    for source, target, letter, halts, returns in _EDGE.findall(read_text(path)):
        table.add(source, status_of.get(letter), target, halts, returns)
    return table.done()
