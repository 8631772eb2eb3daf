# SPDX-License-Identifier: MIT
"""The usual signs, shapes and colours of behaviour trees, once for all pictures.

The paper's signs: → Sequence, ? Fallback, ⇉ Parallel; δ for decorators. A star, as in Colledanchise & Ögren's book,
marks a node with memory: BehaviorTree.CPP's Sequence is →*, its ReactiveSequence the paper's →.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from canopy.compiler.tree import Node, Script

Shape = Literal["box", "oval", "diamond"]

# type -> (sign, the same in ASCII)
SIGNS = {
    "ReactiveSequence": ("→", "->"),
    "Sequence": ("→*", "->*"),
    "SequenceWithMemory": ("→**", "->**"),
    "AsyncSequence": ("→*", "->*"),
    "ReactiveFallback": ("?", "?"),
    "Fallback": ("?*", "?*"),
    "AsyncFallback": ("?*", "?*"),
    "Parallel": ("⇉*", "=>*"),
    "ParallelAll": ("⇉*", "=>*"),
    "ReactiveParallel": ("⇉", "=>"),
}
# Types whose sign alone does not say which one is meant.
AMBIGUOUS = ("AsyncSequence", "AsyncFallback", "ParallelAll")


@dataclass(frozen=True)
class Look:
    """How a node looks: sign ("" for leaves), what is written with it, shape, fill and line colour (for pictures)."""

    sign: str
    text: str
    shape: Shape
    fill: str
    line: str
    style: str


def parameter_text(node: Node) -> str:
    """The parameters as `3` or `success_count=1 failure_count=2`, without the scripts that are not there."""
    values = [value.text if isinstance(value, Script) else value for value in node.parameters]
    named = list(zip(node.type.parameters, values, strict=False))
    if node.type.name == "TryCatch":
        return "" if values[0] == 0 else "catch_on_halt" if values[0] == 1 else f"catch_on_halt={values[0]}"
    if len(named) == 1:
        return str(values[0])
    return " ".join(f"{parameter.name}={value}" for parameter, value in named if value != -1 or parameter.default)


def look(node: Node, *, ascii_only: bool = False) -> Look:
    """The look of a node. `style` is rich's, for terminals."""
    kind = node.leaf.id if node.leaf is not None else node.type.name
    own_name = node.name if node.name != kind else ""
    parameters = parameter_text(node)
    if node.type.category == "LEAF":
        text = node.name if node.leaf is not None or not parameters else f"{node.name} {parameters}"
        if node.type.name in ("Condition", "WasEntryUpdated"):
            return Look("", text, "oval", "#c9efc4", "#2f7d32", "green")
        if node.leaf is None:
            return Look("", text, "box", "#e8e8e8", "#666666", "bright_black")
        return Look("", text, "box", "#ffffff", "#333333", "bold")
    if node.type.category == "CONTROL":
        sign = SIGNS[node.type.name][ascii_only] if node.type.name in SIGNS else kind
        kind = kind if kind in AMBIGUOUS else ""
        more = f"[{parameters}]" if parameters else ""
        text = " ".join(part for part in (kind, more, own_name) if part)
        return Look(sign, text, "box", "#dce8f7", "#2b5c9e", "bold cyan")
    more = f" {parameters}" if parameters else ""
    text = f"{kind}{more}" + (f" {own_name}" if own_name else "")
    return Look("d" if ascii_only else "δ", text, "diamond", "#fdf0c8", "#9a7414", "yellow")
