# SPDX-License-Identifier: MIT
"""Lemmas 2 and 3 on every pair of trees over three states: what is printed, and what Canopy uses (docs/theory.md)."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from theory.finite import Attracted, Mask, Tree, every_attracted, every_tree, fallback, finite_time, sequence, states

COUNT = 3
ALL = (1 << COUNT) - 1


@pytest.fixture(scope="module")
def staying() -> list[Attracted]:
    return every_attracted(COUNT)


@pytest.fixture(scope="module")
def reaching() -> list[Attracted]:
    return every_attracted(COUNT, stays=False)


def pairs(trees: list[Attracted]) -> Iterator[tuple[Attracted, Attracted]]:
    return ((one, other) for one in trees for other in trees)


def closed(tree: Tree, region: Mask) -> bool:
    return all(region >> tree.move[state] & 1 for state in states(region))


def within(tree: Tree, region: Mask, bound: int, *, stays: bool) -> bool:
    least = finite_time(tree, region, stays=stays)
    return least is not None and least <= bound


def leaving(tree: Tree, region: Mask) -> Mask:
    """Where the tree's steps out of `region` end."""
    ends = 0
    for state in states(region):
        ends |= 1 << tree.move[state]
    return ends & ~region


def test_lemma_2_holds_as_printed(staying: list[Attracted]) -> None:
    tried = 0
    for one, other in pairs(staying):
        if one.tree.success != other.region | other.tree.success:
            continue
        tried += 1
        tree = sequence(COUNT, one.tree, other.tree)
        assert tree.success == one.tree.success & other.tree.success
        assert within(tree, one.region | other.region, one.bound + other.bound, stays=True)
    assert tried == 360


def test_lemma_2_needs_no_equality_only_the_arrivals(reaching: list[Attracted]) -> None:
    """Canopy's form: where T1 arrives, and all of R2', T1 succeeds and T2 goes on. T1 need not stay in S1 by itself."""
    more = 0
    for one, other in pairs(reaching):
        taken = other.region | other.tree.success
        arrivals = leaving(one.tree, one.region)
        if arrivals & ~taken or other.region & ~one.tree.success:
            continue
        if leaving(other.tree, other.region) & ~one.tree.success:
            continue  # the last step of T2 leaves S1: T1 is RUNNING or has failed again
        more += one.tree.success != taken
        tree = sequence(COUNT, one.tree, other.tree)
        assert within(tree, one.region | other.region, one.bound + other.bound, stays=False)
    assert more > 900


def test_lemma_2_without_its_premise_fails(staying: list[Attracted]) -> None:
    """States that fall between the two: T1 has arrived where T2 does not lead to success."""
    found = any(
        leaving(one.tree, one.region) & ~(other.region | other.tree.success)
        and finite_time(sequence(COUNT, one.tree, other.tree), one.region | other.region) is None
        for one, other in pairs(staying)
    )
    assert found


def test_lemma_3_is_false_as_printed(staying: list[Attracted]) -> None:
    """S2 within R1' says nothing of the states of R2' in which T1 runs without end, or has succeeded already."""
    lost = succeeded = 0
    for one, other in pairs(staying):
        if other.tree.success & ~one.region:
            continue
        tree = fallback(COUNT, one.tree, other.tree)
        assert tree.success == one.tree.success  # this part is true
        region = one.region | other.region
        if not within(tree, region, one.bound + other.bound, stays=True):
            succeeded += bool(region & one.tree.success)
            lost += bool(other.region & one.tree.running & ~one.region)
    assert lost > 0
    assert succeeded > 0


def test_the_counterexample_of_lemma_3_that_the_docs_give() -> None:
    """Four states a, b, c, d: T1 runs at a and c, fails at b, succeeds at d; it turns round and round at c."""
    a, b, c, d = range(4)
    bits = [1 << state for state in range(4)]
    first = Tree((d, b, c, d), success=bits[d], running=bits[a] | bits[c], failure=bits[b])
    second = Tree((a, a, a, d), success=bits[a], running=bits[b] | bits[c], failure=bits[d])
    assert finite_time(first, bits[a]) == 1
    assert finite_time(second, bits[b] | bits[c]) == 1
    assert second.success & ~bits[a] == 0  # the printed premise
    tree = fallback(4, first, second)
    assert finite_time(tree, bits[a] | bits[b] | bits[c]) is None
    assert tree.move[c] == c
    assert finite_time(tree, bits[a] | bits[b]) == 2  # the repaired region


def test_lemma_3_in_its_right_form(staying: list[Attracted]) -> None:
    """R2' within F1, R1' and S1; S2 within R1' and S1; S1 kept by T1. Then R0' is the union without S1."""
    tried = wider = 0
    for one, other in pairs(staying):
        success = one.tree.success
        if other.tree.success & ~(one.region | success) or other.region & one.tree.running & ~one.region:
            continue
        if not closed(one.tree, success):
            continue
        region = (one.region | other.region) & ~success
        tree = fallback(COUNT, one.tree, other.tree)
        assert tree.success == success | (one.tree.failure & other.tree.success)
        assert within(tree, region, one.bound + other.bound, stays=True)
        tried += 1
        wider += bool(other.tree.success & ~one.region)
    assert tried > 1000
    assert wider > 100


def test_lemma_3_in_its_right_form_when_success_ends_the_run(reaching: list[Attracted]) -> None:
    """Without "stays in S" T1 need not keep S1, and only arrivals of T2 count: the form of Canopy's hand-over."""
    tried = 0
    for one, other in pairs(reaching):
        handed = other.region & one.tree.failure  # where T2 acts
        arrivals = leaving(other.tree, handed)
        if arrivals & ~(one.region | one.tree.success) or other.region & one.tree.running & ~one.region:
            continue
        region = (one.region | other.region) & ~one.tree.success
        tree = fallback(COUNT, one.tree, other.tree)
        assert within(tree, region, one.bound + other.bound, stays=False)
        tried += 1
    assert tried > 1000


def test_def_5_is_what_it_says() -> None:
    """The checker of this file against a plain simulation from every state of every tree."""
    for tree in every_tree(COUNT):
        for region in range(1, ALL + 1):
            if region & ~tree.running:
                continue
            worst: int | None = 0
            for start in states(region):
                run = [start]
                for _ in range(4 * COUNT):
                    run.append(tree.move[run[-1]])
                first = next((t for t, state in enumerate(run) if not region >> state & 1), None)
                if first is None or any(not tree.success >> state & 1 for state in run[first:]):
                    worst = None
                    break
                assert worst is not None
                worst = max(worst, first)
            assert finite_time(tree, region) == worst
