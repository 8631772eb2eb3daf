# SPDX-License-Identifier: MIT
"""What a firmware offers to tree images: for the generated C, and for the model file that images are made from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from canopy.compiler.image_names import (
    base_signature,
    engine_hash,
    entry_signature,
    hash64,
    leaf_signature,
    script_signature,
    type_signature,
)
from canopy.compiler.image_room import Room
from canopy.compiler.leaf_model import Port
from canopy.compiler.port_types import Options, PortType
from canopy.compiler.table import LeafUse, Table


@dataclass(frozen=True)
class Catalogue:
    """A table with the room for images; the templates image_*.c.j2 ask it."""

    table: Table
    room: Room

    @property
    def engine(self) -> int:
        """See image_names.engine_hash()."""
        return engine_hash()

    @cached_property
    def _kinds(self) -> dict[str, int]:
        return {use.leaf.id: number for number, use in enumerate(self.table.users)}

    def kind(self, use: LeafUse) -> int:
        """The kind's number: its place in the catalogue."""
        return self._kinds[use.leaf.id]

    def kind_hash(self, use: LeafUse) -> int:
        """Of the kind's signature."""
        return hash64(leaf_signature(use.leaf))

    def base_hashes(self, use: LeafUse) -> list[int]:
        """Of each use in the firmware's own tree; 0 where an image can give all ports itself."""
        kind = self.kind(use)
        signatures = [base_signature(self.table, kind, node) for node in range(len(use.nodes))]
        return [hash64(text) if text else 0 for text in signatures]

    def script_hashes(self) -> list[int]:
        """Of each script."""
        texts = self.table.bindings.texts
        return [hash64(script_signature(script, texts)) for script in self.table.scripts]

    def entry_hashes(self) -> list[int]:
        """Of each entry."""
        return [hash64(entry_signature(entry)) for entry in self.table.bindings.entries]

    @cached_property
    def types(self) -> dict[str, int]:
        """The types of ports and entries, and their numbers."""
        ports = {type_signature(port.type) for use in self.table.users for port in use.leaf.ports}
        entries = {type_signature(entry.type) for entry in self.table.bindings.entries}
        return {signature: number for number, signature in enumerate(sorted(ports | entries))}

    def type_of(self, kind: PortType) -> int:
        """The type's number."""
        return self.types[type_signature(kind)]

    @staticmethod
    def form(port: Port) -> str:
        """The port's canopy_image_form_t."""
        if port.writes:
            return "CANOPY_IMAGE_WRITE"
        special = {"user": "CANOPY_IMAGE_READ", "text": "CANOPY_IMAGE_TEXT", "bool": "CANOPY_IMAGE_BOOL"}
        return special.get(port.type.kind, "CANOPY_IMAGE_NUMBER")

    def counts_updates(self, use: LeafUse, port: Port) -> bool:
        """Has the ports struct a pointer to the update counter?"""
        return (use.leaf.id, port.name) in self.table.bindings.counted_ports

    def model(self, options: Options) -> dict[str, object]:
        """The part "image" of the model file (docs/model.md)."""
        return {
            "engine": _hex(self.engine),
            "nodes": self.room.nodes,
            "uses": self.room.uses,
            "parameters": self.room.parameters,
            "words": self.room.words,
            "texts": self.room.texts,
            "kinds": [
                {
                    "id": use.leaf.id,
                    "signature": leaf_signature(use.leaf),
                    "bases": [_hex(base) for base in self.base_hashes(use)],
                    "counted": [port.name for port in use.leaf.ports if self.counts_updates(use, port)],
                }
                for use in self.table.users
            ],
            "scripts": [_hex(script) for script in self.script_hashes()],
            "entries": [
                {"name": entry.name, "signature": entry_signature(entry), "counted": entry.counted}
                for entry in self.table.bindings.entries
            ],
            "types": {
                "floating_point": options.floats,
                "unset_ports": options.unset_ports,
                "map": options.type_map,
                "include": options.include,
            },
        }


def _hex(value: int) -> str:
    return f"{value:016x}"
