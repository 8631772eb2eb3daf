# SPDX-License-Identifier: MIT
"""bonsai-bt through its Python binding. Its leaf Wait(0) is native Rust and succeeds at once.

A completed tree has to be reset before it can be ticked again; that is part of a tick here.
"""

import itertools
import sys
import time

import bonsai_bt


def flat(n: int) -> bonsai_bt.Behavior:
    """A Sequence of n leaves that succeed."""
    return bonsai_bt.Sequence([bonsai_bt.Wait(0.0) for _ in range(n)])


def balanced(levels: int) -> bonsai_bt.Behavior:
    """The balanced tree of workloads.h: Sequence and Select in turn, leaves F, F, F, S."""
    success = bonsai_bt.Wait(0.0)
    leaves = itertools.cycle((bonsai_bt.Invert(success),) * 3 + (success,))

    def node(level: int) -> bonsai_bt.Behavior:
        if level == levels:
            return next(leaves)
        kind = bonsai_bt.Select if level % 2 else bonsai_bt.Sequence
        return kind([node(level + 1) for _ in range(4)])

    return node(0)


def no_action(_arguments: object, _blackboard: object) -> tuple[object, float]:
    """The tree has no Action."""
    raise AssertionError("an Action was called")


def main(shape: str, n: int, ticks: int) -> None:
    """Ticks; prints the shortest tick [ns]."""
    tree = bonsai_bt.BT(flat(n) if shape == "sequence" else balanced(n), None)
    shortest = sys.maxsize
    for _ in range(ticks):
        start = time.perf_counter_ns()
        result = tree.tick(0.0, no_action)
        tree.reset_bt()
        shortest = min(shortest, time.perf_counter_ns() - start)
        status = result[0] if isinstance(result, tuple) else result
        if status != bonsai_bt.Status.Success:
            sys.exit(f"the tree returned {result}")
    print(shortest)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
