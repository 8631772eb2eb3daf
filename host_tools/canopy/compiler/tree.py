# SPDX-License-Identifier: MIT
"""The tree between reading and layout: nodes, what their ports are bound to, and the scripts they ask."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from canopy.compiler.blackboard import Blackboard, Entry, Scope, Target
from canopy.compiler.errors import Place
from canopy.compiler.leaf_model import Leaf, Port
from canopy.compiler.node_types import NodeType
from canopy.compiler.port_types import PortType
from canopy.compiler.xml_reader import Element
from canopy.tree.foreign import Foreign

# What a script is for, and so what it returns:
#   condition  the value of its last expression; 0 while a signal in it is stale
#   action     1 when it ran, 0 when a signal in it is stale: then nothing was done
#   switch     the place of the matching case
#   updates    the entry's update counter
#   take       1 when an item of a queue was taken, 0 when the queue is empty
#   set, unset as action
#   parameter  an entry's value as a node's parameter
Role = Literal["condition", "action", "switch", "updates", "take", "set", "unset", "parameter"]


@dataclass(eq=False)
class Script:
    """A script as it stands in an attribute. `body` is the C function's body, once it is compiled."""

    role: Role
    element: Element
    attribute: str
    scope: Scope
    node: Node | None = None
    target: Target | None = None
    """set, unset, updates, take: the entry; parameter: what is read."""
    type: PortType | None = None
    """take: the items'."""
    least: int = 0
    """parameter: its least value."""
    state: Entry | None = None
    """take: the place of the next item of a literal list."""
    queue: Entry | None = None
    """take: the entry that holds the queue; None for a literal list."""
    body: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The attribute's value."""
        return self.element.attributes.get(self.attribute, "")

    def place(self, index: int = 0) -> Place:
        """The place of a character of the text."""
        return self.element.attribute_place(self.attribute, index)


@dataclass
class Bound:
    """What a port is given: a literal (`text`), an entry or a signal (`target`), or nothing (an output)."""

    port: Port
    place: Place
    text: str | None = None
    target: Target | None = None


@dataclass(eq=False)
class Node:
    """A node of the tree. The user's nodes have `leaf` and `bound`, one a port; Script and its like have `script`."""

    type: NodeType
    name: str
    place: Place
    parameters: tuple[int | Script, ...] = ()
    leaf: Leaf | None = None
    bound: tuple[Bound, ...] = ()
    script: Script | None = None
    xml_name: str = ""
    path: str = ""
    children: list[Node] = field(default_factory=list)


@dataclass(frozen=True)
class Tree:
    """A checked tree: its ID, the files it came from (the main one first), the root, and what its names stand for.

    `used`: the IDs of the trees that it is made of; `unused`: the main file's others, by ID; `foreign`: what of other
    tools its files hold.
    """

    id: str
    path: Path
    root: Node
    leaves: dict[str, Leaf]
    files: tuple[Path, ...] = ()
    board: Blackboard = field(default_factory=Blackboard)
    scripts: tuple[Script, ...] = ()
    used: frozenset[str] = frozenset()
    unused: dict[str, Element] = field(default_factory=dict)
    enums: dict[str, PortType] = field(default_factory=dict)
    problems: int = 0
    """How many errors were left out, where a tree is only drawn."""
    others: tuple[str, ...] = ()
    """The other trees that can be the main one, where a tree is only drawn and the file does not say."""
    foreign: Foreign = field(default_factory=Foreign)
