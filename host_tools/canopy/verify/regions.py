# SPDX-License-Identifier: MIT
"""Regions of a whole tree, from those of its leaves: Definitions 2 to 4 of the paper, and the decorators like them.

For each node: in which states it returns what, and which leaves are RUNNING there, that is, act. The nodes are those
without a memory: what they do depends on the state alone. Where a leaf is free, or a subtree arbitrary, the regions
overlap: any of them may be the one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from canopy.compiler.errors import CompileError
from canopy.compiler.tree import Node
from canopy.verify.linear import Formula, Polyhedron, everything
from canopy.verify.model import FAILURE, RUNNING, STATUSES, SUCCESS, LeafModel, Plant, Status, Step, standing_still

MAX_CASES = 20_000
Acting = tuple[str, ...]
"""Paths of the nodes that act: leaves that are RUNNING, and arbitrary subtrees that were ticked."""
Cases = dict[tuple[Status, Acting], Formula]

LEAF_KINDS = ("Condition", "SyncAction", "StatefulAction")


@dataclass(frozen=True)
class Arbitrary:
    """What a subtree may do, whatever it is: return anything, and step less than `shorter` (None: not move it)."""

    shorter: tuple[Fraction | None, ...]


class Regions:
    """The regions of the nodes of a tree, under a model and with some subtrees arbitrary (by path)."""

    def __init__(self, plant: Plant, arbitrary: Mapping[str, Arbitrary] | None = None) -> None:
        self.plant = plant
        self.arbitrary = dict(arbitrary or {})
        self._domain = Formula(plant.width, (plant.domain,))

    def of(self, node: Node) -> Cases:
        """The regions of a node, within the state space.

        Raises:
            CompileError: A leaf has no model, or a node's meaning does not depend on the state alone.
        """
        order, waiting = [], [node]
        while waiting:  # parents before children
            one = waiting.pop()
            order.append(one)
            if one.path not in self.arbitrary:
                waiting += one.children
        made: dict[int, Cases] = {}
        for one in reversed(order):
            made[id(one)] = self._one(one, made)
        return made[id(node)]

    def _one(self, node: Node, made: dict[int, Cases]) -> Cases:
        if node.path in self.arbitrary:
            acting = (node.path,) if any(self.arbitrary[node.path].shorter) else ()
            return {(status, acting): self._domain for status in STATUSES}
        if not node.children:
            return self._leaf(node)
        cases = self._compose(node, [made[id(child)] for child in node.children])
        if sum(len(formula.parts) for formula in cases.values()) > MAX_CASES:
            raise CompileError(
                node.place,
                f"'{node.name}' has more than {MAX_CASES} regions",
                'verify a part of the tree: give the claim of = "…", or make a subtree arbitrary',
            )
        return cases

    def _leaf(self, node: Node) -> Cases:
        constant = {"AlwaysSuccess": SUCCESS, "AlwaysFailure": FAILURE}.get(node.type.name)
        if constant is not None:
            return {(constant, ()): self._domain}
        if node.leaf is None or node.type.name not in LEAF_KINDS:
            raise _unsupported(node)
        model = self.plant.leaves.get(node.leaf.id)
        if model is None:
            raise CompileError(
                node.place,
                f"leaf '{node.leaf.id}' has no model in {self.plant.path}",
                f"write [leaves.{node.leaf.id}] with success, running and failure, or free = true",
            )
        return self._modelled(node, model)

    def _modelled(self, node: Node, model: LeafModel) -> Cases:
        if not model.free:
            cases = {
                (status, (node.path,) if status == RUNNING else ()): formula & self._domain
                for status, formula in model.regions.items()
            }
            return {key: formula for key, formula in cases.items() if not formula.is_empty}
        assert node.leaf is not None
        if "SKIPPED" in node.leaf.returns:
            raise CompileError(
                node.place,
                f"leaf '{node.leaf.id}' may return SKIPPED, for which the model has no region",
                "take its subtree as arbitrary in the claim",
            )
        kind = (SUCCESS, FAILURE) if node.type.name != "StatefulAction" else STATUSES
        returns = tuple(status for status in kind if status in (node.leaf.returns or kind))
        acts = (node.path,) if model.modes else ()
        return {(status, acts if status == RUNNING else ()): self._domain for status in returns}

    def _compose(self, node: Node, made: list[Cases]) -> Cases:
        name = node.type.name
        if name in ("ReactiveSequence", "ReactiveFallback"):
            return _in_order(self._domain, made, SUCCESS if name == "ReactiveSequence" else FAILURE)
        if name == "ReactiveParallel" and isinstance(node.parameters[0], int):
            return _parallel(self._domain, made, node.parameters[0])
        if name == "WhileDoElse":
            return _while_do_else(made)
        mapped = {
            "Inverter": {SUCCESS: FAILURE, FAILURE: SUCCESS},
            "ForceSuccess": {FAILURE: SUCCESS},
            "ForceFailure": {SUCCESS: FAILURE},
            "KeepRunningUntilFailure": {SUCCESS: RUNNING},
        }.get(name)
        if mapped is None:
            raise _unsupported(node)
        result: Cases = {}
        for (status, acting), formula in made[0].items():
            _add(result, (mapped.get(status, status), acting), formula)
        return result


def _unsupported(node: Node) -> CompileError:
    name = node.xml_name or node.type.name
    reactive = {"Sequence": "ReactiveSequence", "Fallback": "ReactiveFallback", "Parallel": "ReactiveParallel"}.get(
        name
    )
    return CompileError(
        node.place,
        f"<{name}> has a memory: what it does is not a function of the plant's state",
        f"use <{reactive}>, or make it arbitrary in the claim" if reactive else "make it arbitrary in the claim",
    )


def _add(cases: Cases, key: tuple[Status, Acting], formula: Formula) -> None:
    if formula.is_empty:
        return
    if key in cases:
        parts = [part for part in formula.parts if not any(part.within(other) for other in cases[key].parts)]
        formula = cases[key] | Formula(formula.width, tuple(parts))
    cases[key] = formula


def _joined(one: Acting, other: Acting) -> Acting:
    return tuple(dict.fromkeys((*one, *other)))


def _in_order(domain: Formula, made: list[Cases], goes_on: Status) -> Cases:
    """ReactiveSequence (goes on at SUCCESS) and ReactiveFallback (at FAILURE)."""
    result: Cases = {}
    reached: dict[Acting, Formula] = {(): domain}
    for cases in made:
        following: Cases = {}
        for (carried, where), ((status, acting), formula) in product(reached.items(), cases.items()):
            both = where & formula
            target = following if status == goes_on else result
            _add(target, (status, _joined(carried, acting)), both)
        reached = {acting: formula for (_, acting), formula in following.items()}
    for acting, formula in reached.items():
        _add(result, (goes_on, acting), formula)
    return result


def _parallel(domain: Formula, made: list[Cases], success_count: int) -> Cases:
    """Algorithm 3: M successes, or more than N - M failures."""
    count = len(made)
    needed = success_count if success_count >= 0 else count + success_count + 1
    states: dict[tuple[int, int, Acting], Formula] = {(0, 0, ()): domain}
    for cases in made:
        following: dict[tuple[int, int, Acting], Formula] = {}
        for ((good, bad, carried), where), ((status, acting), formula) in product(states.items(), cases.items()):
            both = where & formula
            if both.is_empty:
                continue
            key = (good + (status == SUCCESS), bad + (status == FAILURE), _joined(carried, acting))
            following[key] = following[key] | both if key in following else both
        states = following
    result: Cases = {}
    for (good, bad, acting), formula in states.items():
        status = SUCCESS if good >= needed else FAILURE if bad > count - needed else RUNNING
        _add(result, (status, acting), formula)
    return result


def _while_do_else(made: list[Cases]) -> Cases:
    result: Cases = {}
    for (status, acting), where in made[0].items():
        if status == RUNNING or (status == FAILURE and len(made) == 2):
            _add(result, (status, acting), where)
            continue
        for (then, then_acting), formula in made[1 if status == SUCCESS else 2].items():
            _add(result, (then, _joined(acting, then_acting)), where & formula)
    return result


@dataclass(frozen=True)
class Piece:
    """States in which the tree does one thing: its status, who acts, and where the state goes.

    `seen`: what the leaves decide by; `where`: what the plant does it by. `states` is both of them.
    """

    states: Polyhedron
    status: Status
    label: str
    step: Step
    acting: Acting
    seen: Polyhedron | None = None
    where: Polyhedron | None = None


def pieces(regions: Regions, root: Node) -> list[Piece]:
    """The tree as a piecewise affine system. In a tree without free leaves the pieces do not overlap.

    Raises:
        CompileError: As Regions.of(); or two leaves that act at once move the same variable.
    """
    modes = _Modes(regions, root)
    result = []
    for (status, acting), formula in regions.of(root).items():
        for part in formula.disjoint().parts:
            for label, when, where, step in modes.of(acting):
                for seen, there in product((when & Formula(part.width, (part,))).parts, where.parts):
                    states = seen.meet(there)
                    if not states.is_empty:
                        result.append(Piece(states, status, label or status, step, acting, seen, there))
    return result


Combined = tuple[str, Formula, Formula, Step]


class _Modes:
    """What nodes that act together do."""

    def __init__(self, regions: Regions, root: Node) -> None:
        self.regions = regions
        self.width = regions.plant.width
        self.nodes: dict[str, Node] = {}
        waiting = [root]
        while waiting:
            node = waiting.pop()
            self.nodes[node.path] = node
            waiting += node.children

    def of(self, acting: Acting) -> list[Combined]:
        """For each combination of their modes: its name, where leaf and plant are in it, and the step."""
        everywhere = everything(self.width)
        result: list[Combined] = [("", everywhere, everywhere, standing_still(self.width))]
        for path in acting:
            combined = []
            name = self.nodes[path].name
            for (label, when, where, step), (mode, seen, there, other) in product(result, self._one(path)):
                both = (when & seen, where & there)
                if (both[0] & both[1]).is_empty:
                    continue
                shown = f"{name} [{mode}]" if mode else name
                combined.append((f"{label} + {shown}" if label else shown, *both, self._together(step, other, path)))
            result = combined
        return result

    def _one(self, path: str) -> list[Combined]:
        everywhere = everything(self.width)
        if path in self.regions.arbitrary:
            still = standing_still(self.width)
            shorter = self.regions.arbitrary[path].shorter
            return [("anything", everywhere, everywhere, Step(still.maps, still.noise, shorter))]
        leaf = self.nodes[path].leaf
        assert leaf is not None
        modes = self.regions.plant.leaves[leaf.id].modes
        return [(mode.name, mode.when, mode.where, mode.step) for mode in modes]

    def _together(self, one: Step, other: Step, path: str) -> Step:
        """Two steps at once; each variable has one that moves it (Assumption 2)."""
        maps, noise, shorter = list(one.maps), list(one.noise), list(one.shorter)
        for index in range(self.width):
            if not other.moves(index):
                continue
            if one.moves(index):
                variable = self.regions.plant.variables[index].name
                raise CompileError(
                    self.nodes[path].place,
                    f"'{self.nodes[path].name}' moves {variable}, and so does another leaf that is RUNNING with it",
                    "children of a Parallel must control different variables",
                )
            maps[index], noise[index], shorter[index] = other.maps[index], other.noise[index], other.shorter[index]
        return Step(tuple(maps), tuple(noise), tuple(shorter))
