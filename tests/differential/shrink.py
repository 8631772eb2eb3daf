# SPDX-License-Identifier: MIT
"""Makes a failing tree small: fewer ticks, fewer nodes, plainer answers, as long as it still fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from canopy.semantics.spec import SUCCESS, Spec
from differential.tree import SHAPES, Tree

ATTEMPTS_MAX = 1500

_COUNTS = ("success_count", "failure_count", "max_failures")


def _with_children(spec: Spec, children: list[Spec]) -> Spec:
    """The same node with other children; thresholds are kept within their number."""
    limit = len(children)
    parameters = tuple(
        max(-limit, min(limit, value)) if name in _COUNTS else value
        for name, value in zip(SHAPES[spec.kind].parameters, spec.parameters, strict=True)
    )
    return replace(spec, children=children, parameters=parameters)


def _smaller(spec: Spec, ticks: int) -> Iterator[Spec]:
    """Trees that are a step smaller, those first that save most."""
    yield from spec.children
    if spec.children and spec.kind != "Condition":
        yield Spec("Condition", [], (), bytes([SUCCESS]) * ticks)
    if len(spec.children) > SHAPES[spec.kind].least:
        for index in range(len(spec.children)):
            yield _with_children(spec, spec.children[:index] + spec.children[index + 1 :])
    for index, child in enumerate(spec.children):
        for smaller in _smaller(child, ticks):
            yield _with_children(spec, [*spec.children[:index], smaller, *spec.children[index + 1 :]])
    for index, script in enumerate(spec.scripts):
        if script is not None and spec.kind == "Attributes":
            yield replace(spec, scripts=(*spec.scripts[:index], None, *spec.scripts[index + 1 :]))
    for index, answer in enumerate(spec.answers):
        if answer != SUCCESS:
            yield replace(spec, answers=spec.answers[:index] + bytes([SUCCESS]) + spec.answers[index + 1 :])


def _cut(spec: Spec, first: int, last: int) -> Spec:
    return replace(
        spec, children=[_cut(child, first, last) for child in spec.children], answers=spec.answers[first:last]
    )


def _candidates(tree: Tree) -> Iterator[Tree]:
    ticks = len(tree.times)
    if tree.halt_after is not None:
        yield replace(tree, halt_after=None)
    halt = tree.halt_after
    for last in sorted({1, ticks // 4, ticks // 2, ticks - 1}):
        if 0 < last < ticks:
            kept = halt if halt is not None and halt <= last else None
            yield Tree(_cut(tree.root, 0, last), tree.times[:last], kept)
    for first in (ticks // 2, 1):
        if 0 < first < ticks and (halt is None or halt > first):
            kept = None if halt is None else halt - first
            yield Tree(_cut(tree.root, first, ticks), tree.times[first:], kept)
    for root in _smaller(tree.root, ticks):
        yield replace(tree, root=root)


def shrink(tree: Tree, fails: Callable[[Tree], bool]) -> Tree:
    """A small tree for which `fails` still holds; takes the first step that keeps it failing, again and again."""
    attempts = 0
    found = True
    while found:
        found = False
        for candidate in _candidates(tree):
            attempts += 1
            if attempts > ATTEMPTS_MAX:
                return tree
            if fails(candidate):
                tree, found = candidate, True
                break
    return tree
