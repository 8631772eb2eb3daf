# SPDX-License-Identifier: MIT
"""Lemmas 7 to 9, Tables I and II, and Definitions 2 and 3 against Algorithms 1 and 2 and against the engine."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from itertools import permutations, product
from pathlib import Path

import pytest

from canopy.compiler.tree_reader import read_tree
from integration import engine
from theory.finite import Attracted, Tree, every_attracted, fallback, finite_time, mask_of, sequence, states

Result = tuple[str, int]
"""Status of a tree in some state, and which child's f acts there."""

PARTS = {"S": "success", "R": "running", "F": "failure"}
CODES = {"S": engine.SUCCESS, "R": engine.RUNNING, "F": engine.FAILURE}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return engine.build(tmp_path_factory.mktemp("engine"))


def algorithm(statuses: tuple[str, ...], goes_on: str) -> Result:
    """Algorithms 1 (goes on at F) and 2 (goes on at S). The last child ticked is the one that acts."""
    for index, status in enumerate(statuses):
        if status != goes_on:
            return status, index
    return goes_on, len(statuses) - 1


def definition(statuses: tuple[str, ...], goes_on: str, *, left: bool) -> Result:
    """Definitions 2 and 3 for three children: T(T(a, b), c) or T(a, T(b, c))."""

    def two(a: Result, b: Result) -> Result:
        return b if a[0] == goes_on else a

    a, b, c = ((status, index) for index, status in enumerate(statuses))
    return two(two(a, b), c) if left else two(a, two(b, c))


@pytest.mark.parametrize("goes_on", ["S", "F"])
def test_definitions_2_and_3_nest_either_way_and_are_the_algorithms(goes_on: str) -> None:
    for statuses in product("SRF", repeat=3):
        expected = algorithm(statuses, goes_on)
        assert definition(statuses, goes_on, left=True) == expected
        assert definition(statuses, goes_on, left=False) == expected


def run_three(library: ctypes.CDLL, folder: Path, node: str) -> Iterator[tuple[tuple[str, ...], str, int]]:
    file = folder / f"{node}.xml"
    leaves = "".join(f"<{name}/>" for name in "ABC")
    models = "".join(f'<Action ID="{name}"/>' for name in "ABC")
    file.write_text(
        f'<root BTCPP_format="4"><BehaviorTree ID="T"><{node}>{leaves}</{node}></BehaviorTree>'
        f"<TreeNodesModel>{models}</TreeNodesModel></root>"
    )
    answers: dict[int, str] = {}
    made = engine.Engine(library, read_tree(file), lambda index: CODES[answers[index]])
    for statuses in product("SRF", repeat=3):
        answers.update(enumerate(statuses, 1))
        root = engine.NAMES[made.tick()][0]
        called = [index for index, what in made.calls if what != "halt"]
        yield statuses, root, called[-1] - 1


@pytest.mark.parametrize(("node", "goes_on"), [("ReactiveSequence", "S"), ("ReactiveFallback", "F")])
def test_the_engine_does_what_definitions_2_and_3_say(
    library: ctypes.CDLL, tmp_path: Path, node: str, goes_on: str
) -> None:
    rows = list(run_three(library, tmp_path, node))
    assert len(rows) == 27
    for statuses, root, last in rows:
        assert (root, last) == algorithm(statuses, goes_on), statuses


def test_table_i_says_too_much_of_success_and_failure() -> None:
    """That one child succeeds is not enough for a Fallback: an earlier one may be RUNNING. A Sequence likewise."""
    assert algorithm(("R", "S"), "F")[0] == "R"
    assert algorithm(("R", "F"), "S")[0] == "R"
    for statuses in product("SRF", repeat=3):
        before = statuses[: statuses.index("S")] if "S" in statuses else ()
        right = "S" in statuses and "R" not in before  # Canopy's form
        assert (algorithm(statuses, "F")[0] == "S") is right


def test_table_ii_has_all_eight_rows_and_contradicts_definition_3_in_the_last() -> None:
    """With all three FAILURE the table has no action executed; Definition 3 has the last child's f."""
    acting = {wants: algorithm(wants, "F")[1] for wants in product("RF", repeat=3)}
    assert len(acting) == 8
    assert [acting[wants] for wants in product("RF", repeat=3)][:7] == [0, 0, 0, 0, 1, 1, 2]
    assert acting["F", "F", "F"] == 2  # the table: nobody
    one = Tree((0,), success=0, running=0, failure=1)
    idle = Tree((0, 1), success=0, running=0, failure=3)
    mover = Tree((1, 0), success=0, running=0, failure=3)
    assert fallback(2, idle, mover).move == mover.move
    assert fallback(1, one, one).failure == 1


def test_lemma_8_holds_as_its_formulas_say() -> None:
    """Eq. 35 lets the second controller act whenever the first does not want to, as Definition 3 does."""
    for wants in product((True, False), repeat=2):
        statuses = tuple("R" if want else "F" for want in wants)
        assert algorithm(statuses, "F")[1] == (0 if wants[0] else 1)


def decision(values: dict[str, bool]) -> str:
    """Fig. 19."""
    if not values["task"]:
        return "recharge"
    return "perform" if values["10" if values["urgent"] else "30"] else "recharge"


Decider = Callable[[dict[str, bool]], str]


def lemma_7(predicate: str, yes: Decider, no: Decider) -> Decider:
    """Fallback(Sequence(P, yes), no) by Algorithms 1 and 2; actions are always RUNNING."""

    def decide(values: dict[str, bool]) -> str:
        inner = algorithm(("S" if values[predicate] else "F", "R"), "S")
        outer = algorithm((inner[0], "R"), "F")
        return (yes if outer[1] == 0 else no)(values)

    return decide


def test_lemma_7_holds() -> None:
    def act(name: str) -> Decider:
        return lambda _values: name

    perform, recharge = act("perform"), act("recharge")
    below = lemma_7("urgent", lemma_7("10", perform, recharge), lemma_7("30", perform, recharge))
    tree = lemma_7("task", below, recharge)
    for bits in product((False, True), repeat=4):
        values = dict(zip(("task", "urgent", "10", "30"), bits, strict=True))
        assert tree(values) == decision(values)


def test_lemma_7_needs_actions_that_are_always_running() -> None:
    """An action that fails in the yes branch hands over to the no branch: then it is no decision tree any more."""
    inner = algorithm(("S", "F"), "S")
    assert algorithm((inner[0], "R"), "F")[1] == 1


def test_fig_22_is_equivalent_only_since_30_percent_is_more_than_10() -> None:
    def fig22(values: dict[str, bool]) -> str:
        urgent_and_10 = algorithm(tuple("S" if values[name] else "F" for name in ("urgent", "10")), "S")[0]
        enough = algorithm(("S" if values["30"] else "F", urgent_and_10), "F")[0]
        inner = algorithm(("S" if values["task"] else "F", enough, "R"), "S")
        return "perform" if algorithm((inner[0], "R"), "F")[1] == 0 else "recharge"

    wrong = []
    for bits in product((False, True), repeat=4):
        values = dict(zip(("task", "urgent", "10", "30"), bits, strict=True))
        if fig22(values) != decision(values):
            wrong.append(values)
    assert wrong == [{"task": True, "urgent": True, "10": False, "30": True}]


def burridge(domains: list[int], goals: list[int]) -> list[int]:
    """The order in which the scheme of Section V.C takes the controllers; 0 has the overall goal."""
    queue, order = [0], [0]
    while queue:
        head = queue.pop(0)
        for index in range(len(domains)):
            if index not in order and not goals[index] & ~(domains[head] | goals[head]):
                queue.append(index)
                order.append(index)
    return order


def controllers() -> list[Attracted]:
    """The atomic trees of Lemma 9: F is all that is neither domain nor goal, and the whole of R attracts."""
    return [one for one in every_attracted(3) if one.region == one.tree.running]


def test_lemma_9_as_printed_breaks_the_partition_and_may_never_end() -> None:
    """The goal lies in the domain, so S and R' overlap; and a controller that prepares no other one never leaves U."""
    goal, domain = 0b001, 0b011
    assert goal & domain  # Si = G(Φi), Ri' = D(Φi) with G inside D
    domains, goals = [0b0011, 0b1000], [0b0001, 0b0100]
    assert burridge(domains, goals) == [0]  # Φ2 cannot be placed: "until U is empty" is never


def test_lemma_9_in_its_right_form() -> None:
    """Whoever can be placed, in Burridge's order, gives a Fallback that succeeds from all their domains."""
    known = [one for one in controllers() if one.tree.settled == one.tree.success]
    placed = 0
    for three in permutations(known[::5], 3):
        domains, goals = [one.region for one in three], [one.tree.success for one in three]
        order = burridge(domains, goals)
        whole, region, bound = three[0].tree, domains[0], three[0].bound
        for index in order[1:]:
            whole = fallback(3, whole, three[index].tree)
            region |= domains[index]
            bound += three[index].bound
        region &= ~goals[0]
        least = finite_time(whole, region)
        assert least is not None
        assert least <= bound
        placed += len(order) == 3
    assert placed > 100


def test_a_sequence_of_finite_models_uses_the_same_definitions() -> None:
    """Ties finite.py, which the other tests use, to `algorithm`."""
    for one, other in product(product("SRF", repeat=2), repeat=2):
        trees = [
            Tree(move, *(mask_of(x for x in range(2) if letters[x] == part) for part in "SRF"))
            for letters, move in ((one, (0, 0)), (other, (1, 1)))
        ]
        for goes_on, compose in (("S", sequence), ("F", fallback)):
            made = compose(2, trees[0], trees[1])
            for state in range(2):
                status, child = algorithm((one[state], other[state]), goes_on)
                assert state in states(getattr(made, PARTS[status]))
                assert made.move[state] == child
