# SPDX-License-Identifier: MIT
"""A controller's trace, written from docs/trace.md alone: it shares no code with the decoder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can
import cantools
from cantools.database.can import Database
from e2e.p11 import e2e_p11_protect

from canopy.model import Model, load_model

DBC = Path(__file__).resolve().parents[2] / "examples" / "nao" / "nao.dbc"
BASE = 0x600
NAMES = (
    "CanopyTick",
    "CanopyInputs",
    "CanopyArrivals",
    "CanopySnapshot",
    "CanopyChange",
    "CanopyValue",
    "CanopyHealth",
    "CanopyModel",
)
IDS = {name: BASE + place for place, name in enumerate(NAMES)}

Frame = tuple[int, bytes]

# Start bit and length of each signal, from the tables.
LAYOUT: dict[str, dict[str, tuple[int, int]]] = {
    "CanopyTick": {
        "Crc": (0, 8),
        "Counter": (8, 4),
        "Version": (12, 4),
        "Tick": (16, 32),
        "Sequence": (48, 6),
        "HasSnapshot": (54, 1),
        "HasChanges": (55, 1),
        "RootStatus": (56, 3),
        "Values": (59, 3),
        "Overruns": (62, 2),
    },
    "CanopyInputs": {
        "Now": (0, 24),
        "Taken": (24, 8),
        "Check": (32, 8),
        "CanState": (40, 3),
        "Overload": (43, 1),
        "Returning": (44, 1),
        "Ages": (45, 2),
        "Many": (47, 1),
        "Age0": (48, 8),
        "Age1": (56, 8),
    },
    "CanopySnapshot": {
        "Sequence": (0, 6),
        "Part": (8, 13),
        "Tick": (21, 3),
        **{f"Status{place}": (24 + 4 * place, 4) for place in range(10)},
    },
    "CanopyChange": {
        "Sequence": (0, 6),
        "More": (6, 2),
        "Block": (8, 12),
        "Tick": (20, 4),
        **{f"Entry{place}": (24 + 8 * place, 8) for place in range(5)},
    },
    "CanopyValue": {"Slot": (0, 12), "Tick": (12, 4), "More": (16, 1), "Value": (32, 32)},
    "CanopyModel": {"Page": (0, 4), "Version": (4, 4), "Hash": (8, 32), "Nodes": (40, 16)},
}


def bits(name: str, **signals: int) -> bytes:
    """A frame's 8 bytes from its signals; those that are not given are 0."""
    value = 0
    for signal, number in signals.items():
        start, length = LAYOUT[name][signal]
        assert 0 <= number < 1 << length, (name, signal, number)
        value |= number << start
    return value.to_bytes(8, "little")


def model_data(nodes: int) -> dict[str, Any]:
    """A model file's content: a ReactiveFallback over nodes - 1 leaves (a lone leaf when nodes is 1)."""
    leaves = [
        {"index": i, "parent": 0, "end": i + 1, "type": "Look", "category": "condition", "name": f"n{i}", "line": i}
        for i in range(1, nodes)
    ]
    root = {"type": "ReactiveFallback", "category": "control", "name": "Get home", "line": 4}
    return {
        "format": 2,
        "canopy": "0.1.0",
        "application": "nao_home",
        "hash": "0123456789abcdef",
        "period_us": 50000,
        "tree": {
            "id": "GetHome",
            "file": "x.xml",
            "nodes": [{"index": 0, "parent": None, "end": nodes, **root}, *leaves],
        },
        "bus": {
            "dbc": "nao.dbc",
            "node": "Controller",
            "receive": ["Battery", "Posture"],
            "send": ["PowerCommand", "PostureCommand"],
        },
        "trace": {
            "version": 2,
            "base": BASE,
            "extended": False,
            "guard": None,
            "snapshot_every": 2,
            "ticks": 4,
            "changes_max": 8,
            "values_max": 2,
            "values_every": 10,
            "health_every": 4,
            "model_every": 20,
            "known_within_ms": 2000,
            "values": [],
            "texts": [],
        },
    }


VALUES: list[dict[str, Any]] = [
    {"kind": "entry", "name": "count", "path": "", "type": "int32_t", "slot": 0, "slots": 1},
    {"kind": "entry", "name": "far", "path": "arm", "type": "uint64_t", "slot": 1, "slots": 2, "unit": "mm"},
    {
        "kind": "entry",
        "name": "warm",
        "path": "",
        "type": "int16_t",
        "slot": 3,
        "slots": 1,
        "scale": "0.1",
        "unit": "°C",
    },
    {
        "kind": "reason",
        "name": "n1",
        "path": "",
        "node": 1,
        "type": "uint8_t",
        "slot": 4,
        "slots": 1,
        "enum": {"": 0, "dark": 1},
    },
    {"kind": "entry", "name": "word", "path": "", "type": "text", "slot": 5, "slots": 1},
    {"kind": "entry", "name": "exact", "path": "", "type": "double", "slot": 6, "slots": 2},
    {"kind": "entry", "name": "rough", "path": "", "type": "float", "slot": 8, "slots": 1},
    {"kind": "entry", "name": "on", "path": "", "type": "bool", "slot": 9, "slots": 1},
]
TEXTS = ["", "left", "right"]
SLOTS = 10
NUMBERS: list[dict[str, Any]] = [
    *({"kind": "entry", "name": f"v{i}", "path": "", "type": "uint32_t", "slot": i, "slots": 1} for i in range(6)),
    *({"kind": "entry", "name": f"v{i}", "path": "", "type": "uint64_t", "slot": i, "slots": 2} for i in (6, 8)),
]
"""The same slots as plain numbers."""


def write_model(folder: Path, nodes: int = 4, **trace: Any) -> Path:
    """A model file and its DBC in a folder; gives the model's path. `trace`: members that are others."""
    shutil.copy(DBC, folder / "nao.dbc")
    path = folder / "nao_home.model.json"
    data = model_data(nodes)
    data["trace"] |= trace
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


def models_by_size(folder: Path, sizes: Sequence[int]) -> dict[int, Model]:
    """Models with so many nodes, and those of more than one with NUMBERS."""
    made = {}
    for nodes in sizes:
        (folder / str(nodes)).mkdir()
        made[nodes] = load_model(write_model(folder / str(nodes), nodes, values=NUMBERS if nodes > 1 else []))
    return made


def database() -> Database:
    loaded = cantools.database.load_file(DBC)
    assert isinstance(loaded, Database)
    return loaded


@dataclass
class TraceSource:
    """Makes the frames of one tick after another."""

    nodes: int
    slots: int = 0
    guard: int | None = None
    snapshot_every: int = 2
    changes_max: int = 8
    values_max: int = 2
    values_every: int = 10
    tick: int = 0
    sequence: int = 0
    told: list[int] = field(init=False)
    told_slots: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self.told = [0] * self.nodes
        self.told_slots = [0] * self.slots
        self._has_begun = False
        self._counter = 0
        self._part = 0
        self._next_node = 0
        self._next_slot = 0
        self._refreshed_slot = 0

    def frames(
        self, codes: Sequence[int], root: int = 1, overruns: int = 0, values: Sequence[int] = (), **inputs: int
    ) -> list[Frame]:
        """The frames of the next tick, after which the nodes have these codes and the slots these values."""
        snapshot = self._snapshot(codes) if self.tick % self.snapshot_every == 0 else None
        changes = self._changes(codes)
        told = self._values([*values, *self.told_slots[len(values) :]])
        if self.tick == 0 and self.sequence == 0 and self._has_begun:
            self.sequence = 1  # only a start has both
        self._has_begun = True
        head = self._tick_frame(
            Tick=self.tick,
            HasSnapshot=int(snapshot is not None),
            HasChanges=int(bool(changes)),
            RootStatus=root,
            Values=len(told),
            Overruns=overruns % 4,
        )
        frames = [head, (IDS["CanopyInputs"], bits("CanopyInputs", **inputs))]
        if snapshot is not None:
            frames.append(self._numbered("CanopySnapshot", Tick=self.tick % 8, **snapshot))
        frames += [self._numbered("CanopyChange", Tick=self.tick % 16, **change) for change in changes]
        frames += [(IDS["CanopyValue"], bits("CanopyValue", Tick=self.tick % 16, **one)) for one in told]
        self.tick = (self.tick + 1) % 2**32
        return frames

    def health(self, page: int, *numbers: int, last: int = 0, filtered: bool = False) -> Frame:
        """A page of up to three numbers of two bytes, and the last byte."""
        data = bytes([page | filtered << 4]) + b"".join(number.to_bytes(2, "little") for number in numbers)
        return IDS["CanopyHealth"], data.ljust(7, b"\0") + bytes([last])

    def model(self, digits: int, nodes: int, version: int = 2) -> Frame:
        return IDS["CanopyModel"], bits("CanopyModel", Version=version, Hash=digits, Nodes=nodes)

    def _tick_frame(self, **signals: int) -> Frame:
        identifier, data = self._numbered("CanopyTick", Version=2, **signals)
        if self.guard is None:
            return identifier, data
        guarded = bytearray(data)
        guarded[1] |= self._counter
        self._counter = (self._counter + 1) % 15
        e2e_p11_protect(guarded, self.guard, increment_counter=False)
        return identifier, bytes(guarded)

    def _numbered(self, name: str, **signals: int) -> Frame:
        data = bits(name, Sequence=self.sequence, **signals)
        self.sequence = (self.sequence + 1) % 64
        return IDS[name], data

    def _snapshot(self, codes: Sequence[int]) -> dict[str, int]:
        first = 10 * self._part
        window = [*codes[first : first + 10], *[15] * 10][:10]
        self.told[first : first + 10] = codes[first : first + 10]
        part, self._part = self._part, (self._part + 1) % -(-self.nodes // 10)
        return {"Part": part, **{f"Status{place}": code for place, code in enumerate(window)}}

    def _changes(self, codes: Sequence[int]) -> list[dict[str, int]]:
        """Once around from where the tick before has stopped, in frames of five entries."""
        around = [(self._next_node + step) % self.nodes for step in range(self.nodes)]
        changed = [node for node in around if codes[node] != self.told[node]]
        frames: list[dict[str, int]] = []
        while changed and len(frames) < self.changes_max:
            position = changed[0] // 16 * 16
            frame, entries = {"Block": position // 16, "More": 0}, 0
            while changed and entries < 5 and changed[0] >= position:
                node = changed[0]
                blocks = (node - position) // 16
                if blocks and entries == 4:
                    break  # a skip alone is of no use
                if blocks:
                    blocks = min(blocks, 14)
                    frame[f"Entry{entries}"] = (blocks - 1) << 4 | 15
                    position += 16 * blocks
                else:
                    frame[f"Entry{entries}"] = (node - position) << 4 | codes[node]
                    position = node + 1
                    self.told[node] = codes[node]
                    changed.pop(0)
                entries += 1
            for entry in range(entries, 5):
                frame[f"Entry{entry}"] = 0xFF
            frames.append(frame)
            self._next_node = position % self.nodes
        if frames:
            frames[-1]["More"] = 2 if changed else 1
        return frames

    def _values(self, values: Sequence[int]) -> list[dict[str, int]]:
        if not self.slots:
            return []
        around = [(self._next_slot + step) % self.slots for step in range(self.slots)]
        changed = [slot for slot in around if values[slot] != self.told_slots[slot]]
        told = changed[: self.values_max]
        more = len(changed) > len(told)
        if told:
            self._next_slot = told[-1] + 1
        if self.tick % self.values_every == 0 and len(told) < self.values_max:
            if self._refreshed_slot not in told:
                told.append(self._refreshed_slot)
            self._refreshed_slot = (self._refreshed_slot + 1) % self.slots
        for slot in told:
            self.told_slots[slot] = values[slot]
        return [{"Slot": slot, "More": int(more), "Value": values[slot]} for slot in told]


def to_message(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame[0], data=frame[1], is_extended_id=False)
