# SPDX-License-Identifier: MIT
"""Where nodes stand in a drawing: parents centred above their children, subtrees as close as their outlines allow.

Reingold and Tilford's idea, without recursion: each subtree keeps its left and right outline, one x for each level.
Sizes and places are in pixels; x is a node's centre, y its upper edge.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from canopy.compiler.tree_reader import Node

GAP_X = 14.0
GAP_Y = 38.0


@dataclass
class Box:
    """A node's box. `x` is relative to its parent's until place() has made it absolute."""

    node: Node
    width: float
    height: float
    depth: int
    x: float = 0.0
    y: float = 0.0
    children: list[Box] = field(default_factory=list)


# Left and right end of a subtree on each level, the deepest level first.
_Outline = list[tuple[float, float]]


def _arrange(box: Box, outlines: list[_Outline]) -> _Outline:
    """Sets the children's x, relative to the box; the outline of the whole, top level last."""
    if not box.children:
        return [(-box.width / 2, box.width / 2)]
    merged = outlines[0]
    places = [0.0]
    for outline in outlines[1:]:
        shared = min(len(merged), len(outline))
        shift = max(merged[-level][1] - outline[-level][0] for level in range(1, shared + 1)) + GAP_X
        places.append(shift)
        moved = [(left + shift, right + shift) for left, right in outline]
        both = [(merged[-level][0], moved[-level][1]) for level in range(shared, 0, -1)]
        longer = merged if len(merged) > len(moved) else moved
        merged = longer[: len(longer) - shared] + both
    middle = (places[0] + places[-1]) / 2
    for child, place in zip(box.children, places, strict=True):
        child.x = place - middle
    return [(left - middle, right - middle) for left, right in merged] + [(-box.width / 2, box.width / 2)]


def place(boxes: list[Box]) -> tuple[float, float]:
    """Places all boxes, given depth first with their children; returns width and height of the whole."""
    outlines: dict[int, _Outline] = {}
    for box in reversed(boxes):
        outlines[id(box)] = _arrange(box, [outlines.pop(id(child)) for child in box.children])
    heights: list[float] = []
    for box in boxes:
        heights.extend([0.0] * (box.depth + 1 - len(heights)))
        heights[box.depth] = max(heights[box.depth], box.height)
    tops = [0.0]
    for height in heights:
        tops.append(tops[-1] + height + GAP_Y)
    boxes[0].x = -min(left for left, _ in outlines[id(boxes[0])])
    for box in boxes:
        box.y = tops[box.depth]
        for child in box.children:
            child.x += box.x
    return max(box.x + box.width / 2 for box in boxes), tops[-1] - GAP_Y
