# SPDX-License-Identifier: MIT
"""What a rule is, and the list into which the rules of canopy.check.rules put themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum

from canopy.check.facts import Facts
from canopy.compiler.errors import Place
from canopy.compiler.tree_reader import Node


class Severity(IntEnum):
    """How much a finding matters. SARIF's names, in lower case."""

    NOTE = 1
    WARNING = 2
    ERROR = 3

    @property
    def label(self) -> str:
        """As users write and read it."""
        return self.name.lower()


@dataclass(frozen=True)
class Hit:
    """What a rule reports: a place, its node if there is one, what is wrong, a sharper way out than the rule's."""

    place: Place
    message: str
    help_text: str = ""
    node: Node | None = None


def hit(node: Node, message: str, help_text: str = "") -> Hit:
    """A Hit at a node."""
    return Hit(node.place, message, help_text, node)


@dataclass(frozen=True)
class Rule:
    """One rule. `why` and `way_out` are what the documentation and SARIF say about it."""

    id: str
    severity: Severity
    title: str
    why: str
    way_out: str
    run: Callable[[Facts], Iterator[Hit]]


RULES: dict[str, Rule] = {}

_Check = Callable[[Facts], Iterator[Hit]]


def rule(rule_id: str, severity: Severity, title: str, *, why: str, way_out: str) -> Callable[[_Check], _Check]:
    """Puts a function into the list of rules."""

    def register(run: _Check) -> _Check:
        assert rule_id not in RULES, rule_id
        RULES[rule_id] = Rule(rule_id, severity, title, why, way_out, run)
        return run

    return register
