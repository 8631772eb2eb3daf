# SPDX-License-Identifier: MIT
"""A tree in DOT, Graphviz's language: `canopy show tree.xml --dot - | dot -Tpdf > tree.pdf`."""

from __future__ import annotations

from canopy.compiler.tree_reader import Tree
from canopy.escape.dot import quoted
from canopy.show.order import in_order
from canopy.show.symbols import look

_SHAPES = {"box": "box", "oval": "ellipse", "diamond": "box"}


def dot(tree: Tree) -> str:
    """The graph; ordering=out keeps the children in their order."""
    lines = [
        f"digraph {quoted(tree.id)} {{",
        '  graph [ordering=out, nodesep=0.2, ranksep=0.4, splines=ortho, fontname="sans-serif"];',
        '  node [style=filled, fontname="sans-serif", fontsize=11, margin="0.08,0.05"];',
        '  edge [arrowhead=none, color="#555555"];',
    ]
    numbers: dict[int, int] = {}
    for number, (node, parent, _) in enumerate(in_order(tree.root)):
        numbers[id(node)] = number
        shown = look(node)
        text = quoted(*(part for part in (shown.sign, shown.text) if part))
        style = 'style="filled,rounded", ' if shown.shape == "diamond" else ""
        lines.append(
            f"  n{number} [label={text}, shape={_SHAPES[shown.shape]}, {style}"
            f'fillcolor="{shown.fill}", color="{shown.line}"];'
        )
        if parent is not None:
            lines.append(f"  n{numbers[id(parent)]} -> n{number};")
    return "\n".join([*lines, "}"]) + "\n"
