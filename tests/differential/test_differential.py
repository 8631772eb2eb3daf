# SPDX-License-Identifier: MIT
"""The engine against the model and against BehaviorTree.CPP, on random trees; see docs/differential.md."""

from __future__ import annotations

import itertools
import random
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from canopy import semantics as model
from canopy.semantics import Node
from canopy.semantics.spec import ATTRIBUTES, FAILURE, HALTED, RUNNING, SUCCESS, Spec
from differential import compare, differences
from differential.compare import (
    Report,
    compare_with_btcpp,
    compare_with_model,
    engine_against_model,
    run_btcpp,
    smallest_failure,
)
from differential.differences import RULES, can_load, run_differing_model
from differential.engine import run_engine
from differential.generate import DEPTH_MAX, NODES_MAX, Wanted, generate
from differential.model import run_model
from differential.paper import acted, experiment
from differential.platforms import needs_btcpp
from differential.settings import BTCPP_TREES, DEFAULT_SEED, MODEL_TREES, SEED, TIMEOUT_S
from differential.tree import SHAPES, Tree, engine_kinds

Figure = Callable[[str], None]

ENGINE = Wanted(tuple(kind for kind in SHAPES if kind in engine_kinds()))


def _btcpp_wanted(kinds: frozenset[str]) -> Wanted:
    """Without what BehaviorTree.CPP cannot be given; what makes the rest of a run differ is seldom."""
    return Wanted(
        tuple(kind for kind in differences.NODES if kind in kinds),
        nonsense=False,
        odd_times=False,
        seldom=("SequenceWithMemory", "Repeat", "RetryUntilSuccessful", "KeepRunningUntilFailure"),
        conditions_skip=False,
        running_skips=False,
    )


BTCPP = _btcpp_wanted(engine_kinds())


def _batches(wanted: Wanted) -> Iterator[list[Tree]]:
    """Trees for tests that wait for something to turn up: they take batches until it does.

    These test the comparison itself, so it is the same trees each time, whatever CANOPY_SEED says: what is found first,
    and how small it can be made, would be a matter of luck. The rarest is in one batch of eight.
    """
    for first in range(0, 500 * 300, 300):
        yield generate(DEFAULT_SEED, wanted, range(first, first + 300))


def _must_agree(report: Report, difference: Callable[[Tree], str | None]) -> None:
    if report.failures:
        tree, how = smallest_failure(report, difference)
        pytest.fail(
            f"{len(report.failures)} of {report.trees} trees differ (CANOPY_SEED={SEED}). The smallest:\n"
            f"{tree.text()}\n{how}",
            pytrace=False,
        )


@pytest.mark.timeout(TIMEOUT_S)
def test_the_engine_does_what_the_model_says(runner: Path, figure: Figure) -> None:
    begin = time.monotonic()
    trees = generate(SEED, ENGINE, range(MODEL_TREES))
    report = compare_with_model(runner, trees)
    _must_agree(report, lambda tree: engine_against_model(runner, tree))
    nodes = [sum(1 for _ in tree.root.walk()) for tree in trees]
    figure(
        f"engine and model: {report.trees} trees of {sum(nodes) / len(nodes):.1f} nodes ({max(nodes)} at most), "
        f"{report.ticks} ticks and halts, {len(engine_kinds())} kinds of nodes, {time.monotonic() - begin:.1f} s"
    )


@needs_btcpp
@pytest.mark.parametrize(("asynchronous", "loads"), [(1, True), (2, False)])
def test_what_behaviortree_cpp_does_not_load_is_known(asynchronous: int, loads: bool) -> None:
    """Also where the nodes that it does not want have conditions, which stand above them in our trees."""
    leaf = Spec("AlwaysSuccess", [])
    scripts = (None,) * len(ATTRIBUTES)
    children = [Spec("Attributes", [Spec("AsyncSequence", [leaf])], scripts=scripts) for _ in range(asynchronous)]
    tree = Tree(Spec("ReactiveSequence", children), (0,))
    assert can_load(tree) == loads
    if loads:
        assert run_btcpp([tree])[0][1] == ""
    else:
        with pytest.raises(subprocess.CalledProcessError):
            run_btcpp([tree])


@needs_btcpp
@pytest.mark.timeout(TIMEOUT_S)
def test_behaviortree_cpp_differs_by_the_rules_only(runner: Path, figure: Figure) -> None:
    begin = time.monotonic()
    trees = [tree for tree in generate(SEED, BTCPP, range(BTCPP_TREES)) if can_load(tree)]
    report = compare_with_btcpp(runner, trees)
    _must_agree(report, lambda tree: next((how for _, how in compare_with_btcpp(runner, [tree]).failures), None))
    tally = report.tally
    figure(
        f"BehaviorTree.CPP and engine: {report.trees} trees ({BTCPP_TREES - report.trees} more are not loaded there), "
        f"{report.ticks} ticks and halts, {len(BTCPP.kinds)} kinds of nodes, all explained; "
        f"{tally.thrown} trees ended by an exception; {time.monotonic() - begin:.1f} s"
    )
    for line in tally.lines():
        figure(line)
    assert tally.strict_ticks > 0.8 * tally.ticks, "too little was compared: the generator makes too many differences"


def test_every_rule_fires() -> None:
    wanted = Wanted(BTCPP.kinds, nonsense=False, odd_times=False)
    fired: set[str] = set()
    for trees in _batches(wanted):
        for tree in trees:
            fired.update(*run_differing_model(tree).fired)
        if fired == set(RULES):
            break
    assert fired == set(RULES)


def test_what_the_paper_defines(runner: Path) -> None:
    experiments = [experiment(random.Random(f"{SEED}/paper/{number}")) for number in range(500)]
    for made, result in zip(experiments, run_engine(runner, [made.tree for made in experiments]), strict=True):
        for x, outcome in zip(made.states, result.outcomes, strict=True):
            assert outcome.status == made.behaviour.r(x), made.tree.text()
            assert acted(made.tree.root, outcome.calls) == made.behaviour.f(x), made.tree.text()


def test_the_trees_are_as_large_and_deep_as_promised() -> None:
    largest = deepest = 0
    kinds: set[str] = set()
    for trees in _batches(Wanted(tuple(SHAPES))):
        largest = max(largest, *(sum(1 for _ in tree.root.walk()) for tree in trees))
        deepest = max(deepest, *(tree.root.depth() for tree in trees))
        kinds.update(*(tree.kinds() for tree in trees))
        for spec in (spec for tree in trees for spec in tree.root.walk()):
            assert SHAPES[spec.kind].least <= len(spec.children) <= SHAPES[spec.kind].most
        if largest > NODES_MAX * 0.9 and deepest >= DEPTH_MAX and kinds == set(SHAPES):
            break
    assert NODES_MAX * 0.9 < largest <= NODES_MAX
    assert deepest == DEPTH_MAX
    assert kinds == set(SHAPES)


# --- That the comparison can fail -------------------------------------------------------------------------------------


class ForgetfulSequence(model.Sequence):
    """Begins again at its first child, as the reactive one does."""

    def tick_children(self) -> int:
        self.begin()
        return super().tick_children()


class LazyReactiveSequence(model.ReactiveSequence):
    """Does not halt what ran before."""

    def tick_children(self) -> int:
        for child in self.children:
            status = child.tick()
            if status == RUNNING:
                return RUNNING
            if status == FAILURE:
                return status
        return SUCCESS


class ImpatientRetry(model.RetryUntilSuccessful):
    """Counts one attempt too many."""

    def begin(self) -> None:
        self.cycles = 1


class LateTimeout(model.Timeout):
    """Forgets to look at the clock."""

    def tick_children(self) -> int:
        return self.tick_child()


class TwiceHalted(model.StatefulAction):
    """Is told twice that it is halted."""

    def on_halt(self) -> None:
        self.world.calls += [(self.number, HALTED)] * 2


class LatePrecondition(model.Precondition):
    """Asks also while the child is RUNNING."""

    def child_runs(self) -> bool:
        return False


class UnheardHalt(model.Attributes):
    """Does not run _onHalted when it is halted from above."""

    def on_halt(self) -> None:
        self.reset_all()


class LateWhile(model.Attributes):
    """Does not ask _while of a RUNNING node."""

    def precondition(self) -> int | None:
        return None if self.child_runs() else super().precondition()


class EndlessNews(model.SkipUnlessUpdated):
    """Does not remember what it has seen."""

    def is_new(self) -> bool:
        new = super().is_new()
        self.seen = 0
        return new


class LoopOnce(model.Loop):
    """Does not start its list again."""

    def starts(self) -> bool:
        return False


class LazySwitch(model.Switch):
    """Does not halt the old case."""

    def tick_children(self) -> int:
        child = self.children[self.case()]
        status = child.tick()
        if status != RUNNING:
            child.reset()
        return status


class LenientCondition(model.Condition):
    """May be RUNNING."""

    valid = (RUNNING, *model.Condition.valid)


@pytest.mark.parametrize(
    "wrong",
    [
        ForgetfulSequence, LazyReactiveSequence, ImpatientRetry, LateTimeout, TwiceHalted, LenientCondition,
        LatePrecondition, UnheardHalt, LateWhile, EndlessNews, LoopOnce, LazySwitch,
    ],
)  # fmt: skip
def test_a_wrong_model_is_found_out(runner: Path, wrong: type[Node]) -> None:
    kind = wrong.__mro__[1].__name__
    nodes = model.NODES | {kind: wrong}
    reports = (compare_with_model(runner, trees, lambda tree: run_model(tree, nodes)) for trees in _batches(ENGINE))
    report = next((report for report in reports if report.failures), None)
    assert report is not None, "it was not found out"
    tree, how = smallest_failure(
        report, lambda tree: engine_against_model(runner, tree, lambda tree: run_model(tree, nodes))
    )
    assert kind in tree.kinds()
    assert sum(1 for _ in tree.root.walk()) <= 8, f"not shrunk well:\n{tree.text()}\n{how}"
    assert "engine: " in how or "faults: " in how


@needs_btcpp
@pytest.mark.parametrize(
    "wrong",
    [
        ForgetfulSequence, LazyReactiveSequence, ImpatientRetry, TwiceHalted, LatePrecondition, UnheardHalt, LateWhile,
        LoopOnce, LazySwitch,
    ],
)  # fmt: skip
def test_a_wrong_engine_is_not_excused(runner: Path, wrong: type[Node], monkeypatch: pytest.MonkeyPatch) -> None:
    """The rules leave so much to compare that BehaviorTree.CPP shows each of these, put in the engine's place."""
    kind = wrong.__mro__[1].__name__
    nodes = model.NODES | {kind: wrong}
    monkeypatch.setattr(compare, "run_engine", lambda _, trees: [run_model(tree, nodes) for tree in trees])

    def acts_wrongly(tree: Tree) -> bool:
        if kind not in tree.kinds():
            return False
        both = zip(run_model(tree, nodes).outcomes, run_model(tree).outcomes, strict=True)
        return any((one.status, one.calls, one.entries) != (two.status, two.calls, two.entries) for one, two in both)

    trees = (tree for batch in _batches(BTCPP) for tree in batch if can_load(tree) and acts_wrongly(tree))
    report = compare_with_btcpp(runner, list(itertools.islice(trees, 4)))
    assert report.failures, "the rules excuse too much"


@needs_btcpp
@pytest.mark.parametrize(
    "kind",
    [
        "SequenceWithMemory", "KeepRunningUntilFailure", "Repeat", "RetryUntilSuccessful", "IfThenElse", "RunOnce",
        "Precondition", "Loop", "Attributes",
    ],
)  # fmt: skip
def test_without_its_rule_a_difference_is_found(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = type(kind, (differences.BtCppNode, model.NODES[kind]), {})
    monkeypatch.setitem(differences.NODES, kind, plain)

    def differs(batch: list[Tree]) -> bool:
        trees = [tree for tree in batch if can_load(tree) and kind in tree.kinds()]
        explained = [run_differing_model(tree) for tree in trees]
        return any(ours.outcomes != theirs for ours, (theirs, _) in zip(explained, run_btcpp(trees), strict=True))

    assert any(differs(batch) for batch in _batches(Wanted(BTCPP.kinds, nonsense=False, odd_times=False)))
