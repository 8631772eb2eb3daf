# SPDX-License-Identifier: MIT
"""A guessed <TreeNodesModel> as a file, each guess marked to be confirmed."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from canopy.compiler.port_types import PortType
from canopy.escape import markup
from canopy.tree.guess import Guess, GuessedNode, GuessedPort, type_name

MARK = "CONFIRM"
_ZERO = {"bool": "false", "int": "0", "fixed": "0", "float": "0.0", "duration": "0", "text": ""}


def _type(kind: PortType | None) -> str:
    return f" type={quoteattr(type_name(kind))}" if kind is not None else ""


def _port(port: GuessedPort) -> str:
    default = ""
    if port.direction == "input_port" and not port.always_given and port.type is not None:
        zero = _ZERO.get(port.type.kind)
        default = f' default="{zero}"' if zero is not None else ""
    text = markup.text(f"{MARK}: {port.why}")
    return f"      <{port.direction} name={quoteattr(port.name)}{_type(port.type)}{default}>{text}</{port.direction}>"


def _node(node: GuessedNode) -> list[str]:
    place = node.elements[0].place
    times = f"{len(node.elements)} uses, the first" if len(node.elements) > 1 else "one use,"
    lines = [f"    <!-- {MARK}: {node.tag}? {times} in line {place.line} -->"]
    if not node.ports:
        return [*lines, f"    <{node.tag} ID={quoteattr(node.id)}/>"]
    ports = [_port(port) for port in node.ports.values()]
    return [*lines, f"    <{node.tag} ID={quoteattr(node.id)}>", *ports, f"    </{node.tag}>"]


def model_text(guess: Guess) -> str:
    """The file's text; it is a tree file that other ones can include, or search."""
    lines = ['<root BTCPP_format="4">', "  <TreeNodesModel>"]
    for name in sorted(guess.nodes):
        lines += _node(guess.nodes[name])
    for tree_id, inputs in sorted(guess.inputs.items()):
        lines.append(f"    <!-- {MARK}: what the program writes before the tree reads it -->")
        lines.append(f"    <SubTree ID={quoteattr(tree_id)}>")
        for name, kind in sorted(inputs.items()):
            lines.append(
                f"      <input_port name={quoteattr(name)}{_type(kind)}>{MARK}: nothing writes it</input_port>"
            )
        lines.append("    </SubTree>")
    return "\n".join([*lines, "  </TreeNodesModel>", "</root>", ""])
