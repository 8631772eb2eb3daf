# SPDX-License-Identifier: MIT
"""`canopy fmt --to-4`: files of BehaviorTree.CPP 2 and 3 in format 4, and what that changes in meaning.

Names, attributes and the ports of SubTrees are written anew; what cannot be converted is named. Comments stay.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from canopy.compiler.scripted import POSTCONDITIONS, PRECONDITIONS
from canopy.fmt.document import Document, Element
from canopy.tree.node_id import EXPLICIT

# Old name -> new name, and what a reader has to know.
_NODES = {
    "SequenceStar": ("SequenceWithMemory", ""),
    "RetryUntilSuccesful": ("RetryUntilSuccessful", ""),
    "SubTreePlus": ("SubTree", ""),
    "SubtreePlus": ("SubTree", ""),
    "Subtree": ("SubTree", ""),
    "FallbackStar": ("Fallback", "FallbackStar went on at its RUNNING child, as Fallback does in format 4"),
    "SelectorStar": ("Fallback", "SelectorStar went on at its RUNNING child, as Fallback does in format 4"),
    "Selector": ("Fallback", "in format 4 a Fallback goes on at its RUNNING child; ReactiveFallback asks all again"),
    "Negation": ("Inverter", ""),
}
_ATTRIBUTES = {
    ("Parallel", "threshold"): "success_count",
    ("Parallel", "success_threshold"): "success_count",
    ("Parallel", "failure_threshold"): "failure_count",
    ("SubTree", "__autoremap"): "_autoremap",
}
_LEFT = {
    "ConsumeQueue": "is left as it is: use a Loop node, LoopDouble or another one",
    "ManualSelector": "is left as it is: it asks a person at a terminal",
}
_CHECKS = re.compile(r"BlackboardCheck(Int|Double|Bool|String)")
_OLD_POINTER = re.compile(r"\$\{([^{}]*)\}")
_REFUSED = re.compile(r"[\s<>&\"'/\\:*?|.]")
_ONE_CYCLE = ("Repeat", "RetryUntilSuccessful", "RetryUntilSuccesful")


class _Converter:
    def __init__(self, root: Element) -> None:
        self._root = root
        self.said: dict[str, None] = {}

    def _say(self, element: Element, text: str) -> None:
        self.said.setdefault(f"line {element.line}: {text}")

    def convert(self) -> None:
        """Everything, in the order of the file."""
        names = self._tree_names()
        waiting = [self._root]
        while waiting:
            element = waiting.pop()
            waiting.extend(child for child in reversed(element.children) if isinstance(child, Element))
            if element.tag == "root":
                kept = [pair for pair in element.attributes if pair[0] != "BTCPP_format"]
                main = [(name, names.get(value, value) if name.startswith("main_") else value) for name, value in kept]
                element.attributes = [("BTCPP_format", "4"), *main]
            elif element.tag == "BehaviorTree":
                element.attributes = [(n, names.get(v, v) if n == "ID" else v) for n, v in element.attributes]
            else:
                self._node(element, names)

    def _tree_names(self) -> dict[str, str]:
        """Names of trees that BehaviorTree.CPP 4.9 and later refuse, and the new ones."""
        trees = [child for child in self._root.children if isinstance(child, Element) and child.tag == "BehaviorTree"]
        known = {dict(tree.attributes).get("ID", "") for tree in trees}
        names = {}
        for tree in trees:
            old = dict(tree.attributes).get("ID", "")
            new = _REFUSED.sub("_", old)
            if new != old and new not in known:
                names[old] = new
                known.add(new)
                self._say(tree, f"tree '{old}' is called '{new}': BehaviorTree.CPP 4.9 and later refuse the old name")
        return names

    def _node(self, element: Element, names: dict[str, str]) -> None:
        attributes = dict(element.attributes)
        old = attributes.get("ID", "") if element.tag in EXPLICIT else element.tag
        if old in _NODES:
            new, meaning = _NODES[old]
            if element.tag in EXPLICIT:
                element.attributes = [(n, new if n == "ID" else v) for n, v in element.attributes]
            else:
                element.tag = new
            self._say(element, f"{old} is {new}" + (f"; {meaning}" if meaning else ""))
        if old in _LEFT:
            self._say(element, f"{old} {_LEFT[old]}")
        if old in _ONE_CYCLE:
            self._say(element, f"{old}: BehaviorTree.CPP 3 may do several cycles in one tick, Canopy does one")
        if _CHECKS.fullmatch(old) and any(isinstance(child, Element) for child in element.children):
            self._check(element, old)
        if element.tag == "SubTree":
            self._subtree(element, old, names)
        else:
            self._ports(element, element.tag if element.tag not in EXPLICIT else old)

    def _ports(self, element: Element, name: str) -> None:
        renamed = []
        for attribute, value in element.attributes:
            new = _ATTRIBUTES.get((name, attribute), attribute)
            if new != attribute:
                self._say(element, f"{name}: {attribute} is {new}")
            if attribute in (*PRECONDITIONS, *POSTCONDITIONS):
                self._say(element, f"{name}: {attribute} was a port, and is a script in format 4: rename it")
            pointer = _OLD_POINTER.sub(r"{\1}", value)
            if pointer != value:
                self._say(element, f"{name}: {value} is {pointer}")
            renamed.append((new, pointer))
        element.attributes = renamed

    def _subtree(self, element: Element, old: str, names: dict[str, str]) -> None:
        """In format 3 the ports of a SubTree were names; only those of a SubTreePlus were values or {names}."""
        was_plus = old.lower().endswith("plus")
        renamed = []
        for attribute, value in element.attributes:
            name, text = _ATTRIBUTES.get(("SubTree", attribute), attribute), _OLD_POINTER.sub(r"{\1}", value)
            if attribute == "ID":
                text = names.get(value, value)
            elif attribute == "__shared_blackboard":
                if value.lower() not in ("true", "1"):
                    continue
                name, text = "_autoremap", "true"
                why = "it shares the outer tree's names, but for those that begin with _"
                self._say(element, f"SubTree: __shared_blackboard is _autoremap; {why}")
            elif not was_plus and self._is_port(attribute) and not (text.startswith("{") and text.endswith("}")):
                text = f"{{{text}}}"
                self._say(element, f'SubTree: {attribute}="{value}" is {attribute}="{text}", the entry of that name')
            renamed.append((name, text))
        element.attributes = renamed

    @staticmethod
    def _is_port(attribute: str) -> bool:
        return attribute not in ("ID", "name") and not attribute.startswith("_")

    def _check(self, element: Element, old: str) -> None:
        attributes = dict(element.attributes)
        sides = [self._operand(attributes.get(side, ""), old) for side in ("value_A", "value_B")]
        kept = [(n, v) for n, v in element.attributes if n not in ("value_A", "value_B", "return_on_mismatch", "ID")]
        mismatch = attributes.get("return_on_mismatch", "FAILURE")
        element.tag = "Precondition"
        element.attributes = [*kept, ("if", f"{sides[0]} == {sides[1]}"), ("else", mismatch)]
        self._say(element, f"{old} is Precondition; it is asked when its child is not RUNNING")

    @staticmethod
    def _operand(text: str, check: str) -> str:
        pointer = _OLD_POINTER.sub(r"{\1}", text.strip())
        if pointer.startswith("{") and pointer.endswith("}"):
            return pointer[1:-1].strip()
        return f"'{pointer}'" if check.endswith("String") else pointer


def _roots(document: Document) -> Iterator[Element]:
    return (part for part in document.content if isinstance(part, Element))


def to_4(document: Document) -> list[str] | None:
    """Converts a document in its place, and says what has changed; None if it is of format 4 already."""
    (root,) = _roots(document)
    if dict(root.attributes).get("BTCPP_format") == "4":
        return None
    converter = _Converter(root)
    converter.convert()
    return list(converter.said)
