# SPDX-License-Identifier: MIT
"""The node types, read from the runtime's own table `canopy/nodes.def` (a link to it lies beside this file)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

Category = Literal["LEAF", "CONTROL", "DECORATOR"]

ANY_NUMBER = 0xFFFF

_ROW = re.compile(
    r'^CANOPY_NODE\((?P<enum>\w+), "(?P<name>\w+)", (?P<category>\w+), (?P<least>\w+), (?P<most>\w+), (?P<words>\d+), '
    r'(?P<count>\d+), "(?P<parameters>[^"]*)", "(?P<text>[^"]*)"\)$'
)


@dataclass(frozen=True)
class Parameter:
    """An XML attribute that becomes a 32-bit parameter; `default` is "" when it must be given."""

    name: str
    default: str


@dataclass(frozen=True)
class NodeType:
    """One row of nodes.def."""

    number: int
    enum: str
    name: str
    category: Category
    least_children: int
    most_children: int
    words: int
    parameters: tuple[Parameter, ...]
    text: str

    def arity_text(self) -> str:
        """How many children, in words."""
        if self.least_children == self.most_children:
            return f"exactly {self.least_children}"
        if self.most_children == ANY_NUMBER:
            return f"at least {self.least_children}"
        return f"{self.least_children} to {self.most_children}"


@cache
def node_types() -> dict[str, NodeType]:
    """All node types by XML name, in the order of the engine's enum."""
    table: dict[str, NodeType] = {}
    for line in (Path(__file__).parent / "nodes.def").read_text(encoding="utf-8").splitlines():
        row = _ROW.match(line)
        if row is None:
            if line.startswith("CANOPY_NODE("):
                raise RuntimeError(f"nodes.def: a row that cannot be read: {line}")
            continue
        category = row["category"]
        if category not in ("LEAF", "CONTROL", "DECORATOR"):
            raise RuntimeError(f"nodes.def: unknown category {category}")
        parameters = tuple(Parameter(*part.partition("=")[::2]) for part in row["parameters"].split())
        if len(parameters) != int(row["count"]):
            raise RuntimeError(f"nodes.def: {row['name']} says {row['count']} parameters")
        table[row["name"]] = NodeType(
            number=len(table),
            enum=f"CANOPY_NODE_{row['enum']}",
            name=row["name"],
            category=category,  # type: ignore[arg-type]
            least_children=int(row["least"], 0),
            most_children=int(row["most"], 0),
            words=int(row["words"]),
            parameters=parameters,
            text=row["text"],
        )
    return table
