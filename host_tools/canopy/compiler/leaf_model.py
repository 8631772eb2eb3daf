# SPDX-License-Identifier: MIT
"""Declarations of the user's nodes: the <TreeNodesModel> that Groot2 writes, with Canopy's <Metadata> fields.

    <Action ID="WalkHome">
      <input_port name="step" type="int32_t" default="100">mm</input_port>
      <MetadataFields>
        <Metadata reads="Posture" writes="PostureCommand"/>
      </MetadataFields>
    </Action>

Metadata: `kind` (SyncAction or StatefulAction; an <Action> is a StatefulAction unless it says so), `reads` and `writes`
(messages of the DBC, separated by spaces), `stale` (what the leaf returns while a message it reads is not fresh:
FAILURE, the default, or SUCCESS), `state` (a C type of the user's: the node's own state), `texts` (what the node may
write to its output ports of texts, separated by semicolons: texts are constants), `reasons` (of a Condition or Action:
why it returns what it returns, names of the user's separated by semicolons; the trace tells them).

<Control> and <Decorator> declare inner nodes of the user's own, <SubTree> the ports of a tree, <Enum> a type
(canopy.tree.enums).

Metadata that only `canopy check` and `canopy fmt --simplify` use (docs/lint.md, docs/tools.md), and that changes no
generated code: `returns` (the statuses that the leaf can return, if fewer than its kind allows), `undoes` and
`achieves` (IDs of leaves: the action that this one cleans up after, the condition that it makes true), `moves` (signals
that its acting changes), `safeguards` (signals that it keeps in their safe range), `hysteresis` (what keeps a
condition's threshold from chattering), `holds` (the comparison of a signal with a number that a condition is).

Metadata of other tools is left alone (canopy.tree.foreign).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

from canopy.compiler.errors import CompileError, Place, UnsupportedTypeError, nearest
from canopy.compiler.limits import PORTS_MAX, REASONS_MAX
from canopy.compiler.names import is_c_identifier, snake
from canopy.compiler.port_types import Options, PortType, is_optional, read_type
from canopy.compiler.xml_reader import Element
from canopy.tree.built_in import is_built_in
from canopy.tree.enums import add_enum
from canopy.tree.foreign import Foreign

METADATA = (
    "reasons",
    "kind",
    "reads",
    "writes",
    "stale",
    "state",
    "texts",
    "returns",
    "undoes",
    "achieves",
    "moves",
    "hysteresis",
    "holds",
    "safeguards",
)
ACTION_KINDS = ("SyncAction", "StatefulAction")
INNER_KINDS = ("Control", "Decorator")
STALE = ("FAILURE", "SUCCESS")
# What a leaf of each kind may say that it returns.
COMPLETED = ("SUCCESS", "FAILURE", "SKIPPED")
RETURNS = {"Condition": COMPLETED, "SyncAction": COMPLETED}  # any other kind: these, and RUNNING
PORT_TAGS: dict[str, Literal["in", "out", "inout"]] = {
    "input_port": "in",
    "output_port": "out",
    "inout_port": "inout",
    "bidirectional_port": "inout",  # the name in older models
}
MODEL_TAGS = ("Action", "Condition", "Control", "Decorator", "SubTree")
ENUM_TAG = "Enum"


@dataclass(frozen=True)
class Port:
    """A port of a node. `default` is None when a value must be given (outputs may stay unconnected)."""

    name: str
    type: PortType
    default: str | None
    description: str
    place: Place = field(compare=False)
    direction: Literal["in", "out", "inout"] = "in"
    is_optional: bool = False

    @cached_property
    def c_name(self) -> str:
        """The member's name in the ports struct."""
        return snake(self.name)

    @property
    def writes(self) -> bool:
        """Can the node write through it?"""
        return self.direction != "in"


@dataclass(frozen=True)
class Leaf:
    """A node that the user writes in C. `kind` is the XML name of its node type.

    `problem` says why no tree can use it: files that are shared by several robots declare more than one of them needs.
    """

    id: str
    kind: str
    place: Place = field(compare=False)
    ports: tuple[Port, ...] = ()
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    stale: str = "FAILURE"
    state: str | None = None
    texts: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    returns: tuple[str, ...] = ()
    undoes: tuple[str, ...] = ()
    achieves: tuple[str, ...] = ()
    moves: tuple[str, ...] = ()
    hysteresis: str = ""
    holds: str = ""
    safeguards: tuple[str, ...] = ()
    problem: UnsupportedTypeError | None = field(default=None, compare=False)
    is_guessed: bool = False
    """No file declares it: it is what its use lets guess."""

    @cached_property
    def c_name(self) -> str:
        """Stem of the C functions: `walk_home` of `WalkHome`."""
        return snake(self.id)

    @property
    def text_type(self) -> str:
        """The C enum of the texts that it may write."""
        return f"{self.c_name}_text_t" if self.texts else "uint16_t"

    @property
    def is_inner(self) -> bool:
        """A control node or decorator."""
        return self.kind in INNER_KINDS


@dataclass
class Declarations:
    """What the models of all files declare: the user's nodes, and the ports of trees, by ID."""

    leaves: dict[str, Leaf] = field(default_factory=dict)
    c_names: dict[str, Leaf] = field(default_factory=dict)
    """The same leaves, by their C names."""
    subtrees: dict[str, tuple[Port, ...]] = field(default_factory=dict)
    enums: dict[str, PortType] = field(default_factory=dict)


@dataclass
class _Draft:
    metadata: dict[str, tuple[str, Place]] = field(default_factory=dict)
    ports: list[Port] = field(default_factory=list)
    c_names: set[str] = field(default_factory=set)
    problem: UnsupportedTypeError | None = None


def _read_port(element: Element, options: Options, foreign: Foreign) -> Port:
    element.only(foreign, "name", "type", "default", "description")
    name = element.attributes.get("name", "")
    if not is_c_identifier(snake(name)) or not name:
        raise CompileError(element.place, f"<{element.tag}> needs a name that can be a C identifier, not '{name}'")
    kind = read_type(element.attributes.get("type", ""), f"port '{name}'", element.place, options)
    default = element.attributes.get("default")
    if default == "" and kind.kind != "text":
        default = None  # Groot2 writes an empty default where there is none
    return Port(
        name,
        kind,
        default,
        element.text.strip(),
        element.place,
        PORT_TAGS[element.tag],
        is_optional(element.attributes.get("type", "")),
    )


def _read_metadata(element: Element, draft: _Draft, foreign: Foreign) -> None:
    for entry in element.children:
        if entry.tag != "Metadata":
            foreign.leave(entry.tag, entry.place, "element", ("Metadata",))
            continue
        for key, value in entry.attributes.items():
            if key in METADATA:
                draft.metadata[key] = (value, entry.place)
            else:
                foreign.leave(key, entry.attribute_place(key), "metadata", METADATA)


def _one_of(draft: _Draft, key: str, allowed: tuple[str, ...], default: str) -> str:
    value, place = draft.metadata.get(key, (default, Place("")))
    if value not in allowed:
        raise CompileError(place, f"metadata {key}='{value}'", f"allowed: {', '.join(allowed)}")
    return value


def _words(draft: _Draft, key: str) -> tuple[str, ...]:
    return tuple(draft.metadata.get(key, ("", None))[0].split())


def _texts(draft: _Draft, leaf_id: str) -> tuple[str, ...]:
    text, place = draft.metadata.get("texts", ("", Place("")))
    texts = tuple(part.strip() for part in text.split(";") if part.strip())
    names = Counter(map(snake, texts))
    for part in texts:
        name = snake(part)
        if not name.strip("_") or names[name] > 1:
            raise CompileError(place, f"texts of '{leaf_id}': '{part}' gives no C name of its own, but '{name}'")
    return texts


def _reasons(draft: _Draft, leaf_id: str, kind: str) -> tuple[str, ...]:
    text, place = draft.metadata.get("reasons", ("", Place("")))
    reasons = tuple(part.strip() for part in text.split(";") if part.strip())
    names = Counter(map(snake, reasons))
    for part in reasons:
        name = snake(part)
        if not name.strip("_") or names[name] > 1 or name == "none":
            raise CompileError(place, f"reasons of '{leaf_id}': '{part}' gives no C name of its own, but '{name}'")
    if reasons and kind in INNER_KINDS:
        raise CompileError(place, f"'{leaf_id}' is a {kind}, and only conditions and actions have reasons")
    if len(reasons) > REASONS_MAX:
        raise CompileError(
            place, f"'{leaf_id}' has {len(reasons)} reasons", f"{REASONS_MAX} at most: they are one byte"
        )
    return reasons


def _returns(draft: _Draft, kind: str) -> tuple[str, ...]:
    allowed = RETURNS.get(kind, ("RUNNING", *COMPLETED))
    for status in _words(draft, "returns"):
        if status not in allowed:
            raise CompileError(
                draft.metadata["returns"][1],
                f"metadata returns: a {kind} does not return '{status}'",
                f"allowed: {', '.join(allowed)}",
            )
    return _words(draft, "returns")


def _read_draft(element: Element, leaf_id: str, options: Options, foreign: Foreign) -> _Draft:
    draft = _Draft()
    for child in element.children:
        if child.tag in PORT_TAGS:
            try:
                port = _read_port(child, options, foreign)
            except UnsupportedTypeError as error:
                draft.problem = draft.problem or error
                continue
            if port.c_name in draft.c_names:
                raise CompileError(child.place, f"port '{port.name}' of '{leaf_id}' is declared again")
            draft.ports.append(port)
            draft.c_names.add(port.c_name)
            if len(draft.ports) > PORTS_MAX:
                raise CompileError(child.place, f"'{leaf_id}' has more than {PORTS_MAX} ports")
        elif child.tag == "MetadataFields":
            _read_metadata(child, draft, foreign)
        elif child.tag != "description":
            raise CompileError(
                child.place,
                f"<{child.tag}> of '{leaf_id}' is not supported",
                nearest(child.tag, (*PORT_TAGS, "MetadataFields", "description")),
            )
    return draft


def _read_leaf(element: Element, options: Options, foreign: Foreign) -> Leaf:
    leaf_id = element.attributes["ID"]
    draft = _read_draft(element, leaf_id, options, foreign)
    if element.tag == "Condition":
        kind = _one_of(draft, "kind", ("Condition",), "Condition")
        if "writes" in draft.metadata:
            raise CompileError(
                draft.metadata["writes"][1],
                f"condition '{leaf_id}' declares that it writes",
                "a Condition only reads; make it an <Action>",
            )
    elif element.tag in INNER_KINDS:
        kind = _one_of(draft, "kind", (element.tag,), element.tag)
    else:
        kind = _one_of(draft, "kind", ACTION_KINDS, "StatefulAction")
    state = draft.metadata["state"][0] if "state" in draft.metadata else None
    if state is not None and not is_c_identifier(state):
        raise CompileError(draft.metadata["state"][1], f"metadata state='{state}' is not the name of a C type")
    if not is_c_identifier(snake(leaf_id)):
        raise CompileError(element.place, f"'{leaf_id}' cannot be made a C identifier", "choose another ID")
    return Leaf(
        id=leaf_id,
        kind=kind,
        place=element.place,
        ports=tuple(draft.ports),
        reads=_words(draft, "reads"),
        writes=_words(draft, "writes"),
        stale=_one_of(draft, "stale", STALE, "FAILURE"),
        state=state,
        texts=_texts(draft, leaf_id),
        reasons=_reasons(draft, leaf_id, kind),
        returns=_returns(draft, kind),
        undoes=_words(draft, "undoes"),
        achieves=_words(draft, "achieves"),
        moves=_words(draft, "moves"),
        hysteresis=draft.metadata.get("hysteresis", ("", None))[0],
        safeguards=_words(draft, "safeguards"),
        holds=draft.metadata.get("holds", ("", None))[0],
        problem=draft.problem,
    )


def _check_attributes(element: Element, foreign: Foreign) -> None:
    for name in element.attributes:
        if name in METADATA and name not in foreign.allowed:
            raise CompileError(
                element.attribute_place(name),
                f"<{element.tag}> has no attribute '{name}'",
                f'it is metadata: <MetadataFields><Metadata {name}="…"/></MetadataFields> inside',
            )
    element.only(foreign, "ID", "name", "editable", "description")


def read_model(
    model: Element, into: Declarations, options: Options, built_in: frozenset[str], foreign: Foreign | None = None
) -> None:
    """Adds what a <TreeNodesModel> declares. The same declaration in several files is accepted.

    Raises:
        CompileError: a declaration is incomplete, not supported, or contradicts another one.
    """
    foreign = foreign or Foreign(options.foreign)
    seen: set[str] = set()
    for element in model.children:
        if element.tag == ENUM_TAG:
            add_enum(element, into.enums, foreign)
    options = replace(options, enums=into.enums)
    for element in model.children:
        if element.tag == ENUM_TAG:
            continue
        if element.tag not in MODEL_TAGS and "ID" not in element.attributes:
            foreign.leave(element.tag, element.place, "element", (*MODEL_TAGS, ENUM_TAG))
            continue
        if element.tag not in MODEL_TAGS:
            raise CompileError(
                element.place,
                f"<{element.tag}> in <TreeNodesModel> is not supported",
                nearest(element.tag, (*MODEL_TAGS, ENUM_TAG)),
            )
        node_id = element.attributes.get("ID", "")
        if not node_id:
            raise CompileError(element.place, f"<{element.tag}> in <TreeNodesModel> needs an ID")
        _check_attributes(element, foreign)
        if element.tag == "SubTree":
            draft = _read_draft(element, node_id, options, foreign)
            if draft.problem is not None:
                raise draft.problem
            into.subtrees[node_id] = tuple(draft.ports)
            continue
        if node_id in built_in and is_built_in(element, METADATA):
            continue
        leaf = _read_leaf(element, options, foreign)
        same = into.c_names.setdefault(leaf.c_name, leaf)
        if same is not leaf and (same != leaf or leaf.id in seen):
            raise CompileError(
                leaf.place, f"'{leaf.id}' is declared again (or has the same C name)", f"first: {same.place}"
            )
        seen.add(leaf.id)
        into.leaves.setdefault(leaf.id, leaf)
