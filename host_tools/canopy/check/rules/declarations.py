# SPDX-License-Identifier: MIT
"""What <TreeNodesModel> declares, and the tree does not live up to."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.check.facts import Facts
from canopy.check.registry import Hit, Severity, rule
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
        uses.setdefault(leaf.id, []).append(facts.element(node.place))
    for leaf_id, elements in uses.items():
        for port in facts.tree.leaves[leaf_id].ports:
            if not any(element is None or port.name in element.attributes for element in elements):
                times = f"{len(elements)} uses" if len(elements) > 1 else "one use"
                yield Hit(port.place, f"port '{port.name}' of '{leaf_id}' is left at its default by its {times}")
