# SPDX-License-Identifier: MIT
"""BehaviorTree.CPP 4 through behaviortreepy: every node is its own C++, Python only asks for the tick."""

import itertools
import sys
import time

import behaviortreepy


def flat(n: int) -> str:
    """A Sequence of n leaves that succeed."""
    return "<Sequence>" + "<AlwaysSuccess/>" * n + "</Sequence>"


def balanced(levels: int) -> str:
    """The balanced tree of workloads.h: Sequence and Fallback in turn, leaves F, F, F, S."""
    leaves = itertools.cycle(("<AlwaysFailure/>",) * 3 + ("<AlwaysSuccess/>",))

    def node(level: int) -> str:
        if level == levels:
            return next(leaves)
        tag = "Fallback" if level % 2 else "Sequence"
        return f"<{tag}>" + "".join(node(level + 1) for _ in range(4)) + f"</{tag}>"

    return node(0)


def main(shape: str, n: int, ticks: int) -> None:
    """Ticks; prints the shortest tick [ns]."""
    body = flat(n) if shape == "sequence" else balanced(n)
    xml = f'<root BTCPP_format="4"><BehaviorTree ID="Bench">{body}</BehaviorTree></root>'
    tree = behaviortreepy.BehaviorTreeFactory().create_tree_from_text(xml)
    shortest = sys.maxsize
    for _ in range(ticks):
        start = time.perf_counter_ns()
        status = tree.tick_exactly_once()
        shortest = min(shortest, time.perf_counter_ns() - start)
        if status != behaviortreepy.NodeStatus.SUCCESS:
            sys.exit(f"the tree returned {status}")
    print(shortest)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
