# SPDX-License-Identifier: MIT
"""Trees as `canopy fmt --simplify` rewrites them: terms over the elements of a file, and terms as runnable trees."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass

from canopy.check.status_sets import LEAVES
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.script.syntax import Assignment, Name, ScriptError, parse, parts
from canopy.compiler.tree_reader import CONDITION_ATTRIBUTES, EXPLICIT
from canopy.convert.machine import RunnableTree, Use
from canopy.convert.read_back import STATUS_OF
from canopy.fmt.document import Content, Element, Markup
from canopy.semantics.spec import FAILURE, RUNNING, SUCCESS, Spec

IN_ORDER = ("ReactiveSequence", "ReactiveFallback", "Sequence", "Fallback")
BRANCHES = ("WhileDoElse", "IfThenElse")
DECORATORS = ("Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure")
CONSTANT = ("AlwaysSuccess", "AlwaysFailure")
_MAY_SKIP = ("SubTree", "RunOnce", "SkipUnlessUpdated", "Precondition", "TestNode")
# Attributes that editors write and nobody reads.
_OF_EDITORS = ("_uid", "_fullpath")


@dataclass(frozen=True, eq=False)
class Atom:
    """What is not looked into: a leaf, or a node that is not rewritten with all that is below it.

    `key`: equal for two uses of which nobody can tell which one was asked. `pure`: it only reads.
    """

    element: Element
    name: str
    key: Hashable
    statuses: tuple[int, ...]
    pure: bool
    memoryless: bool = False


@dataclass(frozen=True)
class Term:
    """A node: its kind, its children, and its element's attributes; or an atom. `kept`: it has a name, or a remark."""

    kind: str
    children: tuple[Term, ...] = ()
    attributes: tuple[tuple[str, str], ...] = ()
    atom: Atom | None = None

    @property
    def kept(self) -> bool:
        """Somebody has given it a name or written a remark to it: it is not dissolved into its parent."""
        return any(name not in (*_OF_EDITORS, "ID") for name, _ in self.attributes)

    def size(self) -> int:
        """Number of nodes."""
        return sum(1 for _ in self.walk())

    def walk(self) -> Iterator[Term]:
        """This node and all below it, depth first."""
        waiting = [self]
        while waiting:
            term = waiting.pop()
            yield term
            waiting.extend(reversed(term.children))

    @property
    def is_pure(self) -> bool:
        """Nothing below it acts."""
        return all(term.atom is None or term.atom.pure for term in self.walk())


@dataclass(frozen=True)
class Knowledge:
    """What is known of the leaves: their declarations, and what the application's facts say of them."""

    leaves: Mapping[str, Leaf]
    returns: Mapping[str, tuple[int, ...]]
    memoryless: frozenset[str]


def kind_of(element: Element) -> str:
    """A node's type or leaf's ID: of <Control ID="Sequence"> it is Sequence."""
    if element.tag in EXPLICIT:
        return dict(element.attributes).get("ID", "")
    return element.tag


def child_elements(element: Element) -> list[Element]:
    """The nodes inside a node."""
    return [child for child in element.children if isinstance(child, Element)]


def _asks_only_signals(text: str) -> bool:
    try:
        every = [part for statement in parse(text) for part in parts(statement)]
    except ScriptError:
        return False
    if any(isinstance(part, Assignment) for part in every):
        return False
    return all("." in part.name for part in every if isinstance(part, Name))


def may_be_skipped(element: Element, knowledge: Knowledge) -> bool:
    """Can the node, or one inside it, return SKIPPED? Yes when it is not known."""
    waiting = [element]
    while waiting:
        here = waiting.pop()
        kind = kind_of(here)
        leaf = knowledge.leaves.get(kind)
        names = [name for name, _ in here.attributes]
        if "_skipIf" in names or "_while" in names or kind in _MAY_SKIP or kind.startswith(("Loop", "Switch")):
            return True
        if leaf is not None and (leaf.is_inner or "SKIPPED" in leaf.returns):
            return True
        waiting += child_elements(here)
    return False


def _leaf_atom(element: Element, leaf: Leaf, knowledge: Knowledge) -> Atom:
    attributes = {name: value for name, value in element.attributes if not name.startswith("_") and name != "name"}
    attributes.pop("ID", None)
    declared = [STATUS_OF[status] for status in leaf.returns or LEAVES[leaf.kind]]
    statuses = set(knowledge.returns.get(leaf.id, tuple(declared)))
    if leaf.reads:
        statuses.add(STATUS_OF[leaf.stale])
    fixed = leaf.state is None and not any("{" in value for value in attributes.values())
    pure = leaf.kind == "Condition" and fixed
    memoryless = leaf.id in knowledge.memoryless
    same: Hashable = (leaf.id, tuple(sorted(attributes.items())))
    return Atom(
        element, leaf.id, same if pure or memoryless else id(element), tuple(sorted(statuses)), pure, memoryless
    )


def read_term(element: Element, knowledge: Knowledge) -> Term:
    """The term of an element. What cannot be modelled is an atom; `inner_roots()` finds what can be inside it."""
    kind = kind_of(element)
    leaf = knowledge.leaves.get(kind)
    scripted = any(name in CONDITION_ATTRIBUTES for name, _ in element.attributes)
    if leaf is not None and not leaf.is_inner and not scripted and leaf.kind in LEAVES:
        return Term(kind, (), (), _leaf_atom(element, leaf, knowledge))
    if kind == "ScriptCondition" and not scripted:
        code = dict(element.attributes).get("code", "")
        pure = _asks_only_signals(code)
        key: Hashable = ("script", code) if pure else id(element)
        return Term(kind, (), (), Atom(element, f'"{code}"', key, (SUCCESS, FAILURE), pure))
    inside = child_elements(element)
    modelled = kind in (*IN_ORDER, *BRANCHES, *DECORATORS, *CONSTANT) and not scripted
    if not modelled or any(may_be_skipped(child, knowledge) for child in inside):
        return Term(kind, (), (), Atom(element, kind, id(element), (RUNNING, SUCCESS, FAILURE), False))
    return Term(kind, tuple(read_term(child, knowledge) for child in inside), tuple(element.attributes))


def to_element(term: Term) -> Element:
    """The element of a term; an atom's is the one that it was read from."""
    if term.atom is not None:
        return term.atom.element
    tag = term.kind
    if any(name == "ID" for name, _ in term.attributes):
        tag = "Decorator" if term.kind in DECORATORS else "Action" if term.kind in CONSTANT else "Control"
    return Element(tag, list(term.attributes), [to_element(child) for child in term.children])


def comments(element: Element) -> list[Content]:
    """The comments inside a node, outside of its atoms' elements."""
    found: list[Content] = [part for part in element.children if isinstance(part, Markup)]
    for child in child_elements(element):
        found += comments(child)
    return found


def to_runnable(term: Term) -> RunnableTree:
    """The term as a tree of the reference model."""
    uses: dict[int, Use] = {}
    count = 0

    def spec(here: Term) -> Spec:
        nonlocal count
        number = count
        count += 1
        atom = here.atom
        if atom is None:
            return Spec(here.kind, [spec(child) for child in here.children])
        uses[number] = Use(atom.name, atom.key, atom.statuses, atom.pure)
        if atom.pure:
            return Spec("Condition", [])
        return Spec("StatefulAction" if RUNNING in atom.statuses else "SyncAction", [])

    return RunnableTree(spec(term), uses)
