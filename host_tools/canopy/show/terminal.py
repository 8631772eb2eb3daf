# SPDX-License-Identifier: MIT
"""A tree in the terminal: colours on a terminal, plain text in a pipe, ASCII where nothing else can be encoded."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from canopy.compiler.tree_reader import Tree
from canopy.escape.terminal import styled
from canopy.show.order import in_order
from canopy.show.symbols import look

DEEPEST = 60
"""From here on the level stands in front of a node, in the place of lines that nobody could follow."""


def _label(node_text: str, shape: str, leaf: bool) -> str:
    if not leaf:
        return node_text
    return f"({node_text})" if shape == "oval" else f"[{node_text}]"


def lines(tree: Tree, *, ascii_only: bool = False) -> list[Text]:
    """One line a node, under the tree's ID. Not rich's Tree: that one recurses."""
    tee, last_tee, bar = ("|-- ", "`-- ", "|   ") if ascii_only else ("├── ", "└── ", "│   ")
    result = [styled(tree.id, style="bold")]
    prefixes = {id(tree.root): ""}
    for node, parent, depth in in_order(tree.root):
        before = ""
        if parent is not None:
            is_last = parent.children[-1] is node
            if depth > DEEPEST:
                before = f"{depth} " + (last_tee if is_last else tee)
            else:
                before = prefixes[id(parent)] + (last_tee if is_last else tee)
                prefixes[id(node)] = prefixes[id(parent)] + ("    " if is_last else bar)
        shown = look(node, ascii_only=ascii_only)
        text = _label(shown.text, shown.shape, leaf=not shown.sign)
        label = f"{shown.sign} {text}".strip()
        result.append(styled((before, "bright_black"), (label, shown.style)))
    return result


def print_tree(tree: Tree) -> None:
    """Prints the tree to standard output; long lines are not broken."""
    console = Console(soft_wrap=True, highlight=False)
    encoding = console.encoding
    try:
        "→⇉δ├".encode(encoding)
        ascii_only = False
    except (UnicodeEncodeError, LookupError):
        ascii_only = True
    for line in lines(tree, ascii_only=ascii_only):
        console.print(line)
