# SPDX-License-Identifier: MIT
"""Nodes that no file declares: all of them in one message, and what stands in for them until they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from canopy.compiler.errors import CompileError, Errors, Place
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.node_types import node_types
from canopy.compiler.tree import Node
from canopy.compiler.xml_reader import Element
from canopy.tree.foreign import misspelt
from canopy.tree.node_id import EXPLICIT, id_of
from canopy.tree.renamed import RENAMED

SHOWN = 12

# Names that ask: IsDoorOpen, BatteryLow?, CheckPath.
_ASKS = re.compile(r"(is|has|are|can|check|was|should|needs?)([A-Z_ -].*)?|.*(\?|condition)", re.IGNORECASE)


def model_tag(element: Element) -> str:
    """What a node probably is, from its tag, the number of its children, and its name."""
    if element.tag in EXPLICIT:
        return element.tag
    if element.children:
        return "Decorator" if len(element.children) == 1 else "Control"
    name = element.tag or "-"
    asks = _ASKS.fullmatch(name) is not None and (not name[:1].islower() or "_" in name or name[-1] == "?")
    return "Condition" if asks else "Action"


def stand_in(element: Element) -> Node:
    """A node for one that cannot be made: drawn as what it probably is, and never compiled."""
    tag = model_tag(element)
    if element.children and tag not in ("Control", "Decorator"):
        tag = "Control"
    kind = "StatefulAction" if tag == "Action" else tag
    node_id = id_of(element) or element.tag
    shown = f"SubTree {element.attributes.get('ID', '')}" if element.tag == "SubTree" else node_id
    leaf = Leaf(node_id, kind, element.place)
    return Node(node_types()[kind], element.attributes.get("name", shown), element.place, leaf=leaf, xml_name=shown)


class Unknown:
    """The nodes of a tree that nobody declared, by name."""

    def __init__(self) -> None:
        self._uses: dict[str, tuple[int, Place]] = {}
        self._hints: dict[str, str] = {}

    def add(self, name: str, place: Place, known: Iterable[str]) -> None:
        """One more use."""
        count, first = self._uses.get(name, (0, place))
        self._uses[name] = (count + 1, first)
        if count:
            return
        meant = misspelt(name, known)
        if name in RENAMED:
            self._hints[name] = RENAMED[name]
        elif meant is not None:
            self._hints[name] = f"did you mean '{meant}'?"

    def report(self, errors: Errors, files: Sequence[Path]) -> None:
        """Adds an error for each that has another name here, and one for all others."""
        for name, hint in self._hints.items():
            errors.add(CompileError(self._uses[name][1], f"unknown node '{name}'", hint))
        others = [name for name in self._uses if name not in self._hints]
        if not others:
            return
        way_out = f"canopy model {files[0]} -o nodes.xml writes the <TreeNodesModel> that is missing, to be confirmed; "
        way_out += "then compile with --search nodes.xml"
        if len(others) == 1:
            errors.add(CompileError(self._uses[others[0]][1], f"unknown node '{others[0]}'", way_out))
            return
        shown = [f"'{name}' ({self._where(name)})" for name in others[:SHOWN]]
        more = f" and {len(others) - SHOWN} more" if len(others) > SHOWN else ""
        message = f"{len(others)} nodes that no file declares: {', '.join(shown)}{more}"
        errors.add(CompileError(self._uses[others[0]][1], message, way_out))

    def _where(self, name: str) -> str:
        count, place = self._uses[name]
        times = f", {count} times" if count > 1 else ""
        return f"line {place.line}{times}"
