# SPDX-License-Identifier: MIT
"""py_trees, all of it Python."""

import itertools
import sys
import time

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success
from py_trees.composites import Composite, Selector, Sequence


def flat(n: int) -> Composite:
    """A Sequence of n leaves that succeed."""
    return Sequence("root", memory=True, children=[Success(f"leaf {leaf}") for leaf in range(n)])


def balanced(levels: int) -> Behaviour:
    """The balanced tree of workloads.h: Sequence and Selector in turn, leaves F, F, F, S."""
    leaves = itertools.cycle((Failure, Failure, Failure, Success))

    def node(level: int) -> Behaviour:
        if level == levels:
            return next(leaves)("leaf")
        kind = Selector if level % 2 else Sequence
        return kind("node", memory=True, children=[node(level + 1) for _ in range(4)])

    return node(0)


def main(shape: str, n: int, ticks: int) -> None:
    """Ticks; prints the shortest tick [ns]."""
    tree = flat(n) if shape == "sequence" else balanced(n)
    shortest = sys.maxsize
    for _ in range(ticks):
        start = time.perf_counter_ns()
        tree.tick_once()
        shortest = min(shortest, time.perf_counter_ns() - start)
        if tree.status != py_trees.common.Status.SUCCESS:
            sys.exit(f"the tree returned {tree.status}")
    print(shortest)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
