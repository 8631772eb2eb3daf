# SPDX-License-Identifier: MIT
"""Reads a tree, asks every rule, and leaves out what the tree's author has allowed.

A node allows a rule with a marker in its `_description`, which editors show and keep:

    <ForceSuccess _description="canopy:allow hidden-failure: waving is only polite">
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from canopy.check.bus_facts import BusFacts
from canopy.check.facts import Facts, TooLargeError, elements_by_place
from canopy.check.registry import Hit, Rule
from canopy.check.rules import all_rules
from canopy.check.rules.declarations import writing_conditions
from canopy.compiler.emit import load_application
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.port_types import Options
from canopy.compiler.tree_reader import Tree, read_tree, read_unused_trees
from canopy.compiler.xml_reader import Element

_ALLOW = re.compile(r"canopy:allow\s+([\w-]+(?:\s*,\s*[\w-]+)*)")
_BITRATE = 500_000
OF_THE_WHOLE = ("root-can-fail", "condition-writes", "unused-port", "unused-tree", "refused-name")


@dataclass(frozen=True)
class Finding:
    """One hit of one rule."""

    rule: Rule
    place: Place
    message: str
    help_text: str
    node: str | None

    def __str__(self) -> str:
        return f"{self.place}: {self.rule.severity.label}: {self.message} [{self.rule.id}]\n  help: {self.help_text}"


@dataclass
class Report:
    """What was found in some files, and how many findings their authors have allowed."""

    findings: list[Finding] = field(default_factory=list)
    allowed: int = 0
    note: str = ""


@dataclass(frozen=True)
class BusOptions:
    """The bus that the names of signals are checked against."""

    dbc: Path
    node: str
    period_ms: int = 1


def _allowed(element: Element) -> set[str]:
    return _markers(
        " ".join((element.attributes.get("_description", ""), element.attributes.get("description", ""), element.text)),
        element.place,
    )


def _markers(text: str, place: Place) -> set[str]:
    found = {name.strip() for match in _ALLOW.finditer(text) for name in match[1].split(",")}
    for name in sorted(found - all_rules().keys()):
        raise CompileError(place, f"canopy:allow: no rule '{name}'", nearest(name, all_rules()))
    return found


def _finding(rule: Rule, hit: Hit) -> Finding:
    return Finding(rule, hit.place, hit.message, hit.help_text or rule.way_out, hit.node.name if hit.node else None)


def _load(path: Path, bus: BusOptions | None, types: Options) -> Facts:
    if bus is None:
        return Facts(read_tree(path, types))
    application = load_application(
        "check", path, bus.dbc, bus.node, bus.period_ms, _BITRATE, types.include, options=types
    )
    return Facts(application.table.tree, BusFacts(application.bus, bus.period_ms))


def _refused(path: Path, rules: Iterable[Rule], error: CompileError) -> list[Finding]:
    """The findings that explain why the compiler refuses the file; raises its error when none does."""
    hits = [
        hit
        for element in elements_by_place(path).values()
        if element.tag == "TreeNodesModel"
        for hit in writing_conditions(element)
    ]
    if error.place not in [hit.place for hit in hits]:
        raise error
    rule = all_rules()["condition-writes"]
    return [_finding(rule, hit) for hit in hits] if rule in rules else []


def _ask(rule: Rule, facts: Facts) -> Iterator[tuple[Rule, Hit]]:
    """What a rule finds; where the tree is too large for it, that."""
    facts.begin_rule()
    try:
        for hit in rule.run(facts):
            facts.spend()
            yield rule, hit
    except TooLargeError:
        root = facts.tree.root
        message = f"the tree '{facts.tree.id}' is too large for this rule, which looked at a part of it only"
        yield rule, Hit(root.place, message, "Divide the tree, or leave the rule out: --disable.")


def _unused(tree: Tree, types: Options, rules: list[Rule]) -> Iterator[tuple[Rule, Hit]]:
    """What `rules` find in the file's trees that are no part of its main tree; or why one would not compile."""
    for tree_id, found in read_unused_trees(tree.path, types, tree):
        if isinstance(found, CompileError):
            why = f"tree '{tree_id}' is not used, and would not compile: {found.message}"
            yield all_rules()["unused-tree"], Hit(found.place, why, found.help_text)
            continue
        facts = Facts(found)
        for rule in rules:
            if rule.id not in OF_THE_WHOLE:
                yield from _ask(rule, facts)


def check(path: Path, rules: Iterable[Rule], bus: BusOptions | None = None, types: Options | None = None) -> Report:
    """Asks `rules` about the tree in a file; findings in the order of the file. `types`: as for the compiler.

    Raises:
        CompileError: the tree or the bus cannot be compiled, or a canopy:allow names no rule.
    """
    wanted = list(rules)
    report = Report()
    types = replace(types or Options(), undeclared=True)
    try:
        facts = _load(path, bus, types)
    except CompileError as error:
        report.findings = _refused(path, wanted, error)
        return report
    report.note = facts.tree.foreign.note()
    files = dict.fromkeys([str(path), *(node.place.file for node in facts.nodes)])
    allowed = {element.place: _allowed(element) for file in files for element in facts.elements(file)}
    for places, comment in facts.bus.comments() if facts.bus is not None else ():
        for place in places:
            allowed[place] = allowed.get(place, set()) | _markers(comment, place)
    hits = [found for rule in wanted for found in _ask(rule, facts)]
    if any(rule.id == "unused-tree" for rule in wanted):
        hits += _unused(facts.tree, types, wanted)
    seen: set[tuple[str, Place, str]] = set()  # a tree that is part of two others is seen twice
    for rule, hit in hits:
        if rule.id in allowed.get(hit.place, ()):
            report.allowed += 1
        elif (rule.id, hit.place, hit.message) not in seen:
            report.findings.append(_finding(rule, hit))
            seen.add((rule.id, hit.place, hit.message))
    report.findings.sort(key=lambda f: (f.place.file, f.place.line, f.place.column, -f.rule.severity, f.rule.id))
    return report
