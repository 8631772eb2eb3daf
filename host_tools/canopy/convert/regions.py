# SPDX-License-Identifier: MIT
"""Regions of a state space of whole numbers: unions of boxes. Exact: no rounding, no tolerance.

The bounds of all boxes cut the space into cells, and every region is a union of cells. So what holds at one point of
each cell holds everywhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

Box = Mapping[str, tuple[int, int]]
Point = dict[str, int]


@dataclass(frozen=True)
class Region:
    """A union of boxes; a variable that a box does not name may have any value. No boxes: the empty region."""

    boxes: tuple[Box, ...]

    def holds(self, point: Point) -> bool:
        """Does the point lie in it?"""
        return any(all(low <= point[name] <= high for name, (low, high) in box.items()) for box in self.boxes)


class Cells:
    """The cells that regions cut a space into, each by its least point."""

    def __init__(self, space: Box, regions: Iterable[Region]) -> None:
        starts: dict[str, set[int]] = {name: {low} for name, (low, _) in space.items()}
        for region in regions:
            for box in region.boxes:
                for name, (low, high) in box.items():
                    starts[name] |= {edge for edge in (low, high + 1) if space[name][0] <= edge <= space[name][1]}
        self.starts: dict[str, Sequence[int]] = {name: sorted(values) for name, values in starts.items()}

    def __len__(self) -> int:
        return prod(len(values) for values in self.starts.values())

    def __iter__(self) -> Iterator[Point]:
        names = list(self.starts)
        for values in product(*self.starts.values()):
            yield dict(zip(names, values, strict=True))
