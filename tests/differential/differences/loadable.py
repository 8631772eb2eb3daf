# SPDX-License-Identifier: MIT
"""Which trees BehaviorTree.CPP loads."""

from __future__ import annotations

from canopy.semantics.spec import Spec
from differential.tree import Tree


def _element(spec: Spec) -> Spec:
    """What the XML has in its place: Attributes are not an element, but stand on the one below."""
    while spec.kind == "Attributes":
        spec = spec.children[0]
    return spec


def can_load(tree: Tree) -> bool:
    """Whether BehaviorTree.CPP accepts the tree: a ReactiveSequence may have one child that is an AsyncSequence."""
    return all(
        spec.kind != "ReactiveSequence" or [_element(child).kind for child in spec.children].count("AsyncSequence") < 2
        for spec in tree.root.walk()
    )
