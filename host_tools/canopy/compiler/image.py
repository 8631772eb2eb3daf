# SPDX-License-Identifier: MIT
"""Tree images: a compiled tree as bytes for a firmware that has its leaves (docs/image.md has every byte)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopy.compiler.blackboard import Entry
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.image_catalogue import Catalogue
from canopy.compiler.image_names import base_signature, entry_signature, hash64, is_fixed, leaf_signature, target_of
from canopy.compiler.image_room import Room
from canopy.compiler.leaf_model import Port
from canopy.compiler.numbers import exact
from canopy.compiler.table import Row, Table
from canopy.compiler.tree import Bound, Node
from canopy.files import read_bytes

MAGIC = b"CNPY"
VERSION = 1
HEADER = struct.Struct("<4sHHIIQQHHHHHHIII")
NODE = struct.Struct("<BBHHHHH")
VALUE = struct.Struct("<IQ")
CRC_AT = 12
NO_LEAF = 0xFFFF
FROM_BASE, FROM_CONSTANT, FROM_TEXT, FROM_ENTRY, FROM_NOTHING = range(5)
SOURCES = ("base", "constant", "text", "entry", "nothing")


class _Texts:
    """NUL-terminated texts, each once."""

    def __init__(self) -> None:
        self.bytes = b""
        self._places: dict[str, int] = {}

    def place(self, text: str) -> int:
        if text not in self._places:
            self._places[text] = len(self.bytes)
            self.bytes += text.encode() + b"\0"
        return self._places[text]


def _number(text: str, port: Port) -> int:
    """A constant that binding has checked, as bits."""
    if port.type.kind == "bool":
        return int(text.lower() in ("true", "1"))
    if port.type.kind == "float":
        form = "f" if port.type.c == "float" else "d"
        return int.from_bytes(struct.pack(f"<{form}", float(text)), "little")
    value = int(exact(text) / port.type.scale) if port.type.kind == "fixed" else int(text, 0)
    return value if value >= 0 else value + (port.type.high - port.type.low + 1)


class _Writer:
    def __init__(self, table: Table, firmware: dict[str, Any], name: str) -> None:
        self._table = table
        self._firmware = firmware
        self._name = name
        self._catalogue = Catalogue(table, Room(0, 0, 0, 0, 0))  # for the hashes; an image has no room itself
        self._entries = {id(entry): place for place, entry in enumerate(table.bindings.entries)}
        self._counted = {entry["signature"]: entry["counted"] for entry in firmware["entries"]}
        self._kinds = {kind["id"]: kind for kind in firmware["kinds"]}
        self._numbers = {use.leaf.id: number for number, use in enumerate(table.users)}
        self._next = dict.fromkeys(self._numbers, 0)
        self._texts = _Texts()
        self._uses: list[int] = []
        self._values: list[bytes] = []

    def image(self) -> bytes:
        """All bytes.

        Raises:
            CompileError: the firmware does not have what the tree names, or too little room.
        """
        table = self._table
        if self._firmware["engine"] != f"{self._catalogue.engine:016x}":
            raise self._error(
                table.tree.root.place, "its runtime has other node types than this compiler", "build it again"
            )
        self._check_names()
        nodes = [self._node(row) for row in table.rows]
        self._check_room()
        parts = [
            *nodes,
            *(struct.pack("<i", value) for value in table.parameters),
            *(struct.pack("<Q", self._catalogue.kind_hash(use)) for use in table.users),
            *(struct.pack("<Q", value) for value in self._catalogue.script_hashes()),
            *(struct.pack("<Q", value) for value in self._catalogue.entry_hashes()),
            *(struct.pack("<Q", value) for value in self._uses),
            *self._values,
            self._texts.bytes,
        ]
        body = b"".join(parts)
        header = HEADER.pack(
            MAGIC,
            VERSION,
            0,
            HEADER.size + len(body),
            0,
            int(table.hash, 16),
            self._catalogue.engine,
            len(table.rows),
            len(table.parameters),
            table.words,
            len(table.users),
            len(table.scripts),
            len(table.bindings.entries),
            len(self._uses),
            len(self._values),
            len(self._texts.bytes),
        )
        crc = zlib.crc32(header[:CRC_AT] + header[CRC_AT + 4 :] + body)
        return header[:CRC_AT] + struct.pack("<I", crc) + header[CRC_AT + 4 :] + body

    def _error(self, place: Place, message: str, help_text: str = "") -> CompileError:
        return CompileError(place, f"firmware '{self._name}': {message}", help_text)

    def _check_names(self) -> None:
        for use in self._table.users:
            leaf, known = use.leaf, self._kinds.get(use.leaf.id)
            if known is None:
                raise self._error(
                    use.nodes[0].place, f"has no {leaf.kind} '{leaf.id}'", nearest(leaf.id, list(self._kinds))
                )
            if known["signature"] != leaf_signature(leaf):
                raise self._error(
                    use.nodes[0].place,
                    f"'{leaf.id}' is declared differently there",
                    f"there: {known['signature']}; here: {leaf_signature(leaf)}",
                )
        names = [entry["name"] for entry in self._firmware["entries"]]
        for entry in self._table.bindings.entries:
            if entry_signature(entry) not in self._counted:
                same = [e["signature"] for e in self._firmware["entries"] if e["name"] == entry.name]
                there = f"there: {'; '.join(same)}" if same else nearest(entry.name, names)
                raise self._error(entry.place, f"has no entry {{{entry.name}}}: {entry_signature(entry)}", there)
        scripts = set(self._firmware["scripts"])
        for script, number in zip(self._table.scripts, self._catalogue.script_hashes(), strict=True):
            if f"{number:016x}" not in scripts:
                raise self._error(
                    script.place(),
                    f'has no such script: {script.attribute}="{script.text}"',
                    "scripts are C code: an image can use those that the firmware's own tree has",
                )

    def _check_room(self) -> None:
        table, place = self._table, self._table.tree.root.place
        for what, used in (
            ("nodes", len(table.rows)),
            ("parameters", len(table.parameters)),
            ("words", table.words),
            ("texts", len(self._texts.bytes)),
        ):
            if used > self._firmware[what]:
                raise self._error(place, f"has room for {self._firmware[what]} {what}, not {used}", "raise IMAGE_NODES")
        for use in table.users:
            if len(use.nodes) > self._firmware["uses"]:
                raise self._error(
                    use.nodes[self._firmware["uses"]].place,
                    f"has room for {self._firmware['uses']} uses of '{use.leaf.id}', not {len(use.nodes)}",
                    "raise IMAGE_USES",
                )

    def _node(self, row: Row) -> bytes:
        leaf, parameter = row.leaf, row.parameter
        if row.node.leaf is not None:
            leaf, parameter = self._numbers[row.node.leaf.id], 0
            self._use(row.node, leaf)
        elif row.node.script is not None:
            leaf = NO_LEAF
        return NODE.pack(row.node.type.number, row.asks, row.parent, row.end, row.state, leaf, parameter)

    def _use(self, node: Node, kind: int) -> None:
        use = self._table.users[kind]
        index = self._next[use.leaf.id]
        self._next[use.leaf.id] += 1
        known = self._kinds[use.leaf.id]
        signature = base_signature(self._table, kind, index) if use.leaf.ports else ""
        base = hash64(signature) if signature else 0
        if base and f"{base:016x}" not in known["bases"]:
            fixed = [b.port.name for b in node.bound if is_fixed(b.port, b)]
            raise self._error(
                node.place,
                f"no use of '{use.leaf.id}' has {' and '.join(fixed)} like this",
                "signals, texts from entries, constants of your own types, NULL: bound together, as in one use there",
            )
        self._uses.append(base)
        for port, bound in zip(use.leaf.ports, node.bound, strict=True):
            self._values.append(VALUE.pack(*self._value(port, bound, known["counted"])))

    def _value(self, port: Port, bound: Bound, counted: list[str]) -> tuple[int, int]:
        target = target_of(bound)
        if is_fixed(port, bound):
            return FROM_BASE, 0
        if isinstance(target, Entry):
            if port.writes and self._counted[entry_signature(target)] and port.name not in counted:
                raise self._error(
                    bound.place,
                    f"a node there waits for updates of {{{target.name}}}, and port '{port.name}' does not count them",
                    "connect the port to such an entry in the firmware's own tree, too",
                )
            return FROM_ENTRY, self._entries[id(target)]
        if target is None:
            return FROM_NOTHING if port.writes else FROM_CONSTANT, 0
        assert isinstance(target, str)
        if port.type.kind == "text":
            return FROM_TEXT, self._texts.place(target)
        return FROM_CONSTANT, _number(target, port)


def make_image(table: Table, firmware: dict[str, Any], name: str) -> bytes:
    """The image of a tree for the firmware `name`, whose model file says `firmware` under "image".

    Raises:
        CompileError: the firmware would refuse it.
    """
    return _Writer(table, firmware, name).image()


class ImageError(ValueError):
    """The bytes are no image of this format."""


@dataclass(frozen=True)
class Image:
    """What an image says of itself."""

    size: int
    crc: int
    crc_is_right: bool
    hash: int
    engine: int
    nodes: tuple[tuple[int, ...], ...]
    parameters: tuple[int, ...]
    words: int
    kinds: tuple[int, ...]
    scripts: tuple[int, ...]
    entries: tuple[int, ...]
    uses: tuple[int, ...]
    values: tuple[tuple[int, int], ...]
    texts: bytes


def read_image(path: Path) -> Image:
    """Takes an image apart; a wrong CRC is said, not refused.

    Raises:
        ImageError: it is no image, or of another format version, or not as long as it says.
        FileError: the file cannot be read.
    """
    data = read_bytes(path)
    if len(data) < HEADER.size or data[:4] != MAGIC:
        raise ImageError("is no tree image")
    fields = HEADER.unpack_from(data)
    _, version, _, size, crc, tree, engine, nodes, parameters, words, kinds, scripts, entries, uses, values, texts = (
        fields
    )
    if version != VERSION:
        raise ImageError(f"has format {version}; these tools read {VERSION}")
    needed = HEADER.size + 12 * nodes + 4 * parameters + 8 * (kinds + scripts + entries + uses) + 12 * values + texts
    if not size == needed == len(data):
        raise ImageError(f"has {len(data)} bytes, says {size}, and needs {needed}")
    offset = HEADER.size

    def take(form: str, count: int, make: Callable[[tuple[Any, ...]], Any]) -> tuple[Any, ...]:
        nonlocal offset
        start, offset = offset, offset + struct.calcsize(form) * count
        return tuple(make(record) for record in struct.iter_unpack(form, data[start:offset]))

    def first(record: tuple[Any, ...]) -> Any:
        return record[0]

    return Image(
        size=size,
        crc=crc,
        crc_is_right=crc == zlib.crc32(data[:CRC_AT] + data[CRC_AT + 4 :]),
        hash=tree,
        engine=engine,
        nodes=take(NODE.format, nodes, tuple),
        parameters=take("<i", parameters, first),
        words=words,
        kinds=take("<Q", kinds, first),
        scripts=take("<Q", scripts, first),
        entries=take("<Q", entries, first),
        uses=take("<Q", uses, first),
        values=take(VALUE.format, values, tuple),
        texts=data[offset:],
    )
