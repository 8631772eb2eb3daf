# SPDX-License-Identifier: MIT
"""The built-in nodes as an editor declares them: `canopy model --builtin`, and which declarations mean one of them."""

from __future__ import annotations

from functools import cache

from canopy.compiler.errors import CompileError
from canopy.compiler.node_types import NodeType, Parameter, node_types
from canopy.compiler.xml_reader import Element

# Not of BehaviorTree.CPP 4: a node of this name that a file declares is the user's own, unless it is just like ours.
CANOPY_ONLY = ("ReactiveParallel", "TestNode")

# What `canopy model --builtin` puts into <Metadata>, and what Groot2 keeps.
MARK = ("canopy", "built-in")

_LOOP = (Parameter("queue", ""), Parameter("if_empty", "SUCCESS"), Parameter("value", ""))
_CODE = (Parameter("code", ""),)
# Nodes whose attributes are no 32-bit parameters of a row in nodes.def: name -> the tag of its model, its ports.
_OTHERS: dict[str, tuple[str, tuple[Parameter, ...]]] = {
    "Script": ("Action", _CODE),
    "ScriptCondition": ("Condition", _CODE),
    "SetBlackboard": ("Action", (Parameter("value", ""), Parameter("output_key", ""))),
    "UnsetBlackboard": ("Action", (Parameter("key", ""),)),
    **{f"Loop{item}": ("Decorator", _LOOP) for item in ("Bool", "Double", "Int", "String")},
    **{
        f"Switch{cases}": (
            "Control",
            (Parameter("variable", ""), *(Parameter(f"case_{n}", "") for n in range(1, cases + 1))),
        )
        for cases in range(2, 7)
    },
}
_NOT_IN_XML = ("Condition", "SyncAction", "StatefulAction", "Attributes", "Loop", "Switch", "Control", "Decorator")


def _tag(kind: NodeType) -> str:
    if kind.category == "LEAF":
        return "Condition" if kind.name == "WasEntryUpdated" else "Action"
    return kind.category.capitalize()


@cache
def built_in_models() -> dict[str, tuple[str, tuple[Parameter, ...]]]:
    """For every built-in node that XML can name: the tag of its model, and its ports with their defaults."""
    rows = {
        name: (_tag(kind), kind.parameters) for name, kind in sorted(node_types().items()) if name not in _NOT_IN_XML
    }
    return {**rows, **_OTHERS}


def _is_marked(element: Element) -> bool:
    return any(
        entry.attributes.get(MARK[0]) == MARK[1]
        for fields in element.children
        if fields.tag == "MetadataFields"
        for entry in fields.children
    )


def _is_like_ours(element: Element) -> bool:
    tag, ports = built_in_models()[element.attributes["ID"]]
    declared = {child.attributes.get("name") for child in element.children if child.tag.endswith("_port")}
    return element.tag == tag and declared == {port.name for port in ports}


def is_built_in(element: Element, ours: tuple[str, ...]) -> bool:
    """Is this declaration, which has a built-in node's name, a model of that node? Else it is the user's own node.

    Groot2 saves the models of built-in nodes, too; what they are is not for the file to say. `ours`: the metadata keys
    that make a declaration one for Canopy.

    Raises:
        CompileError: it is the user's own, and BehaviorTree.CPP has a node of that name.
    """
    name = element.attributes["ID"]
    if name in CANOPY_ONLY:
        return _is_marked(element) or _is_like_ours(element)
    metadata = (entry for fields in element.children if fields.tag == "MetadataFields" for entry in fields.children)
    if any(key in ours for entry in metadata for key in entry.attributes):
        raise CompileError(element.place, f"'{name}' is the name of a built-in node", "choose another ID")
    return True


def foreign_attribute(element: Element, name: str) -> str | None:
    """The first attribute that our node of this name does not have, if BehaviorTree.CPP has no such node.

    Then the node is the user's own, or misspelt.
    """
    if name not in CANOPY_ONLY:
        return None
    ours = {"return_status_script", *(port.name for port in built_in_models()[name][1])}
    others = (each for each in element.attributes if each not in ours and each not in ("ID", "name"))
    return next((each for each in others if not each.startswith("_")), None)


def is_users(element: Element, name: str) -> bool:
    """Is this node, which no file declares, the user's own, though Canopy has one of that name?"""
    return foreign_attribute(element, name) is not None


def built_in_xml() -> str:
    """A file that declares all built-in nodes, for an editor that does not know them."""
    lines = ['<root BTCPP_format="4">', "  <TreeNodesModel>"]
    for name, (tag, ports) in sorted(built_in_models().items()):
        lines.append(f'    <{tag} ID="{name}">')
        for port in ports:
            direction = "output_port" if (name.startswith("Loop") and port.name == "value") else "input_port"
            default = f' default="{port.default}"' if port.default else ""
            lines.append(f'      <{direction} name="{port.name}"{default}/>')
        lines.append(f'      <MetadataFields><Metadata {MARK[0]}="{MARK[1]}"/></MetadataFields>')
        lines.append(f"    </{tag}>")
    return "\n".join([*lines, "  </TreeNodesModel>", "</root>", ""])
