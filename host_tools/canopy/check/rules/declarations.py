# SPDX-License-Identifier: MIT
"""What <TreeNodesModel> declares, and the tree does not live up to."""

from __future__ import annotations

import re
from collections.abc import Iterator

from canopy.check.facts import Facts
from canopy.check.registry import Hit, Severity, hit, rule
from canopy.compiler.leaf_model import MODEL_TAGS
from canopy.compiler.tree import Node
from canopy.compiler.xml_reader import Element

WRITING_PORTS = ("output_port", "inout_port")


def writing_conditions(model: Element) -> Iterator[Hit]:
    """The Conditions of a <TreeNodesModel> that declare an output. Apart, since the compiler refuses such a file."""
    for element in model.children:
        if element.tag != "Condition":
            continue
        name = element.attributes.get("ID", "")
        for part in element.children:
            if part.tag in WRITING_PORTS:
                port = part.attributes.get("name", "")
                yield Hit(part.place, f"condition '{name}' has the output port '{port}'")
            for entry in part.children if part.tag == "MetadataFields" else ():
                if entry.attributes.get("writes", "").strip():
                    yield Hit(entry.place, f"condition '{name}' writes '{entry.attributes['writes']}'")


@rule(
    "condition-writes",
    Severity.ERROR,
    "A Condition that writes",
    why="Conditions never change state: they are asked at any time, also when nothing shall happen. The compiler "
    "refuses it, too.",
    way_out='Declare it as <Action> with kind="SyncAction", or move the writing into an action.',
)
def condition_writes(facts: Facts) -> Iterator[Hit]:
    """In every file that nodes of the tree come from."""
    for file in dict.fromkeys([str(facts.tree.path), *(leaf.place.file for leaf in facts.tree.leaves.values())]):
        for element in facts.elements(file):
            if element.tag == "TreeNodesModel":
                yield from writing_conditions(element)


@rule(
    "unused-tree",
    Severity.NOTE,
    "A tree of the file that is no part of the main tree",
    why="It is not compiled. It is checked here as a tree of its own, since editors keep such trees beside the others.",
    way_out='Use it (<SubTree ID="…"/>), or move it into a file of its own.',
)
def unused_tree(facts: Facts) -> Iterator[Hit]:
    """Of the main file: an included file may be a library."""
    for tree_id, element in facts.tree.unused.items():
        yield Hit(element.place, f"tree '{tree_id}' is no part of the main tree '{facts.tree.id}'")


@rule(
    "unused-port",
    Severity.NOTE,
    "A port of a leaf that no node of the tree sets",
    why="Every use takes the default: the port costs flash, and suggests a choice that nobody makes.",
    way_out="Remove the port, or set it where it is meant to differ.",
)
def unused_port(facts: Facts) -> Iterator[Hit]:
    """Only of leaves that the tree uses: models are often shared between trees."""
    uses: dict[str, list[Element | None]] = {}
    for node, leaf in facts.leaves(facts.tree.root):
        if leaf.is_guessed:
            continue
        uses.setdefault(leaf.id, []).append(facts.element(node.place))
    for leaf_id, elements in uses.items():
        for port in facts.tree.leaves[leaf_id].ports:
            if not any(element is None or port.name in element.attributes for element in elements):
                times = f"{len(elements)} uses" if len(elements) > 1 else "one use"
                yield Hit(port.place, f"port '{port.name}' of '{leaf_id}' is left at its default by its {times}")


@rule(
    "undeclared-node",
    Severity.NOTE,
    "A node that no file declares",
    why="The compiler needs to know its kind and its ports. Here it is taken as whatever its use lets it be.",
    way_out="canopy model FILE -o nodes.xml writes the declarations that are missing, to be confirmed.",
)
def undeclared_node(facts: Facts) -> Iterator[Hit]:
    """One hit for each, at its first use."""
    seen: dict[str, Node] = {}
    for node, leaf in facts.leaves(facts.tree.root):
        if leaf.is_guessed:
            seen.setdefault(leaf.id, node)
    for leaf_id, node in seen.items():
        yield hit(node, f"no file declares '{leaf_id}'")


_REFUSED = re.compile(r"[\x00-\x20\x7f<>&\"'/\\\\:*?|.]")


@rule(
    "refused-name",
    Severity.NOTE,
    "A name that BehaviorTree.CPP refuses",
    why="Since 4.9 it loads no file in which the ID of a node or tree, or the name of a port, has a blank, a point, "
    "a slash, a colon, or a sign that XML or file systems use.",
    way_out="Rename it, if the file shall be loaded there, too: letters, digits, _ and -.",
)
def refused_name(facts: Facts) -> Iterator[Hit]:
    """IDs of trees and models, and names of ports, in every file of the tree."""
    for file in dict.fromkeys([str(facts.tree.path), *(str(path) for path in facts.tree.files)]):
        for element in facts.elements(file):
            is_port = element.tag in (*WRITING_PORTS, "input_port", "bidirectional_port")
            named = element.attributes.get("name" if is_port else "ID", "")
            if (is_port or element.tag in ("BehaviorTree", *MODEL_TAGS)) and _REFUSED.search(named):
                yield Hit(element.place, f"BehaviorTree.CPP 4.9 and later refuse the name '{named}'")
