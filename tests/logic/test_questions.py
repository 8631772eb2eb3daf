# SPDX-License-Identifier: MIT
"""Answers of berkeley-abc against exhaustive search in the reference model, and monitors against the definition."""

from __future__ import annotations

import itertools
import random
from collections.abc import Hashable, Iterator

import pytest

from canopy.semantics.spec import Spec
from canopy.verify.logic.ask import decided
from canopy.verify.logic.encode import CELLS, Encoding
from canopy.verify.logic.formula import ATOMS, OPERATORS, Formula
from canopy.verify.logic.monitor import holds, literal
from canopy.verify.logic.replay import Inputs, Replay, Shot, from_circuit
from differential.tree import SCRIPTED, SHAPES
from logic.random_trees import random_returns, random_specs

pytestmark = pytest.mark.logic
SEED = 20261130
UNTIMED = tuple(k for k in CELLS if k in SHAPES and k not in SCRIPTED and k not in ("Sleep", "Delay", "Timeout"))
MOST_CASES, MOST_STATES, WANTED = 64, 800, 120
FIXED = ("world", "number", "spec", "children", "tick", "on_halt")

State = tuple[tuple[tuple[str, Hashable], ...], ...]


class Machine(Replay):
    """The reference model, to be put into any state that it was in."""

    def save(self) -> State:
        return tuple(
            tuple((k, tuple(v.items()) if isinstance(v, dict) else v) for k, v in vars(node).items() if k not in FIXED)
            for node in self._nodes
        )

    def load(self, state: State) -> None:
        for node, saved in zip(self._nodes, state, strict=True):
            for name in set(vars(node)) - set(FIXED):  # some are set only once they are needed
                del vars(node)[name]
            vars(node).update({name: dict(value) if isinstance(value, tuple) else value for name, value in saved})


def everything(returns: dict[int, tuple[int, ...]]) -> Iterator[Inputs]:
    for answers in itertools.product(*returns.values()):
        yield Inputs(dict(zip(returns, answers, strict=True)), {})


def all_shots(root: Spec, returns: dict[int, tuple[int, ...]]) -> list[Shot] | None:
    """What any tick of any run can look like; None: too many states."""
    machine = Machine(root, 1)
    waiting = [machine.save()]
    known = set(waiting)
    found = []
    while waiting:
        state = waiting.pop()
        for inputs in everything(returns):
            machine.load(state)
            found.append(machine.tick(inputs))
            after = machine.save()
            if after not in known:
                known.add(after)
                waiting.append(after)
        if len(known) > MOST_STATES:
            return None
    return found


def atom(chance: random.Random, nodes: int) -> Formula:
    return Formula(chance.choice(list(ATOMS)), (), chance.randrange(nodes))


def past(chance: random.Random, nodes: int, depth: int) -> Formula:
    """A random formula."""
    what = chance.choice(("not", "and", "or", *OPERATORS))
    if depth == 0:
        return atom(chance, nodes)
    count, number = OPERATORS.get(what, (1 if what == "not" else 2, "no"))
    parts = tuple(past(chance, nodes, depth - 1) for _ in range(count))
    ticks = chance.randint(0, 4) if number == "must" or (number == "may" and chance.random() < 0.5) else None
    return Formula(what, parts, 0, ticks)


def test_invariants_by_exhaustive_search() -> None:
    verdicts = {"proven": 0, "refuted": 0}
    for number, root in enumerate(random_specs(SEED + 1, range(3000), UNTIMED)):
        chance = random.Random(f"{SEED}/{number}")
        returns = random_returns(chance, root)
        nodes = sum(1 for _ in root.walk())
        cases = 1
        for statuses in returns.values():
            cases *= len(statuses)
        if nodes < 3 or cases > MOST_CASES:
            continue
        shots = all_shots(root, returns)
        if shots is None:
            continue
        for _ in range(2):
            formula = Formula("not", (Formula("and", (atom(chance, nodes), atom(chance, nodes))),))
            expected = "proven" if all(holds(formula, [one])[0] for one in shots) else "refuted"
            assert decided(root, returns, formula, None, 30.0).verdict == expected, f"tree {number}: {formula}"
            verdicts[expected] += 1
        if sum(verdicts.values()) >= WANTED:
            break
    assert sum(verdicts.values()) >= WANTED
    assert min(verdicts.values()) > WANTED // 10


def test_monitors_by_their_definition() -> None:
    outcomes = set()
    for number, root in enumerate(random_specs(SEED + 2, range(400))):
        chance = random.Random(f"{SEED}/{number}")
        encoding = Encoding(root, random_returns(chance, root), None)
        formula = past(chance, len(encoding.cells), 3)
        output = literal(encoding, formula)
        given = [{one: chance.random() < 0.5 for one in encoding.circuit.inputs} for _ in range(10)]
        _, trace = from_circuit(encoding, given)
        memory: dict[int, bool] = {}
        for one, expected in zip(given, holds(formula, trace), strict=True):
            memory, values = encoding.circuit.step(memory, one)
            assert values[output >> 1] ^ bool(output & 1) == expected, f"tree {number}: {formula}"
            outcomes.add(expected)
    assert outcomes == {True, False}


def test_past_questions_are_refuted_by_traces() -> None:
    """decided() itself replays each trace in the reference model, and judges it by the definition."""
    verdicts = []
    for number, root in enumerate(random_specs(SEED + 3, range(120))):
        chance = random.Random(f"{SEED}/{number}")
        nodes = sum(1 for _ in root.walk())
        verdict = decided(root, random_returns(chance, root), past(chance, nodes, 2), 10_000, 10.0)
        verdicts.append(verdict.verdict)
    assert verdicts.count("refuted") > 20
    assert verdicts.count("proven") > 20
