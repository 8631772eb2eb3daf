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
from pathlib import Path
from typing import Any, TypeVar

from canopy.files import FileError, read_text

FORMAT = 1
CATEGORIES = ("control", "decorator", "condition", "action")
TRACE_MESSAGES = (
    "CanopyTick",
    "CanopyInputs",
    "CanopyArrivals",
    "CanopyChange",
    "CanopySnapshot",
    "CanopyHealth",
    "CanopyModel",
)
PERIOD_US_MAX = 3_600_000_000
ID_MAX = 2**29 - 1
LINE_MAX = 2**31 - 1
_TEXT_MAX = 1000

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
    trace: dict[str, int]
    """Arbitration id of each trace message the DBC has; always CanopyTick."""

    def depth(self, index: int) -> int:
        """Number of ancestors of a node; 0 for the root."""
        depth = 0
        parent = self.nodes[index].parent
        while parent is not None:
            depth += 1
            parent = self.nodes[parent].parent
        return depth


def load_model(path: Path) -> Model:
    """Reads and checks a model file.

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
    reader = _Reader(path, data)
    model = reader.model()
    if not os.path.isfile(model.dbc):  # Path.is_file() raises where the name is too long
        raise reader.error("bus.dbc", f"{model.dbc} is not there; it is written beside the model file")
    return model


class _Reader:
    """Takes values out of the parsed JSON and names the place of the first one that is not as it should be."""

    def __init__(self, path: Path, data: Any) -> None:
        self._path = path
        self._data = data

    def model(self) -> Model:
        data = self._object(self._data, "the file")
        if self._get(data, "", "format", int) != FORMAT:
            raise self.error("format", f"is {data['format']}, these tools read {FORMAT}: build the application again")
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
            trace=self._trace(self._get(data, "", "trace", dict)),
        )

    def _hash(self, data: dict[str, Any]) -> str:
        value = self._get(data, "", "hash", str)
        if re.fullmatch("[0-9a-f]{16}", value) is None:
            raise self.error("hash", f"is '{value}', must be 16 hexadecimal digits")
        return value

    def _nodes(self, items: list[Any]) -> tuple[Node, ...]:
        if not items:
            raise self.error("tree.nodes", "is empty")
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

    def _trace(self, data: dict[str, Any]) -> dict[str, int]:
        if "CanopyTick" not in data:
            raise self.error("trace", "has no CanopyTick: the DBC has no trace messages, so nothing can be watched")
        trace = {name: self._number(data, "trace.", name, 0, ID_MAX) for name in TRACE_MESSAGES if name in data}
        if len(set(trace.values())) != len(trace):
            raise self.error("trace", "gives two messages the same id")
        return trace

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
