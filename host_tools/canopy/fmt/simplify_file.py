# SPDX-License-Identifier: MIT
"""`canopy fmt --simplify` of a whole file: every tree in it, and every part that can be looked at by itself."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from pathlib import Path

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.port_types import ANY_TYPE
from canopy.compiler.tree_reader import read_tree
from canopy.convert.equivalence import Rules, Verdict
from canopy.files import read_bytes
from canopy.fmt.application_facts import (
    ClauseRules,
    Facts,
    Threshold,
    declared_thresholds,
    derived,
    read_facts,
    read_threshold,
)
from canopy.fmt.document import Content, Element, read_document
from canopy.fmt.simplify import MAX_NODES, equivalent, simplify
from canopy.fmt.terms import Knowledge, Term, child_elements, comments, read_term, to_element
from canopy.fmt.writer import write_document

WHOLE_LIMIT = 10_000
"""Cases of the last comparison, of the whole before with the whole after."""


@dataclass
class Report:
    """What was done to one tree."""

    tree: str
    before: int
    after: int
    steps: int
    cases: int
    verdict: Verdict
    left: str

    def __str__(self) -> str:
        done = f"{self.before} nodes, {self.after} after {self.steps} proved steps ({self.cases} cases)"
        return f"{self.tree}: {done}; as a whole {self.verdict}{self.left}"


@dataclass
class Work:
    """One file: what is known of its leaves, and what was done."""

    path: Path
    knowledge: Knowledge
    facts: Facts
    reports: list[Report] = field(default_factory=list)

    def rules(self, term: Term) -> Rules:
        """The facts, with what follows from the thresholds in this term and in the leaves' declarations."""
        found: dict[Hashable, Threshold] = declared_thresholds(self.knowledge.leaves)
        for part in term.walk():
            if part.atom is not None and part.kind == "ScriptCondition" and part.atom.pure:
                threshold = read_threshold(dict(part.atom.element.attributes).get("code", ""))
                if threshold is not None:
                    found[part.atom.key] = threshold
        return ClauseRules(self.facts.clauses | derived(found))

    def tree(self, top: Element, name: str) -> None:
        """Simplifies the node of a <BehaviorTree>, or of a node that is not looked into."""
        children: list[Content] = []
        for child in top.children:
            children += self._node(child, name) if isinstance(child, Element) else [child]
        top.children = children

    def _node(self, element: Element, name: str) -> list[Content]:
        """What stands in an element's place: the comments of what was rewritten, and the smaller element."""
        before = read_term(element, self.knowledge)
        if before.size() > MAX_NODES:
            raise CompileError(
                Place(str(self.path)),
                f"a part of tree '{name}' has {before.size()} nodes, too many to be simplified",
                f"at most {MAX_NODES}: make subtrees of it, or format it without --simplify",
            )
        rules = self.rules(before)
        try:
            result = simplify(before, rules)
        except ValueError as error:
            raise CompileError(
                Place(str(self.path)), f"tree '{name}': {error}", "correct the facts, or `returns`"
            ) from error
        left = f"; {result.unproved} steps would take too long to prove" if result.unproved else ""
        left += "; not all steps were tried: the tree is too large" if result.is_exhausted else ""
        kept: list[Content] = []
        if result.steps:
            verdict = equivalent(before, result.term, rules, WHOLE_LIMIT, walk=True)
            if verdict.difference is not None:
                raise AssertionError(f"steps that are right make a tree that is not: {verdict.difference}")
            counts = (before.size(), result.term.size(), result.steps, result.cases)
            self.reports.append(Report(name, *counts, verdict, left))
            kept = comments(element)
            element = to_element(result.term)
        self._inside(result.term, name)
        return [*kept, element]

    def _inside(self, term: Term, name: str) -> None:
        """What stands below nodes that are not looked into: each child by itself."""
        for part in term.walk():
            if part.atom is not None and child_elements(part.atom.element):
                self.tree(part.atom.element, f"{name}/{part.atom.name}")


def simplify_bytes(path: Path, facts_file: Path | None) -> tuple[bytes, list[Report]]:
    """The canonical form of a file with its trees simplified, and what was done to each tree.

    Raises:
        CompileError: `canopy compile` would refuse the file, or the facts are not about its leaves.
    """
    leaves = read_tree(path, ANY_TYPE).leaves
    facts = read_facts(facts_file, leaves) if facts_file is not None else Facts()
    document = read_document(read_bytes(path), str(path))
    work = Work(path, Knowledge(leaves, facts.returns, frozenset(facts.memoryless)), facts)
    for root in document.content:
        for tree in child_elements(root) if isinstance(root, Element) else ():
            if tree.tag == "BehaviorTree":
                work.tree(tree, dict(tree.attributes).get("ID", "BehaviorTree"))
    return write_document(document).encode(), work.reports
