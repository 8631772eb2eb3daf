# SPDX-License-Identifier: MIT
"""Tree and model as pieces, each with one affine step: what a certificate speaks of. Read here by other means."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

from canopy.certificate.formula import (
    EVERYTHING,
    NOTHING,
    Part,
    Reader,
    RejectedError,
    Row,
    Sum,
    Union,
    join,
    meet,
    without,
)

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

S, R, F = "SUCCESS", "RUNNING", "FAILURE"
MAX_PIECES = 2_000
MAX_BYTES = 1024 * 1024
MAPPED = {"Inverter": {S: F, F: S}, "ForceSuccess": {F: S}, "ForceFailure": {S: F}, "KeepRunningUntilFailure": {S: R}}
Case = tuple[str, tuple[str, ...], Union]
"""Status, the paths of those who act, and where."""


@dataclass(frozen=True)
class Step:
    """The next value of each variable: its sum and a disturbance, or anything that is less than `shorter` away."""

    sums: tuple[Sum, ...]
    noise: tuple[tuple[Fraction, Fraction], ...]
    shorter: tuple[Fraction | None, ...]


@dataclass(frozen=True)
class Piece:
    """States in which the tree does one thing."""

    rows: Part
    status: str
    acting: tuple[str, ...]
    step: Step


@dataclass
class Node:
    """A node of the tree. `id`: of its leaf, or its type."""

    id: str
    kind: str
    name: str
    element: ElementTree.Element
    path: str = ""
    children: list[Node] = field(default_factory=list)


class Files:
    """Tree and model file."""

    def __init__(self, tree: Path, model: Path) -> None:
        for path in (tree, model):
            if path.stat().st_size > MAX_BYTES:
                raise RejectedError(f"{path} is too large")
        self.tree_bytes, self.model_bytes = tree.read_bytes(), model.read_bytes()
        if b"<!DOCTYPE" in self.tree_bytes:
            raise RejectedError("the tree has a document type")
        self.content: dict[str, Any] = tomllib.loads(self.model_bytes.decode(), parse_float=Fraction)
        self.names = list(self.content["variables"])
        self.reader = Reader(self.names)
        self.width = len(self.names)
        self.root, self.kinds = _tree(self.tree_bytes)
        ranges = [one["range"] for one in self.content["variables"].values()]
        rows = []
        for index, (low, high) in enumerate(ranges):
            unit = tuple(Fraction(int(i == index)) for i in range(self.width))
            rows += [Row(unit, Fraction(high), False), Row(tuple(-u for u in unit), -Fraction(low), False)]
        self.domain: Union = meet((tuple(rows),), EVERYTHING)

    def nodes(self) -> list[Node]:
        """All nodes."""
        result, waiting = [], [self.root]
        while waiting:
            node = waiting.pop()
            result.append(node)
            waiting += node.children
        return result

    def node(self, name: str) -> Node:
        """The one node with a path or a name."""
        found = [one for one in self.nodes() if one.path == name] or [one for one in self.nodes() if one.name == name]
        if len(found) != 1:
            raise RejectedError(f"there are {len(found)} nodes '{name}'")
        return found[0]


def _tree(text: bytes) -> tuple[Node, dict[str, tuple[str, tuple[str, ...]]]]:
    """The root, and the kind and declared statuses of each leaf."""
    root = ElementTree.fromstring(text)
    trees = {one.get("ID", ""): one for one in root.findall("BehaviorTree")}
    main = root.get("main_tree_to_execute", next(iter(trees)))
    if root.find("include") is not None or (len(trees) > 1 and "main_tree_to_execute" not in root.attrib):
        raise RejectedError("the tree includes files, or does not say which of its trees is the main one")
    kinds = {}
    for model in root.findall("TreeNodesModel/*"):
        metadata = {key: value for one in model.findall("MetadataFields/Metadata") for key, value in one.items()}
        kind = "Condition" if model.tag == "Condition" else metadata.get("kind", "StatefulAction")
        if model.tag in ("Action", "Condition"):
            kinds[model.get("ID", "")] = (kind, tuple(metadata.get("returns", "").split()))
    used: dict[str, int] = {}

    def made(element: ElementTree.Element) -> Node:
        extra = {
            key for key in element.attrib if key.startswith("_") and key not in ("_uid", "_description", "_fullpath")
        }
        if extra:
            raise RejectedError(f"<{element.tag}> has the script {min(extra)}")
        identity = element.get("ID", "") if element.tag in ("Action", "Condition") else element.tag
        name = element.get("name", identity)
        used[name] = used.get(name, 0) + 1
        path = f"{main}/{name}" + (f"::{used[name]}" if used[name] > 1 else "")
        return Node(identity, kinds[identity][0] if identity in kinds else identity, name, element, path)

    top = made(trees[main][0])
    waiting = [top]
    while waiting:  # the order in which canopy names nodes
        node = waiting.pop()
        for element in node.element:
            child = made(element)
            node.children.append(child)
            if len(element):
                waiting.append(child)
    return top, kinds


class Builder:
    """The pieces of a claim."""

    def __init__(self, files: Files, claim: dict[str, Any]) -> None:
        self.files, self.reader = files, files.reader
        self.root = files.node(claim["of"]) if "of" in claim else files.root
        self.arbitrary = {
            files.node(name).path: self._shorter(limit) for name, limit in claim.get("arbitrary", {}).items()
        }
        added = claim.get("disturbance", {})
        self.added = tuple((Fraction(low), Fraction(high)) for low, high in (added.get(n, (0, 0)) for n in files.names))

    def _shorter(self, raw: Any) -> tuple[Fraction | None, ...]:
        table = raw if isinstance(raw, dict) else dict.fromkeys(self.files.names, raw)
        return tuple(Fraction(table[name]) if name in table else None for name in self.files.names)

    def gaps(self) -> list[Part]:
        """What has to be empty for the pieces to be all there is: states without a region, RUNNING without a mode."""
        result: list[Part] = []
        width = self.files.width
        still = tuple(Sum(tuple(Fraction(int(i == k)) for i in range(width)), Fraction(0)) for k in range(width))
        for node in self.files.nodes():
            table = self.files.content["leaves"].get(node.id)
            if node.children or table is None:
                continue
            acts = self.files.domain
            if not table.get("free", False):
                regions = self._regions(table)
                rest = self.files.domain
                for one in regions.values():
                    rest = without(rest, one)
                result += rest
                acts = regions[R]
            if table.get("modes") or not table.get("free", False):
                for where, _ in self._modes(node.path, still):
                    acts = without(acts, where)
                result += acts
        return result

    def pieces(self) -> list[Piece]:
        """All pieces, in an order that depends on the files alone."""
        result = []
        for status, acting, where in self._cases(self.root):
            for there, step in self._steps(acting):
                result += [Piece(part, status, acting, step) for part in meet(where, there)]
        if len(result) > MAX_PIECES:
            raise RejectedError(f"there are more than {MAX_PIECES} pieces")
        return result

    def _cases(self, node: Node) -> list[Case]:
        if node.path in self.arbitrary:
            acting = (node.path,) if any(self.arbitrary[node.path]) else ()
            return [(status, acting, self.files.domain) for status in (S, R, F)]
        if not node.children:
            return self._leaf(node)
        made = [self._cases(child) for child in node.children]
        if node.id in ("ReactiveSequence", "ReactiveFallback"):
            return self._in_order(made, S if node.id == "ReactiveSequence" else F)
        if node.id == "ReactiveParallel":
            return self._parallel(made, int(node.element.get("success_count", "-1")))
        if node.id in MAPPED:
            return [(MAPPED[node.id].get(status, status), acting, where) for status, acting, where in made[0]]
        raise RejectedError(f"<{node.id}> cannot be certified")

    def _leaf(self, node: Node) -> list[Case]:
        if node.id in ("AlwaysSuccess", "AlwaysFailure"):
            return [(S if node.id == "AlwaysSuccess" else F, (), self.files.domain)]
        table = self.files.content["leaves"].get(node.id)
        if table is None or node.kind not in ("Condition", "SyncAction", "StatefulAction"):
            raise RejectedError(f"leaf '{node.id}' has no model")
        if table.get("free", False):
            kind = (S, R, F) if node.kind == "StatefulAction" else (S, F)
            declared = self.files.kinds[node.id][1] or kind
            if "SKIPPED" in declared:
                raise RejectedError(f"leaf '{node.id}' may return SKIPPED")
            acts = (node.path,) if table.get("modes") else ()
            return [(one, acts if one == R else (), self.files.domain) for one in kind if one in declared]
        regions = self._regions(table)
        return [(status, (node.path,) if status == R else (), regions[status]) for status in (S, R, F)]

    def _regions(self, table: dict[str, Any]) -> dict[str, Union]:
        texts = {status: table.get(status.lower(), "false") for status in (S, R, F)}
        regions = {
            status: meet(self.files.domain, self.reader.condition(text)) if text != "else" else NOTHING
            for status, text in texts.items()
        }
        rest = self.files.domain
        for one in tuple(regions.values()):
            rest = without(rest, one)
        for status, text in texts.items():
            regions[status] = rest if text == "else" else regions[status]
        return regions

    def _in_order(self, made: Sequence[list[Case]], goes_on: str) -> list[Case]:
        result: list[Case] = []
        reached: list[tuple[tuple[str, ...], Union]] = [((), self.files.domain)]
        for cases in made:
            following = []
            for (carried, where), (status, acting, formula) in product(reached, cases):
                both = meet(where, formula)
                together = tuple(dict.fromkeys((*carried, *acting)))
                if both and status == goes_on:
                    following.append((together, both))
                elif both:
                    result.append((status, together, both))
            reached = _gathered(following)
        return _merged([*result, *((goes_on, acting, where) for acting, where in reached)])

    def _parallel(self, made: Sequence[list[Case]], needed: int) -> list[Case]:
        count = len(made)
        needed = needed if needed >= 0 else count + needed + 1
        result: list[Case] = []
        for choice in product(*made):
            where = self.files.domain
            for _, _, formula in choice:
                where = meet(where, formula)
            statuses = [status for status, _, _ in choice]
            acting = tuple(dict.fromkeys(path for _, paths, _ in choice for path in paths))
            done = S if statuses.count(S) >= needed else F if statuses.count(F) > count - needed else R
            result.append((done, acting, where))
        return _merged(result)

    def _steps(self, acting: Iterable[str]) -> list[tuple[Union, Step]]:
        width = self.files.width
        still = tuple(Sum(tuple(Fraction(int(i == k)) for i in range(width)), Fraction(0)) for k in range(width))
        nothing = ((Fraction(0), Fraction(0)),) * width
        result: list[tuple[Union, Step]] = [(EVERYTHING, Step(still, nothing, (None,) * width))]
        for path in acting:
            result = [
                (meet(where, there), self._together(one, other, still))
                for (where, one), (there, other) in product(result, self._modes(path, still))
            ]
        return result

    def _modes(self, path: str, still: tuple[Sum, ...]) -> list[tuple[Union, Step]]:
        nothing = ((Fraction(0), Fraction(0)),) * len(still)
        if path in self.arbitrary:
            return [(EVERYTHING, Step(still, self._noise(nothing, still, self.arbitrary[path]), self.arbitrary[path]))]
        result = []
        for mode in self.files.content["leaves"][self.files.node(path).id].get("modes", []):
            given, disturbed = mode.get("next", {}), mode.get("disturbance", {})
            sums = tuple(self.reader.sum(given[n]) if n in given else still[i] for i, n in enumerate(self.files.names))
            noise = tuple((Fraction(a), Fraction(b)) for a, b in (disturbed.get(n, (0, 0)) for n in self.files.names))
            shorter = self._shorter(mode.get("shorter_than", {}))
            moved = tuple(
                (low + a, high + b) if sums[i] != still[i] or low or high or shorter[i] is not None else (low, high)
                for i, ((low, high), (a, b)) in enumerate(zip(noise, self.added, strict=True))
            )
            conditions = (self.reader.condition(mode.get(key, "true")) for key in ("when", "where"))
            result.append((meet(*conditions), Step(sums, moved, shorter)))
        return result

    def _noise(
        self, noise: tuple[tuple[Fraction, Fraction], ...], still: tuple[Sum, ...], shorter: tuple[Fraction | None, ...]
    ) -> tuple[tuple[Fraction, Fraction], ...]:
        return tuple(self.added[i] if shorter[i] is not None else noise[i] for i in range(len(still)))

    @staticmethod
    def _together(one: Step, other: Step, still: tuple[Sum, ...]) -> Step:
        sums, noise, shorter = list(one.sums), list(one.noise), list(one.shorter)
        for index, stays in enumerate(still):
            moves = [
                step.sums[index] != stays or any(step.noise[index]) or step.shorter[index] is not None
                for step in (one, other)
            ]
            if all(moves):
                raise RejectedError("two leaves move one variable")
            if moves[1]:
                sums[index], noise[index], shorter[index] = other.sums[index], other.noise[index], other.shorter[index]
        return Step(tuple(sums), tuple(noise), tuple(shorter))


def _gathered(cases: Iterable[tuple[tuple[str, ...], Union]]) -> list[tuple[tuple[str, ...], Union]]:
    """One entry for each set of acting nodes; their parts must not count twice."""
    result: dict[tuple[str, ...], Union] = {}
    for acting, where in cases:
        result[acting] = join(result[acting], where) if acting in result else where
    return list(result.items())


def _merged(cases: Iterable[Case]) -> list[Case]:
    gathered: dict[tuple[str, tuple[str, ...]], Union] = {}
    for status, acting, where in cases:
        if where:
            key = (status, acting)
            gathered[key] = join(gathered[key], where) if key in gathered else where
    return [(status, acting, where) for (status, acting), where in gathered.items()]
