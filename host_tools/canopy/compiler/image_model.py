# SPDX-License-Identifier: MIT
"""The model file of a firmware, as tree images need it. canopy.model reads it for tools that watch."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from canopy.compiler.emit import MODEL_FORMAT
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.image_room import IMAGE_NODES, IMAGE_TEXTS, IMAGE_USES
from canopy.compiler.limits import COUNT, PERIOD_MS, Limits, whole
from canopy.compiler.table import Table
from canopy.compiler.trace import known_within_ms
from canopy.files import FileError, read_text

BUILD_AGAIN = "build the firmware again"
FIELDS: dict[str, type] = {
    "application": str,
    "bus.dbc": str,
    "bus.node": str,
    "image.engine": str,
    **{f"image.{what}": list for what in ("kinds", "scripts", "entries")},
    "image.types.floating_point": bool,
    "image.types.unset_ports": bool,
    "image.types.map": dict,
}
NUMBERS: dict[str, Limits] = {
    "period_us": Limits(1000 * PERIOD_MS.low, 1000 * PERIOD_MS.high, "us"),
    "image.nodes": IMAGE_NODES,
    "image.uses": IMAGE_USES,
    "image.parameters": COUNT,
    "image.words": COUNT,
    "image.texts": IMAGE_TEXTS,
}
# The members of the items of lists; an item of "scripts" is a text itself.
ITEMS: dict[str, dict[str, type]] = {
    "kinds": {"id": str, "signature": str, "bases": list, "counted": list},
    "entries": {"name": str, "signature": str, "counted": bool},
}


def _field(data: dict[str, Any], path: str, kind: type, place: Place) -> Any:
    """A value of the model file, `image.types.map` for example."""
    value: Any = data
    for name in path.split("."):
        value = value.get(name) if isinstance(value, dict) else None
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise CompileError(place, f"{path} is not of type {kind.__name__}", BUILD_AGAIN)
    return value


def _check_items(image: dict[str, Any], place: Place) -> None:
    for name, members in ITEMS.items():
        for number, item in enumerate(image[name]):
            where = f"image.{name}[{number}]"
            if not isinstance(item, dict):
                raise CompileError(place, f"{where} is not of type dict", BUILD_AGAIN)
            for member, kind in members.items():
                value = item.get(member)
                texts = value if kind is list and isinstance(value, list) else []
                if not isinstance(value, kind) or not all(isinstance(text, str) for text in texts):
                    raise CompileError(place, f"{where}.{member} is not of type {kind.__name__}", BUILD_AGAIN)
    texts = [*image["scripts"], *image["types"]["map"].values(), image["types"].get("include") or ""]
    if not all(isinstance(text, str) for text in texts):
        raise CompileError(place, "image.scripts, image.types.map and image.types.include must be texts", BUILD_AGAIN)


def read_firmware(path: Path) -> dict[str, Any]:
    """The model file's content; what make_image() and the compiler take from it is of the right type and size.

    Raises:
        CompileError: it cannot be read, or is not what `canopy compile --image-nodes` of this version writes.
    """
    place = Place(str(path))
    try:
        data = json.loads(read_text(path))
    except FileError as error:
        raise CompileError(place, error.problem, "the build writes it") from error
    except (ValueError, RecursionError) as error:
        raise CompileError(place, f"is no JSON: {error}") from error
    if not isinstance(data, dict) or data.get("format") != MODEL_FORMAT:
        raise CompileError(place, "is no model file of this version", BUILD_AGAIN)
    if "image" not in data:
        raise CompileError(place, "this firmware takes no images", "build it with IMAGE_NODES, or --image-nodes")
    for name, kind in FIELDS.items():
        _field(data, name, kind, place)
    for name, limits in NUMBERS.items():
        whole(_field(data, name, int, place), limits, name, place, BUILD_AGAIN)
    _check_items(data["image"], place)
    return data


def image_trace(data: dict[str, Any], table: Table) -> dict[str, Any] | None:
    """The member "trace" of an image's own model file: the firmware's, with the reasons of the image's leaves.

    A firmware has room for the reasons of so many uses of a leaf as its own tree has, in their order.

    Raises:
        CompileError: the firmware's model file has something else there.
    """
    trace = data.get("trace")
    if trace is None:
        return None
    uses = {use.leaf.id: [id(node) for node in use.nodes] for use in table.users}
    places = {id(row.node): index for index, row in enumerate(table.rows)}
    seen: Counter[str] = Counter()
    values = []
    try:
        for value in trace["values"]:
            if value["kind"] == "reason":
                leaf = data["tree"]["nodes"][value["node"]]["type"]
                nodes, number = uses.get(leaf, []), seen[leaf]
                seen[leaf] += 1
                if number >= len(nodes):
                    continue
                row = table.rows[places[nodes[number]]]
                value = {**value, "name": row.node.name, "path": row.node.path, "node": places[nodes[number]]}
            values.append(value)
        slots = sum(value["slots"] for value in values)
        known = known_within_ms(
            data["period_us"] // 1000, len(table.rows), trace["snapshot_every"], slots, trace["values_every"]
        )
    except (KeyError, IndexError, TypeError) as error:
        raise CompileError(Place("trace"), f"the firmware's model file is wrong at {error}", BUILD_AGAIN) from error
    return {**trace, "values": values, "known_within_ms": known}
