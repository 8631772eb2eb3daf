# SPDX-License-Identifier: MIT
"""A guessed <TreeNodesModel> as a file, each guess marked to be confirmed."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from xml.sax.saxutils import quoteattr

from canopy.compiler.documents import Documents
from canopy.compiler.errors import CompileError
from canopy.compiler.leaf_model import Declarations, read_model
from canopy.compiler.port_types import Options, PortType
from canopy.compiler.xml_reader import parse_xml
from canopy.escape import markup
from canopy.tree.guess import Guess, GuessedNode, GuessedPort, guess_models, type_name
from canopy.tree.search import complete

MARK = "CONFIRM"
GUESSED = "(guessed)"
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
    for tree_id in sorted({*guess.inputs, *guess.locals}):
        lines.append(f"    <SubTree ID={quoteattr(tree_id)}>")
        for name, kind in sorted(guess.inputs.get(tree_id, {}).items()):
            port = f"<input_port name={quoteattr(name)}{_type(kind)}>"
            lines.append(f"      {port}{MARK}: nothing writes it before the tree reads it</input_port>")
        for name, kind in sorted(guess.locals.get(tree_id, {}).items()):
            port = f"<inout_port name={quoteattr(name)}{_type(kind)}>"
            lines.append(f"      {port}{MARK}: nothing tells its type</inout_port>")
        lines.append("    </SubTree>")
    return "\n".join([*lines, "  </TreeNodesModel>", "</root>", ""])


def declare_guessed(documents: Documents, options: Options, built_in: frozenset[str]) -> None:
    """Declares what no file does, as guessed, for tools that look at trees before they compile."""
    with contextlib.suppress(CompileError):  # what is wrong is said where it is used
        complete(documents, built_in)
    guess = guess_models([documents])
    if not guess.nodes and not guess.inputs and not guess.locals:
        return
    found = Declarations()
    options = replace(options, floats=True, any_type=True)
    root = parse_xml(model_text(guess).encode(), GUESSED)
    read_model(root.children[0], found, options, built_in)
    for name, leaf in found.leaves.items():
        place = guess.nodes[name].elements[0].place
        documents.declarations.leaves[name] = replace(leaf, is_guessed=True, place=place)
    for tree_id, ports in found.subtrees.items():
        declared = documents.declarations.subtrees.get(tree_id, ())
        names = {port.name for port in declared}
        documents.declarations.subtrees[tree_id] = (*declared, *(port for port in ports if port.name not in names))
