# SPDX-License-Identifier: MIT
"""Declarations of the user's leaves: the <TreeNodesModel> that Groot2 writes, with Canopy's <Metadata> fields.

    <Action ID="WalkHome">
      <input_port name="step" type="int32_t" default="100">mm</input_port>
      <MetadataFields>
        <Metadata reads="Posture" writes="PostureCommand"/>
      </MetadataFields>
    </Action>

Metadata: `kind` (SyncAction or StatefulAction; an <Action> is a StatefulAction unless it says so), `reads` and `writes`
(messages of the DBC, separated by spaces), `stale` (what the leaf returns while a message it reads is not fresh:
FAILURE, the default, or SUCCESS), `state` (a C type of the user's: the leaf's own state).

Metadata that only `canopy check` uses (docs/lint.md), and that changes no generated code: `returns` (the statuses that the
leaf can return, if fewer than its kind allows), `undoes` and `achieves` (IDs of leaves: the action that this one cleans up
after, the condition that it makes true), `moves` (signals that its acting changes), `hysteresis` (what keeps a
condition's threshold from chattering).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.names import is_c_identifier, snake
from canopy.compiler.xml_reader import Element

METADATA = ("kind", "reads", "writes", "stale", "state", "returns", "undoes", "achieves", "moves", "hysteresis")
ACTION_KINDS = ("SyncAction", "StatefulAction")
STALE = ("FAILURE", "SUCCESS")
# What a leaf of each kind may say that it returns.
COMPLETED = ("SUCCESS", "FAILURE", "SKIPPED")
RETURNS = {"Condition": COMPLETED, "SyncAction": COMPLETED, "StatefulAction": ("RUNNING", *COMPLETED)}

# Type names of ports: C++ and C spellings on the left.
PORT_TYPES = {
    "bool": "bool",
    "int": "int32_t",
    "unsigned": "uint32_t",
    "unsigned int": "uint32_t",
    **{f"{sign}int{bits}_t": f"{sign}int{bits}_t" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}


@dataclass(frozen=True)
class Port:
    """An input port of a leaf. `c_type` is a C integer type or bool; `default` is None when a value must be given."""

    name: str
    c_type: str
    default: str | None
    description: str
    place: Place

    @property
    def c_name(self) -> str:
        """The member's name in the leaf's ports struct."""
        return snake(self.name)

    def literal(self, text: str, place: Place) -> str:
        """The C literal of a value of this port.

        Raises:
            CompileError: the text is not a value of the type.
        """
        if text.startswith("{"):
            raise CompileError(
                place, f"port '{self.name}': blackboard entries ({text}) are not supported", "give a literal value"
            )
        if self.c_type == "bool":
            if text.lower() not in ("true", "false", "0", "1"):
                raise CompileError(place, f"port '{self.name}': '{text}' is not a bool", "write true or false")
            return "true" if text.lower() in ("true", "1") else "false"
        try:
            value = int(text, 0)
        except ValueError:
            raise CompileError(place, f"port '{self.name}': '{text}' is not a whole number ({self.c_type})") from None
        bits = int("".join(c for c in self.c_type if c.isdigit()))
        low, high = (0, 2**bits - 1) if self.c_type.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        if not low <= value <= high:
            raise CompileError(place, f"port '{self.name}': {value} is outside {self.c_type} [{low}, {high}]")
        macro = f"{'U' if low == 0 else ''}INT{bits}_C"
        return f"({macro}({value + 1}) - 1)" if value == low and low < 0 else f"{macro}({value})"


@dataclass(frozen=True)
class Leaf:
    """A leaf that the user writes in C. `kind` is the XML name of its node type."""

    id: str
    kind: str
    place: Place
    ports: tuple[Port, ...] = ()
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    stale: str = "FAILURE"
    state: str | None = None
    returns: tuple[str, ...] = ()
    undoes: tuple[str, ...] = ()
    achieves: tuple[str, ...] = ()
    moves: tuple[str, ...] = ()
    hysteresis: str = ""

    @property
    def c_name(self) -> str:
        """Stem of the C functions: `walk_home` of `WalkHome`."""
        return snake(self.id)


@dataclass
class _Draft:
    metadata: dict[str, tuple[str, Place]] = field(default_factory=dict)
    ports: list[Port] = field(default_factory=list)


def _read_port(element: Element) -> Port:
    name = element.attributes.get("name", "")
    if not is_c_identifier(snake(name)) or not name:
        raise CompileError(element.place, f"<{element.tag}> needs a name that can be a C identifier, not '{name}'")
    type_name = element.attributes.get("type", "")
    if type_name not in PORT_TYPES:
        raise CompileError(
            element.place, f"port '{name}': unsupported type '{type_name}'", nearest(type_name, PORT_TYPES)
        )
    return Port(name, PORT_TYPES[type_name], element.attributes.get("default"), element.text.strip(), element.place)


def _read_metadata(element: Element, draft: _Draft) -> None:
    for entry in element.children:
        if entry.tag != "Metadata":
            raise CompileError(entry.place, f"<{entry.tag}> inside <MetadataFields>", "only <Metadata key=…/> goes there")
        for key, value in entry.attributes.items():
            if key not in METADATA:
                raise CompileError(entry.place, f"unknown metadata '{key}'", nearest(key, METADATA))
            draft.metadata[key] = (value, entry.place)


def _one_of(draft: _Draft, key: str, allowed: tuple[str, ...], default: str) -> str:
    value, place = draft.metadata.get(key, (default, Place("")))
    if value not in allowed:
        raise CompileError(place, f"metadata {key}='{value}'", f"allowed: {', '.join(allowed)}")
    return value


def _words(draft: _Draft, key: str) -> tuple[str, ...]:
    return tuple(draft.metadata.get(key, ("", None))[0].split())


def _returns(draft: _Draft, kind: str) -> tuple[str, ...]:
    for status in _words(draft, "returns"):
        if status not in RETURNS[kind]:
            raise CompileError(
                draft.metadata["returns"][1],
                f"metadata returns: a {kind} does not return '{status}'",
                f"allowed: {', '.join(RETURNS[kind])}",
            )
    return _words(draft, "returns")


def _read_leaf(element: Element) -> Leaf:
    leaf_id = element.attributes.get("ID", "")
    if not leaf_id:
        raise CompileError(element.place, f"<{element.tag}> in <TreeNodesModel> needs an ID")
    draft = _Draft()
    for child in element.children:
        if child.tag == "input_port":
            draft.ports.append(_read_port(child))
        elif child.tag == "MetadataFields":
            _read_metadata(child, draft)
        elif child.tag == "description":
            continue
        else:
            raise CompileError(
                child.place,
                f"<{child.tag}> of leaf '{leaf_id}' is not supported",
                nearest(child.tag, ("input_port", "MetadataFields", "description")),
            )
    if element.tag == "Condition":
        kind = _one_of(draft, "kind", ("Condition",), "Condition")
        if "writes" in draft.metadata:
            raise CompileError(
                draft.metadata["writes"][1],
                f"condition '{leaf_id}' declares that it writes",
                "a Condition only reads; make it an <Action>",
            )
    else:
        kind = _one_of(draft, "kind", ACTION_KINDS, "StatefulAction")
    state = draft.metadata["state"][0] if "state" in draft.metadata else None
    if state is not None and not is_c_identifier(state):
        raise CompileError(draft.metadata["state"][1], f"metadata state='{state}' is not the name of a C type")
    return Leaf(
        id=leaf_id,
        kind=kind,
        place=element.place,
        ports=tuple(draft.ports),
        reads=_words(draft, "reads"),
        writes=_words(draft, "writes"),
        stale=_one_of(draft, "stale", STALE, "FAILURE"),
        state=state,
        returns=_returns(draft, kind),
        undoes=_words(draft, "undoes"),
        achieves=_words(draft, "achieves"),
        moves=_words(draft, "moves"),
        hysteresis=draft.metadata.get("hysteresis", ("", None))[0],
    )


def read_leaves(model: Element) -> dict[str, Leaf]:
    """The leaves that a <TreeNodesModel> declares, by ID.

    Raises:
        CompileError: a declaration is incomplete, not supported, or given twice.
    """
    leaves: dict[str, Leaf] = {}
    for element in model.children:
        if element.tag not in ("Action", "Condition"):
            raise CompileError(
                element.place,
                f"<{element.tag}> in <TreeNodesModel> is not supported",
                nearest(element.tag, ("Action", "Condition")),
            )
        leaf = _read_leaf(element)
        same = [other for other in leaves.values() if other.id == leaf.id or other.c_name == leaf.c_name]
        if same:
            raise CompileError(
                leaf.place, f"leaf '{leaf.id}' is declared again (or has the same C name)", f"first: {same[0].place}"
            )
        leaves[leaf.id] = leaf
    return leaves
