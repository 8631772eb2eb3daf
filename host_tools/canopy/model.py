# SPDX-License-Identifier: MIT
"""The model file of an application: what `canopy compile` tells the host tools about the tree in the firmware.

Every host tool reads this one file, `<application>.model.json`, and the DBC that lies beside it.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

from canopy.files import FileError, read_text
from canopy.live.trace_model import MESSAGES, NO_TRACE, TYPES, VERSION, Trace, TraceValue

FORMAT = 2
CATEGORIES = ("control", "decorator", "condition", "action")
PERIOD_US_MAX = 3_600_000_000
LINE_MAX = 2**31 - 1
_TEXT_MAX = 1000
DATA_ID_MAX = 0xFFFF
SLOTS_MAX = 4096
CHANGES_MAX = 32
TICKS_MAX = 1_000
KNOWN_MS_MAX = 2**53

T = TypeVar("T")


class ModelError(ValueError):
    """The model file cannot be used; the text names the file, the place in it, and the way out.

    What is in the file may be long: the middle of a long text is left out.
    """

    def __init__(self, text: str) -> None:
        half = _TEXT_MAX // 2
        super().__init__(text if len(text) <= _TEXT_MAX else f"{text[:half]} … {text[-half:]}")


@dataclass(frozen=True)
class Node:
    """One node of the tree. Its descendants are the nodes index + 1 … end - 1."""

    index: int
    parent: int | None
    end: int
    type: str
    category: str
    name: str
    line: int


@dataclass(frozen=True)
class Model:
    """An application: its tree, in depth-first order, its bus, and where its trace is on that bus."""

    path: Path
    application: str
    hash: str
    period_us: int
    tree_id: str
    nodes: tuple[Node, ...]
    dbc: Path
    bus_node: str
    receive: tuple[str, ...]
    send: tuple[str, ...]
    dbc_hash: str | None
    """Of the DBC that the firmware was built with; None: not known."""
    trace: Trace

    def depth(self, index: int) -> int:
        """Number of ancestors of a node; 0 for the root."""
        depth = 0
        parent = self.nodes[index].parent
        while parent is not None:
            depth += 1
            parent = self.nodes[parent].parent
        return depth


def load_model(path: Path, *, traced: bool = True) -> Model:
    """Reads and checks a model file.

    Args:
        path: The file.
        traced: Whether the application must have a trace, for who watches it on its bus.

    Raises:
        ModelError: The file or its DBC is not there, or is not what `canopy compile` of this version writes.
    """
    try:
        text = read_text(path)
    except FileError as error:
        raise ModelError(f"{path}: {error.problem}; `canopy compile` or the build writes it") from error
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ModelError(f"{path}: is no JSON: {error}") from error
    reader = _Reader(path, data, traced=traced)
    model = reader.model()
    if not os.path.isfile(model.dbc):  # Path.is_file() raises where the name is too long
        raise reader.error("bus.dbc", f"{model.dbc} is not there; it is written beside the model file")
    return model


class _Reader:
    """Takes values out of the parsed JSON and names the place of the first one that is not as it should be."""

    def __init__(self, path: Path, data: Any, *, traced: bool) -> None:
        self._path = path
        self._data = data
        self._traced = traced
        self._node_count = 0

    def model(self) -> Model:
        data = self._object(self._data, "the file")
        if self._get(data, "", "format", int) != FORMAT:
            raise self.error(
                "format", f"is {data['format']}, these tools read {FORMAT}: {self._way_out(data['format'])}"
            )
        tree = self._get(data, "", "tree", dict)
        bus = self._get(data, "", "bus", dict)
        period_us = self._number(data, "", "period_us", 1, PERIOD_US_MAX)
        return Model(
            path=self._path,
            application=self._get(data, "", "application", str),
            hash=self._hash(data),
            period_us=period_us,
            tree_id=self._get(tree, "tree.", "id", str),
            nodes=self._nodes(self._get(tree, "tree.", "nodes", list)),
            dbc=self._path.parent / self._get(bus, "bus.", "dbc", str),
            dbc_hash=self._get(bus, "bus.", "dbc_hash", str) if "dbc_hash" in bus else None,
            bus_node=self._get(bus, "bus.", "node", str),
            receive=self._list(bus, "bus.", "receive", self._name),
            send=self._list(bus, "bus.", "send", self._name),
            trace=self._trace(data),
        )

    def _hash(self, data: dict[str, Any]) -> str:
        value = self._get(data, "", "hash", str)
        if re.fullmatch("[0-9a-f]{16}", value) is None:
            raise self.error("hash", f"is '{value}', must be 16 hexadecimal digits")
        return value

    def _nodes(self, items: list[Any]) -> tuple[Node, ...]:
        if not items:
            raise self.error("tree.nodes", "is empty")
        self._node_count = len(items)
        nodes: list[Node] = []
        open_nodes: list[Node] = []  # the ancestors of the node at hand
        for index, item in enumerate(items):
            node = self._node(item, f"tree.nodes[{index}]")
            while open_nodes and open_nodes[-1].end <= index:
                open_nodes.pop()
            parent = open_nodes[-1] if open_nodes else None
            limit = parent.end if parent else len(items)
            if node.index != index or node.parent != (parent.index if parent else None) or (index and not parent):
                raise self.error(f"tree.nodes[{index}]", "is not in depth-first order (index, parent, end)")
            if not index < node.end <= limit:
                raise self.error(f"tree.nodes[{index}].end", f"is {node.end}, must be {index + 1}…{limit}")
            nodes.append(node)
            open_nodes.append(node)
        return tuple(nodes)

    def _node(self, item: Any, place: str) -> Node:
        data = self._object(item, place)
        place += "."
        parent = data.get("parent")
        node = Node(
            index=self._get(data, place, "index", int),
            parent=None if parent is None else self._get(data, place, "parent", int),
            end=self._get(data, place, "end", int),
            type=self._get(data, place, "type", str),
            category=self._get(data, place, "category", str),
            name=self._get(data, place, "name", str),
            line=self._number(data, place, "line", 0, LINE_MAX),
        )
        if node.category not in CATEGORIES:
            raise self.error(f"{place}category", f"is '{node.category}', must be one of {', '.join(CATEGORIES)}")
        return node

    @staticmethod
    def _way_out(number: int) -> str:
        if number > FORMAT:
            return "use the release of Canopy that the application was built with"
        return (
            "build the application again; a log that an older release has recorded is replayed by that release, with "
            "the program and the model file of then"
        )

    def _trace(self, data: dict[str, Any]) -> Trace:
        if "trace" in data and data["trace"] is None:
            if not self._traced:
                return NO_TRACE
            raise self.error(
                "trace",
                "is null: the application was built without a trace, so nothing can be watched; build it with "
                "TRACE 0x600 (canopy_add_application) or --trace 0x600 (canopy compile)",
            )
        trace, where = self._get(data, "", "trace", dict), "trace."
        version = self._get(trace, where, "version", int)
        if version != VERSION:
            way_out = "use the release of Canopy that the application was built with"
            raise self.error("trace.version", f"is {version}, these tools read {VERSION}: {way_out}")
        extended = self._get(trace, where, "extended", bool)
        guard = None if trace.get("guard") is None else self._number(trace, where, "guard", 0, DATA_ID_MAX)
        values = self._list(trace, where, "values", self._value)
        first = 0
        for index, value in enumerate(values):
            if value.slot != first:
                raise self.error(f"trace.values[{index}].slot", f"is {value.slot}, must be {first}")
            first += value.slots
        if first > SLOTS_MAX:
            raise self.error("trace.values", f"take {first} slots, must be {SLOTS_MAX} at most")
        return Trace(
            base=self._number(trace, where, "base", 0, (2**29 if extended else 2**11) - len(MESSAGES)),
            extended=extended,
            guard=guard,
            ticks=self._number(trace, where, "ticks", 1, TICKS_MAX),
            changes_max=self._number(trace, where, "changes_max", 1, CHANGES_MAX),
            known_within_ms=self._number(trace, where, "known_within_ms", 0, KNOWN_MS_MAX),
            values=values,
            texts=self._list(trace, where, "texts", self._name),
        )

    def _value(self, item: Any, place: str) -> TraceValue:
        data = self._object(item, place)
        place += "."
        kind, type_name = self._get(data, place, "kind", str), self._get(data, place, "type", str)
        if kind not in ("entry", "reason"):
            raise self.error(f"{place}kind", f"is '{kind}', must be entry or reason")
        if type_name not in TYPES:
            raise self.error(f"{place}type", f"is '{type_name}', must be one of {', '.join(TYPES)}")
        if self._get(data, place, "slots", int) != TYPES[type_name]:
            raise self.error(f"{place}slots", f"is {data['slots']}, must be {TYPES[type_name]} for {type_name}")
        node = self._number(data, place, "node", 0, self._node_count - 1) if kind == "reason" else None
        words = self._get(data, place, "enum", dict) if data.get("enum") is not None else {}
        return TraceValue(
            kind=kind,
            name=self._get(data, place, "name", str),
            path=self._get(data, place, "path", str) if kind == "entry" or "path" in data else "",
            node=node,
            type=type_name,
            slot=self._number(data, place, "slot", 0, SLOTS_MAX - 1),
            scale=self._scale(data, place),
            unit=self._get(data, place, "unit", str) if "unit" in data else "ms" if type_name == "duration" else "",
            words={self._number(words, f"{place}enum.", name, -(2**63), 2**64 - 1): name for name in words},
        )

    def _scale(self, data: dict[str, Any], place: str) -> Fraction:
        if data.get("scale") is None:
            return Fraction(1)
        text = self._get(data, place, "scale", str)
        number = re.fullmatch(r"\d{1,19}([.]\d{1,19}|/[1-9]\d{0,18})?", text)
        if number is None or not Fraction(text):
            raise self.error(f"{place}scale", f"is '{text[:50]}', must be a number such as 0.01 or 1/3")
        return Fraction(text)

    def _name(self, value: Any, place: str) -> str:
        if not isinstance(value, str):
            raise self.error(place, f"is {value!r}, must be a text")
        return value

    def _list(self, data: dict[str, Any], where: str, key: str, item: Callable[[Any, str], T]) -> tuple[T, ...]:
        values = self._get(data, where, key, list)
        return tuple(item(value, f"{where}{key}[{index}]") for index, value in enumerate(values))

    def _object(self, value: Any, place: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.error(place, "must be a JSON object")
        return value

    def _get(self, data: dict[str, Any], where: str, key: str, kind: type[T]) -> T:
        value = data.get(key)
        if key not in data:
            raise self.error(f"{where}{key}", "is missing")
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is int):
            raise self.error(f"{where}{key}", f"is {value!r}, must be of type {kind.__name__}")
        return value

    def _number(self, data: dict[str, Any], where: str, key: str, low: int, high: int) -> int:
        value = self._get(data, where, key, int)
        if not low <= value <= high:
            raise self.error(f"{where}{key}", f"is {str(value)[:30]}, must be {low} to {high}")
        return value

    def error(self, place: str, text: str) -> ModelError:
        """What is wrong at a place of the file."""
        return ModelError(f"{self._path}: {place}: {text}")
