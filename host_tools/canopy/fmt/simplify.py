# SPDX-License-Identifier: MIT
"""Makes a tree smaller without changing what it does: every step is proved before it is taken.

The steps are guesses: a child that may be of no account, two branches that may share their end. What decides is the
comparison of the tree before and after in the reference model, over all states and all answers that the facts allow. It
is made for the smallest part of the tree that has the step in it, then for the parts around it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from canopy.convert.equivalence import Rules, Shown, Verdict, compare
from canopy.convert.machine import TreeMachine, Use
from canopy.fmt.terms import DECORATORS, IN_ORDER, Term, to_runnable
from canopy.semantics.spec import HALTED, START

PROOF_LIMIT = 2_000
"""Cases of one proof. What takes more is not done."""
BUDGET = 100_000
"""Cases of all proofs for one tree: some ten seconds to a minute. After that no further step is tried."""
MAX_NODES = 300
"""Nodes of a tree that is looked at: the steps that are tried grow with its square."""

Path = tuple[int, ...]
"""The way from the root to a node: the places among the children."""


def at(term: Term, path: Path) -> Term:
    """The node at the end of a path."""
    for place in path:
        term = term.children[place]
    return term


def put(term: Term, path: Path, new: Term) -> Term:
    """The tree with another node at the end of a path."""
    if not path:
        return new
    first, rest = path[0], path[1:]
    children = list(term.children)
    children[first] = put(children[first], rest, new)
    return replace(term, children=tuple(children))


def _show(memoryless: frozenset[object]) -> Callable[[int, Sequence[tuple[Use, int]]], Shown]:
    """What an observer sees: calls in order. Of a leaf without memory, only that it is ticked."""

    def show(status: int, calls: Sequence[tuple[Use, int]]) -> Shown:
        seen = []
        for use, kind in calls:
            if use.pure:
                continue
            if use.key in memoryless:
                if kind != HALTED:
                    seen.append((use.key, START))
            else:
                seen.append((use.key, kind))
        return status, tuple(seen)

    return show


def equivalent(one: Term, other: Term, rules: Rules, limit: int = PROOF_LIMIT, *, walk: bool = False) -> Verdict:
    """Compares two terms, for everything that their leaves can do, and for being halted from above at any time."""
    memoryless = frozenset(
        term.atom.key for root in (one, other) for term in root.walk() if term.atom is not None and term.atom.memoryless
    )
    machines = [TreeMachine(to_runnable(term), _show(memoryless), part=True) for term in (one, other)]
    return compare(machines[0], machines[1], rules, limit=limit, walk=walk)


def _collapsed(term: Term, children: Sequence[Term]) -> Term | None:
    """The node with these children: none, if it has none; its only child, unless it was given a name."""
    if not children:
        return None
    if len(children) == 1 and term.kind in IN_ORDER and not term.kept:
        return children[0]
    return replace(term, children=tuple(children))


def _flattened(term: Term) -> Iterator[Term]:
    """A Sequence in a Sequence, a Fallback in a Fallback; a node with one child."""
    if term.kind not in IN_ORDER:
        return
    if len(term.children) == 1 and not term.kept:
        yield term.children[0]
    for place, child in enumerate(term.children):
        if child.kind == term.kind and not child.kept:
            yield replace(term, children=term.children[:place] + child.children + term.children[place + 1 :])


def _without_one(term: Term) -> Iterator[Term]:
    """Without one of its children, the last ones first: what a later one does, too, is done there."""
    if term.kind in IN_ORDER and len(term.children) > 1:
        for place in reversed(range(len(term.children))):
            shorter = _collapsed(term, term.children[:place] + term.children[place + 1 :])
            assert shorter is not None
            yield shorter
    elif term.kind in DECORATORS and not term.kept:
        yield term.children[0]
        if term.kind == "Inverter" and term.children[0].kind == "Inverter":
            yield term.children[0].children[0]
    elif term.kind in ("WhileDoElse", "IfThenElse"):
        yield from term.children[1:]
        if len(term.children) == 3:
            yield replace(term, children=term.children[:2])


_DUAL = {
    "ReactiveFallback": "ReactiveSequence",
    "ReactiveSequence": "ReactiveFallback",
    "Fallback": "Sequence",
    "Sequence": "Fallback",
}


def _same(one: Term, other: Term) -> bool:
    """Can nobody tell the two apart?"""
    if one.kind != other.kind or len(one.children) != len(other.children):
        return False
    if one.atom is not None and other.atom is not None:
        shared = one.atom.pure or one.atom.memoryless
        return one.atom.element is other.atom.element or (shared and one.atom.key == other.atom.key)
    return (one.atom is None) == (other.atom is None) and all(map(_same, one.children, other.children))


def _factored(term: Term) -> Iterator[Term]:
    """Fallback(Sequence(a, x), Sequence(b, x)) as Sequence(Fallback(a, b), x), and the like with the first child."""
    inner = _DUAL.get(term.kind)
    for place in range(len(term.children) - 1) if inner is not None else ():
        one, other = term.children[place : place + 2]
        if one.kind != inner or other.kind != inner or one.kept or other.kept:
            continue
        for end in (-1, 0):
            if not _same(one.children[end], other.children[end]):
                continue
            rests = [part.children[:-1] if end else part.children[1:] for part in (one, other)]
            left = [
                _collapsed(replace(part, attributes=()), rest) for part, rest in zip((one, other), rests, strict=True)
            ]
            if left[0] is None or left[1] is None:
                continue
            shared = Term(term.kind, (left[0], left[1]))
            both = (shared, one.children[-1]) if end else (one.children[0], shared)
            joined = Term(inner or "", both)
            children = (*term.children[:place], joined, *term.children[place + 2 :])
            yield joined if len(children) == 1 and not term.kept else replace(term, children=children)


def _ordered(term: Term) -> Iterator[Term]:
    """Of two neighbours that only ask, the smaller one first: it may spare the larger one."""
    for place in range(len(term.children) - 1) if term.kind in IN_ORDER else ():
        one, other = term.children[place : place + 2]
        if one.is_pure and other.is_pure and other.size() < one.size():
            yield replace(term, children=(*term.children[:place], other, one, *term.children[place + 2 :]))


@dataclass
class Simplified:
    """The result: the smaller tree, how many steps were taken, and how many cases their proofs compared."""

    term: Term
    steps: int = 0
    cases: int = 0
    unproved: int = 0
    """Steps that may be right, but would have taken too many cases to prove."""
    is_exhausted: bool = False
    """The budget was used up before all steps had been tried."""


class _Search:
    def __init__(self, term: Term, rules: Rules) -> None:
        self.result = Simplified(term)
        self._rules = rules
        self._not_proved: set[tuple[Term, Term]] = set()

    def _paths(self) -> list[Path]:
        """Every node, the deepest first."""
        found: list[Path] = []
        waiting: list[tuple[Path, Term]] = [((), self.result.term)]
        while waiting:
            path, term = waiting.pop()
            found.append(path)
            waiting += [((*path, place), child) for place, child in enumerate(term.children)]
        return sorted(found, key=lambda path: (-len(path), path))

    def _is_right(self, path: Path, new: Term) -> bool:
        """Is the whole tree the same with `new` at the end of the path?"""
        for length in range(len(path), -1, -1):
            before = at(self.result.term, path[:length])
            after = put(before, path[length:], new)
            if (before, after) in self._not_proved:
                continue
            if self.result.cases > BUDGET:
                self.result.is_exhausted = True
                return False
            verdict = equivalent(before, after, self._rules)
            self.result.cases += verdict.cases
            if verdict.difference is None and verdict.exhaustive:
                return True
            self._not_proved.add((before, after))
            if verdict.difference is None:  # the parts around it have more to try
                self.result.unproved += 1
                return False
        return False

    def step(self) -> bool:
        """Takes one step, if there is one that is right."""
        for guesses in (_flattened, _without_one, _factored, _ordered):
            for path in self._paths():
                for new in guesses(at(self.result.term, path)):
                    if self._is_right(path, new):
                        self.result.term = put(self.result.term, path, new)
                        self.result.steps += 1
                        return True
        return False


def simplify(term: Term, rules: Rules) -> Simplified:
    """The smallest tree that the steps lead to. A tree of more than MAX_NODES nodes stays as it is."""
    search = _Search(term, rules)
    if term.size() <= MAX_NODES:
        while search.step():
            pass
    return search.result
