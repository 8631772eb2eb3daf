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


@dataclass
class _Outline:
    """Left and right end of a subtree on each level, the deepest level first; `shift` is added to all of them.

    Moving it costs nothing, and joining two costs as many steps as the flatter one has levels: trees may be as deep as
    they are large.
    """

    ends: list[tuple[float, float]]
    shift: float = 0.0

    def left(self, level: int) -> float:
        """Of the level-th level from the top, from 1 on."""
        return self.ends[-level][0] + self.shift

    def right(self, level: int) -> float:
        """Likewise."""
        return self.ends[-level][1] + self.shift


def _join(one: _Outline, other: _Outline) -> tuple[_Outline, float]:
    """`other` beside `one`, as close as they come: the outline of both, and how far `other` was moved."""
    shared = min(len(one.ends), len(other.ends))
    moved = max(one.right(level) - other.left(level) for level in range(1, shared + 1)) + GAP_X
    other.shift += moved
    longer = one if len(one.ends) > len(other.ends) else other
    for level in range(1, shared + 1):
        longer.ends[-level] = (one.left(level) - longer.shift, other.right(level) - longer.shift)
    return longer, moved


def _arrange(box: Box, outlines: list[_Outline]) -> _Outline:
    """Sets the children's x, relative to the box; the outline of the whole, top level last."""
    half = box.width / 2
    if not box.children:
        return _Outline([(-half, half)])
    merged = outlines[0]
    places = [0.0]
    for outline in outlines[1:]:
        merged, moved = _join(merged, outline)
        places.append(moved)
    middle = (places[0] + places[-1]) / 2
    for child, place in zip(box.children, places, strict=True):
        child.x = place - middle
    merged.shift -= middle
    merged.ends.append((-half - merged.shift, half - merged.shift))
    return merged


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
    whole = outlines[id(boxes[0])]
    boxes[0].x = -min(left for left, _ in whole.ends) - whole.shift
    for box in boxes:
        box.y = tops[box.depth]
        for child in box.children:
            child.x += box.x
    return max(box.x + box.width / 2 for box in boxes), tops[-1] - GAP_Y
