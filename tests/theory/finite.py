# SPDX-License-Identifier: MIT
"""Definitions 1 to 7 of the paper on finite state spaces, so that a lemma can be tried on every model there is.

A state is a number 0..n-1, a set of states a bit mask. A tree is (f, r) of Definition 1: `move[x]` is the next state,
`success`, `running` and `failure` are the regions. Nothing here is shared with `canopy verify`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product

Mask = int


def states(mask: Mask) -> Iterator[int]:
    """The members of a set, ascending."""
    state = 0
    while mask:
        if mask & 1:
            yield state
        mask >>= 1
        state += 1


def mask_of(members: Iterable[int]) -> Mask:
    return sum(1 << member for member in set(members))


def subsets(mask: Mask) -> Iterator[Mask]:
    """Every subset, the empty one last."""
    subset = mask
    while True:
        yield subset
        if subset == 0:
            return
        subset = (subset - 1) & mask


@dataclass(frozen=True)
class Tree:
    """(f, r) of Definition 1: a partition of the state space, and where each state goes."""

    move: tuple[int, ...]
    success: Mask
    running: Mask
    failure: Mask

    @property
    def settled(self) -> Mask:
        """The states of S that stay in S for ever when the tree runs on."""
        kept = self.success
        while True:
            still = mask_of(state for state in states(kept) if kept >> self.move[state] & 1)
            if still == kept:
                return kept
            kept = still


def every_tree(count: int) -> Iterator[Tree]:
    """All trees over `count` states: count**count moves, 3**count partitions."""
    for move in product(range(count), repeat=count):
        for regions in product(range(3), repeat=count):
            parts = [mask_of(x for x in range(count) if regions[x] == part) for part in range(3)]
            yield Tree(move, *parts)


def choose(count: int, where: Mask, there: Tree, elsewhere: Tree) -> Tree:
    """The tree that is `there` in the set `where`, and `elsewhere` outside: the common part of Definitions 2 and 3."""
    outside = ((1 << count) - 1) & ~where
    move = tuple(there.move[x] if where >> x & 1 else elsewhere.move[x] for x in range(count))
    parts = [
        (getattr(there, part) & where) | (getattr(elsewhere, part) & outside)
        for part in ("success", "running", "failure")
    ]
    return Tree(move, *parts)


def sequence(count: int, first: Tree, second: Tree) -> Tree:
    """Definition 2."""
    return choose(count, first.success, second, first)


def fallback(count: int, first: Tree, second: Tree) -> Tree:
    """Definition 3."""
    return choose(count, first.failure, second, first)


def finite_time(tree: Tree, region: Mask, *, stays: bool = True) -> int | None:
    """Definition 5: the least time bound with `region` as the region of attraction, or None if it is none.

    With `stays` the state has to stay in S from then on, as printed; without, S has to be reached, and what comes after
    is the parent's business.
    """
    if region & ~tree.running:
        return None
    goal = tree.settled if stays else tree.success
    worst = 0
    for start in states(region):
        state, steps = start, 0
        while region >> state & 1:
            if steps > len(tree.move):
                return None
            state, steps = tree.move[state], steps + 1
        if not goal >> state & 1:
            return None
        worst = max(worst, steps)
    return worst


@dataclass(frozen=True)
class Attracted:
    """A tree that is finite time successful from `region` within `bound` steps."""

    tree: Tree
    region: Mask
    bound: int


def every_attracted(count: int, *, stays: bool = True) -> list[Attracted]:
    """Every tree with every region of attraction that it has, the empty one left out."""
    found = []
    for tree in every_tree(count):
        for region in subsets(tree.running):
            bound = finite_time(tree, region, stays=stays) if region else None
            if bound is not None:
                found.append(Attracted(tree, region, bound))
    return found


def near(count: int, mask: Mask, distance: int) -> Mask:
    """The states at most `distance` away from a member, on a line of states one apart."""
    return mask_of(x for x in range(count) if any(abs(x - member) <= distance for member in states(mask)))
