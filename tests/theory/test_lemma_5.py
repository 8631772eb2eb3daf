# SPDX-License-Identifier: MIT
"""Definitions 6 and 7 and Lemma 5 (a guarded subtree) on three states on a line, and on random lines."""

from __future__ import annotations

import random
from collections.abc import Iterator

from theory.finite import Mask, Tree, every_tree, finite_time, mask_of, near, states, subsets


def reachable(tree: Tree, start: Mask) -> Mask:
    seen = start
    while True:
        more = seen | mask_of(tree.move[x] for x in states(seen))
        if more == seen:
            return seen
        seen = more


def safe_as_printed(tree: Tree, obstacle: Mask, initial: Mask) -> bool:
    """Definition 6: I within R, and no run from I meets O."""
    return not initial & ~tree.running and not reachable(tree, initial) & obstacle


def safeguarding_as_printed(count: int, tree: Tree, distance: int, obstacle: Mask, initial: Mask) -> bool:
    """Definition 7."""
    if not safe_as_printed(tree, obstacle, initial) or near(count, tree.success, distance) & ~initial:
        return False
    regions = (region for region in subsets(tree.running) if not initial & ~region)
    return any(region and finite_time(tree, region) is not None for region in regions)


def test_nothing_is_safeguarding_as_printed() -> None:
    """I lies within R, and has to hold all that is near S: S itself, which is outside R. So S would be empty."""
    for count in (2, 3):
        for tree in every_tree(count):
            for obstacle in range(1 << count):
                for initial in range(1 << count):
                    assert not safeguarding_as_printed(count, tree, 1, obstacle, initial)


def until_success(tree: Tree, start: Mask) -> Mask:
    """The states of the runs from `start` up to the first one in S."""
    seen = start
    while True:
        more = seen | mask_of(tree.move[x] for x in states(seen & ~tree.success))
        if more == seen:
            return seen
        seen = more


def guards(count: int, tree: Tree, distance: int, obstacle: Mask, initial: Mask) -> bool:
    """Canopy's form of Definition 7: no progress is asked for, and I may hold states of S."""
    if near(count, tree.success, distance) & ~initial:
        return False
    return not until_success(tree, initial) & obstacle


def under_any_child(count: int, tree: Tree, distance: int, initial: Mask) -> Mask:
    """What Sequence(tree, anything with steps shorter than `distance`) can reach from `initial`."""
    seen = initial
    while True:
        more = seen | mask_of(tree.move[x] for x in states(seen & ~tree.success))
        more |= near(count, seen & tree.success, distance - 1)
        if more == seen:
            return seen
        seen = more


def random_trees(count: int, number: int) -> Iterator[tuple[Tree, Mask, Mask]]:
    chance = random.Random(5)
    everything = (1 << count) - 1
    for _ in range(number):
        parts = [chance.choice("SSRRRF") for _ in range(count)]
        move = tuple(min(count - 1, max(0, x + chance.choice((-1, 0, 1, 1)))) for x in range(count))
        masks = [mask_of(x for x in range(count) if parts[x] == part) for part in "SRF"]
        tree = Tree(move, *masks)
        obstacle = mask_of(chance.sample(range(count), 1))
        yield tree, obstacle, everything & ~obstacle & chance.randrange(1 << count) | near(count, tree.success, 1)


def test_lemma_5_in_its_right_form() -> None:
    tried = 0
    cases = [
        (3, tree, distance, obstacle, initial)
        for tree in every_tree(3)
        for obstacle in range(8)
        for initial in range(8)
        for distance in (1, 2)
    ]
    cases += [(7, tree, d, obstacle, initial) for tree, obstacle, initial in random_trees(7, 20_000) for d in (1, 2)]
    for count, tree, distance, obstacle, initial in cases:
        if not guards(count, tree, distance, obstacle, initial):
            continue
        tried += bool(tree.success & initial)
        # Steps *shorter than* d reach d - 1 on the grid: the margin has to be d - 1 there; d is enough.
        assert not under_any_child(count, tree, distance, initial) & obstacle
    assert tried > 3000


def test_lemma_5_needs_the_margin() -> None:
    """Without "near S is within I" the second child steps over I: found, so the check above can fail."""
    broken = 0
    for tree, obstacle, initial in random_trees(7, 5_000):
        if not until_success(tree, initial) & obstacle:
            broken += bool(under_any_child(7, tree, 3, initial) & obstacle)
    assert broken > 0


def test_safe_needs_no_finite_time() -> None:
    """The guard of Lemma 5 may take for ever: what it has to do is to stay out of O until it succeeds."""
    tree = Tree((1, 0, 2, 3), success=0b1100, running=0b0011, failure=0)
    assert finite_time(tree, 0b0011) is None
    assert guards(4, tree, 1, 0, 0b1110) is True
    assert not under_any_child(4, tree, 1, 0b1110) & 0
