# SPDX-License-Identifier: MIT
"""The blackboard at compile time: a scope of names for each instance of a tree, and the entries that names stand for.

Every name resolves here to one entry, a member of the application's static object. Nothing is looked up on the target.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.names import snake
from canopy.compiler.port_types import ANY, PortType

# Of BehaviorTree.CPP's entries, which scripts need not be able to name.
_NAME = re.compile(r"[^\W\d][\w]*([ ./-]+\w+)*")
MAX_NAME = 1_000


@dataclass(frozen=True)
class Use:
    """One end that is connected to an entry, and what it says of its type (kind "any": nothing)."""

    type: PortType
    place: Place
    what: str
    writes: bool


@dataclass
class Entry:
    """An entry. `initial` is the literal that a SubTree's port gives it; `counted` when a node needs its updates."""

    name: str
    path: str
    c_name: str
    place: Place
    uses: list[Use] = field(default_factory=list)
    type: PortType = ANY
    initial: str | None = None
    counted: bool = False
    queue: int = 0
    is_written: bool = False
    is_traced: bool = False
    """A node with `_trace="yes"` has a port that it is connected to."""

    def connect(self, use: Use) -> None:
        """One more end."""
        self.uses.append(use)
        self.is_written = self.is_written or use.writes

    @property
    def is_constant(self) -> bool:
        """Nothing writes it: it is the literal that its SubTree was given."""
        return self.initial is not None and not self.is_written

    def settle_type(self) -> None:
        """Takes the type from the uses.

        Raises:
            CompileError: two uses have different types.
        """
        first: Use | None = None
        for use in self.uses:
            if use.type.kind == "any":
                continue
            if first is None:
                first = use
                self.type = use.type
            elif first.type != use.type:
                raise CompileError(
                    use.place,
                    f"{use.what} is {use.type}, but entry '{self.name}' is {first.type}",
                    f"the other end is {first.what}, at {first.place}",
                )


@dataclass(frozen=True)
class SignalName:
    """A name with a dot: a signal of the bus, `Message.Signal` or `Message.fresh`."""

    text: str


Target = Entry | SignalName


class Blackboard:
    """All entries of an application, in the order in which they were first named."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self.dotted: set[str] = set()
        """Names with a dot that are entries all the same: a node writes them."""
        self.enums: dict[str, int] = {}
        """What names of enums' values mean in scripts."""
        self.main = Scope(self, "")
        self._c_names: dict[str, int] = {}  # with the last number that was put behind it

    def make(self, name: str, path: str, place: Place) -> Entry:
        """A new entry, with a C name of its own."""
        stem = snake(f"{path} {name}") if path else snake(name)
        c_name, number = stem, self._c_names.get(stem, 0)
        while c_name in self._c_names:
            number += 1
            c_name = f"{stem}_{number}"
        self._c_names[stem] = max(number, 1)
        self._c_names.setdefault(c_name, 1)
        entry = Entry(name, path, c_name, place)
        self.entries.append(entry)
        return entry


class Scope:
    """The names of one instance of a tree. `path` is "" for the main tree."""

    def __init__(self, board: Blackboard, path: str, parent: Scope | None = None, *, autoremap: bool = False) -> None:
        self.board = board
        self.path = path
        self.parent = parent
        self.autoremap = autoremap
        self.names: dict[str, Target] = {}

    @property
    def root(self) -> Scope:
        """The main tree's scope."""
        scope = self
        while scope.parent is not None:
            scope = scope.parent
        return scope

    def connect(self, name: str, text: str, place: Place) -> None:
        """The port `name` of this SubTree is given `text`: {entry}, {=}, {@entry}, or a literal."""
        assert self.parent is not None
        inner = pointer(text, name)
        if inner is not None:
            self.names[name] = self.parent.resolve(inner, place)
            return
        entry = self.board.make(name, self.path, place)
        entry.initial = text
        self.names[name] = entry

    def resolve(self, name: str, place: Place) -> Target:
        """What a name stands for here. A name that is not known yet becomes a new entry.

        Raises:
            CompileError: it is no name.
        """
        # A loop over the scopes, not recursion: _autoremap passes a name up.
        scope: Scope = self
        if name.startswith("@"):
            scope, name = self.root, name[1:]
        if not _NAME.fullmatch(name) or len(name) > MAX_NAME:
            raise CompileError(
                place, f"'{name}' is not the name of an entry", "letters, digits and _ - / . or a blank; Message.Signal"
            )
        if "." in name and name not in self.board.dotted and all(map(str.isidentifier, name.split("."))):
            return SignalName(name)
        while name not in scope.names and scope.autoremap and not name.startswith("_") and scope.parent is not None:
            scope = scope.parent
        if name not in scope.names:
            scope.names[name] = scope.board.make(name, scope.path, place)
        return scope.names[name]

    def knows(self, name: str) -> bool:
        """Is it a name that something has used, here or where _autoremap leads?"""
        scope: Scope = self
        while name not in scope.names and scope.autoremap and scope.parent is not None:
            scope = scope.parent
        return name in scope.names

    def help_for(self, name: str) -> str:
        """The nearest name in this scope that something writes."""
        known = [n for n, target in self.names.items() if isinstance(target, Entry) and _is_given(target)]
        return nearest(name, known)


def _is_given(entry: Entry) -> bool:
    return entry.initial is not None or entry.is_written


def pointer(text: str, own_name: str) -> str | None:
    """The name inside {…}; `own_name` for {=}. None for a literal."""
    stripped = text.strip()
    if not (stripped.startswith("{") and stripped.endswith("}")):
        return None
    inner = stripped[1:-1].strip()
    return own_name if inner in ("=", "") else inner
