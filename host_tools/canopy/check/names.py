# SPDX-License-Identifier: MIT
"""What the names of leaves say about them: which action undoes another, which one makes a condition true.

Only a guess, for trees that declare neither `undoes` nor `achieves`; a declaration on the leaf takes its place.
"""

from __future__ import annotations

from functools import cache

from canopy.compiler.leaf_model import Leaf
from canopy.compiler.names import snake

# An action's verb, and the verbs that undo it.
OPPOSITES = {
    "open": ("close", "shut"),
    "start": ("stop",),
    "enable": ("disable",),
    "activate": ("deactivate",),
    "grasp": ("release", "drop"),
    "grab": ("release", "drop"),
    "lock": ("unlock",),
    "raise": ("lower",),
    "extend": ("retract",),
    "acquire": ("release",),
    "attach": ("detach",),
    "connect": ("disconnect",),
    "begin": ("end",),
}
OPPOSITE_PHRASES = {("turn", "on"): ("turn", "off"), ("switch", "on"): ("switch", "off")}

# Words that a condition's name has and its achiever's has not.
FILLERS = {"is", "are", "has", "have", "was", "the", "a"}


@cache
def _words_of(leaf_id: str) -> list[str]:
    return [word for word in snake(leaf_id).split("_") if word]


def _words(leaf: Leaf) -> list[str]:
    return _words_of(leaf.id)


def undoes(later: Leaf, earlier: Leaf) -> bool:
    """Does `later` clean up what `earlier` has done?"""
    if later.undoes:
        return earlier.id in later.undoes
    before, after = _words(earlier), _words(later)
    if not before or not after:
        return False
    for done, undone in OPPOSITE_PHRASES.items():
        if (*before[:1], *before[-1:]) == done and (*after[:1], *after[-1:]) == undone:
            return before[1:-1] == after[1:-1]
        if tuple(before[:2]) == done and tuple(after[:2]) == undone:
            return before[2:] == after[2:]
    return after[0] in OPPOSITES.get(before[0], ()) and after[1:] == before[1:]


def _stem(word: str) -> str:
    """`opened`, `opening`, `open` are one word here; so are `grasped` and `grasp`, `closed` and `close`."""
    for ending in ("ing", "ed", "en", "e", "d"):
        if word.endswith(ending) and len(word) - len(ending) >= 3 and word != "open":
            return word[: -len(ending)]
    return word


def achieves(action: Leaf, condition: Leaf) -> bool:
    """Does `action` make `condition` true? OpenDoor achieves DoorOpen, IsDoorOpen, and DoorOpened."""
    if action.achieves:
        return condition.id in action.achieves
    wanted = _stems(condition.id)
    return len(wanted) > 1 and wanted == _stems(action.id)


@cache
def _stems(leaf_id: str) -> list[str]:
    return sorted(_stem(word) for word in _words_of(leaf_id) if word not in FILLERS)
