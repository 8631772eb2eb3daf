# SPDX-License-Identifier: MIT
"""Lemma 4 (Parallel) over the product of two state spaces: T1 moves the first part, T2 the second (Assumption 2)."""

from __future__ import annotations

from itertools import product

from theory.finite import Attracted, Mask, Tree, every_attracted, every_tree, finite_time, mask_of

LEFT, RIGHT = 3, 3
COUNT = LEFT * RIGHT


def pair(left: int, right: int) -> int:
    return left * RIGHT + right


def lift_left(mask: Mask) -> Mask:
    return mask_of(pair(a, b) for a, b in product(range(LEFT), range(RIGHT)) if mask >> a & 1)


def lift_right(mask: Mask) -> Mask:
    return mask_of(pair(a, b) for a, b in product(range(LEFT), range(RIGHT)) if mask >> b & 1)


def parallel(left: Tree, right: Tree, needed: int) -> Tree:
    """Definition 4 where each child depends on its own part alone, and does not touch the other's."""
    move = tuple(pair(left.move[a], right.move[b]) for a, b in product(range(LEFT), range(RIGHT)))
    return _with_status(move, [lift_left(left.success), lift_right(right.success)], _failures(left, right), needed)


def _failures(left: Tree, right: Tree) -> list[Mask]:
    return [lift_left(left.failure), lift_right(right.failure)]


def _with_status(move: tuple[int, ...], successes: list[Mask], failures: list[Mask], needed: int) -> Tree:
    either = (successes[0] | successes[1], failures[0] | failures[1])
    both = (successes[0] & successes[1], failures[0] & failures[1])
    success, failure = (either[0], both[1]) if needed == 1 else (both[0], either[1])
    everything = (1 << COUNT) - 1
    return Tree(move, success, everything & ~success & ~failure, failure)


def models() -> list[tuple[Attracted, Attracted]]:
    return [(a, b) for a in every_attracted(LEFT) for b in every_attracted(RIGHT)]


def within(tree: Tree, region: Mask, bound: int) -> bool:
    least = finite_time(tree, region)
    return region == 0 or (least is not None and least <= bound)


def test_lemma_4_is_false_as_printed_for_m_1() -> None:
    """min(τ1, τ2) from the union: who is attracted by one child only has to wait for that one, however slow."""
    late = 0
    for one, other in models():
        region = lift_left(one.region) | lift_right(other.region)
        tree = parallel(one.tree, other.tree, 1)
        region &= ~tree.success
        assert tree.success == lift_left(one.tree.success) | lift_right(other.tree.success)
        late += not within(tree, region, min(one.bound, other.bound))
    assert late > 0


def test_lemma_4_in_its_right_form_for_m_1() -> None:
    """The min from the intersection, max from the union, if both keep their success."""
    tried = 0
    for one, other in models():
        if any(each.tree.settled != each.tree.success for each in (one, other)):
            continue
        tree = parallel(one.tree, other.tree, 1)
        left, right = lift_left(one.region), lift_right(other.region)
        assert within(tree, left & right, min(one.bound, other.bound))
        assert within(tree, (left | right) & ~tree.success, max(one.bound, other.bound))
        tried += 1
    assert tried > 1000


def test_lemma_4_is_false_as_printed_for_m_2() -> None:
    """The intersection is left as soon as one child has succeeded and the other has not."""
    left_early = 0
    for one, other in models():
        tree = parallel(one.tree, other.tree, 2)
        region = lift_left(one.region) & lift_right(other.region) & ~tree.success
        left_early += not within(tree, region, max(one.bound, other.bound))
    assert left_early > 0


def test_lemma_4_in_its_right_form_for_m_2() -> None:
    """The region of attraction has the states in which one child has succeeded already, and stays so."""
    tried = 0
    for one, other in models():
        tree = parallel(one.tree, other.tree, 2)
        left = lift_left(one.region | one.tree.settled)
        right = lift_right(other.region | other.tree.settled)
        assert within(tree, left & right & ~tree.success, max(one.bound, other.bound))
        tried += 1
    assert tried > 1000


def test_assumption_2_does_not_make_the_children_independent() -> None:
    """Each moves its own part, but may look at the other's: then each alone is successful, and both together are not.

    T1 goes a = 0, 1, 2, and succeeds at 2, but it turns back while b = 1. T2 goes from b = 0 to 1, where it succeeds.
    """
    everywhere = list(product(range(LEFT), range(RIGHT)))
    step = {(a, b): 0 if b else min(a + 1, 2) for a, b in everywhere}
    success = mask_of(pair(2, b) for b in range(RIGHT))
    alone = Tree(tuple(pair(step[x], x[1]) for x in everywhere), success, (1 << COUNT) - 1 & ~success, 0)
    region = mask_of([pair(0, 0), pair(1, 0)])
    assert finite_time(alone, region) == 2
    other = mask_of(pair(a, 1) for a in range(LEFT))
    together = _with_status(tuple(pair(step[x], 1) for x in everywhere), [success, other], [0, 0], 2)
    assert finite_time(together, mask_of([pair(0, 0)])) is None
    run = [pair(0, 0)]
    for _ in range(3):
        run.append(together.move[run[-1]])
    assert run == [pair(0, 0), pair(1, 1), pair(0, 1), pair(0, 1)]


def test_a_zero_for_the_others_part_is_a_reset_not_a_hold() -> None:
    """Assumption 2 prints f12(x) = 0 for a difference equation x' = f(x): that moves the other's part to 0."""
    left = Tree((0, 1, 2), success=0, running=7, failure=0)  # stands still
    right = Tree((0, 1, 2), success=0, running=7, failure=0)  # stands still
    zero = tuple(pair(left.move[a], 0) for a, b in product(range(LEFT), range(RIGHT)))  # T1 alone, as printed
    hold = tuple(pair(left.move[a], b) for a, b in product(range(LEFT), range(RIGHT)))  # T1 alone, as meant
    assert zero[pair(1, 1)] == pair(1, 0)
    assert hold[pair(1, 1)] == pair(1, 1) == parallel(left, right, 1).move[pair(1, 1)]


def test_definition_4_is_algorithm_3_for_two_children() -> None:
    for left, right in product(every_tree(1), every_tree(1)):
        letters = [next(part for part in ("success", "running", "failure") if getattr(t, part)) for t in (left, right)]
        for needed in (1, 2):
            if letters.count("success") >= needed:
                expected = "success"
            else:
                expected = "failure" if letters.count("failure") > 2 - needed else "running"
            tree = _with_status(
                (0,) * COUNT,
                [lift_left(7 * left.success), lift_right(7 * right.success)],
                [lift_left(7 * left.failure), lift_right(7 * right.failure)],
                needed,
            )
            assert getattr(tree, expected) == (1 << COUNT) - 1
