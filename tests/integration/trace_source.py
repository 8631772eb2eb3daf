# SPDX-License-Identifier: MIT
"""A controller's trace as cantools writes it, from the DBC alone: it shares no code with the decoder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import can
import cantools
from cantools.database.can import Database

DBC = Path(__file__).resolve().parents[2] / "examples" / "nao" / "nao.dbc"
IDS = {
    "CanopyTick": 0x600,
    "CanopyChange": 0x601,
    "CanopySnapshot": 0x602,
    "CanopyHealth": 0x603,
    "CanopyInputs": 0x604,
    "CanopyModel": 0x605,
    "CanopyArrivals": 0x606,
}

Frame = tuple[int, bytes]


def model_data(nodes: int) -> dict[str, Any]:
    """A model file's content: a ReactiveFallback over nodes - 1 leaves (a lone leaf when nodes is 1)."""
    leaves = [
        {"index": i, "parent": 0, "end": i + 1, "type": "Look", "category": "condition", "name": f"n{i}", "line": i}
        for i in range(1, nodes)
    ]
    root = {"type": "ReactiveFallback", "category": "control", "name": "Get home", "line": 4}
    return {
        "format": 1,
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
        "trace": dict(IDS),
    }


def write_model(folder: Path, nodes: int = 4) -> Path:
    """A model file and its DBC in a folder; gives the model's path."""
    shutil.copy(DBC, folder / "nao.dbc")
    path = folder / "nao_home.model.json"
    path.write_text(json.dumps(model_data(nodes)), encoding="utf-8")
    return path


def database() -> Database:
    loaded = cantools.database.load_file(DBC)
    assert isinstance(loaded, Database)
    return loaded


class TraceSource:
    """Makes the frames of one tick after another. All nodes are IDLE at first."""

    def __init__(self, nodes: int) -> None:
        self._database = database()
        self.statuses = [0] * nodes
        self.tick = 0
        self.sequence = 0
        self._first = 0

    def frames(self, statuses: Sequence[int], root: int = 1, overruns: int = 0) -> list[Frame]:
        """The frames of the next tick, after which the nodes have these statuses."""
        changed = [(node, code) for node, code in enumerate(statuses) if code != self.statuses[node]]
        self.statuses = list(statuses)
        head = {"Tick": self.tick, "RootStatus": root, "Tree": 0, "Changes": len(changed), "Overruns": overruns & 255}
        frames = [self._frame("CanopyTick", head)]
        for place in range(0, len(changed), 2):
            (a, status_a), (b, status_b) = [*changed[place : place + 2], (0xFFFF, 15)][:2]
            pair = {"NodeA": a, "StatusA": status_a, "NodeB": b, "StatusB": status_b, "Tree": 0}
            frames.append(self._frame("CanopyChange", pair))
        window = [*self.statuses[self._first : self._first + 10], *[15] * 10][:10]
        snapshot = {"First": self._first, **{f"Status{i}": code for i, code in enumerate(window)}}
        frames.append(self._frame("CanopySnapshot", snapshot))
        self._first = self._first + 10 if self._first + 10 < len(statuses) else 0
        self.tick = (self.tick + 1) % 2**32
        return frames

    def health(self, **counters: int) -> Frame:
        fields = {"RxRejected": 0, "RxUnknown": 0, "TxDropped": 0, "Faults": 0, **counters}
        return IDS["CanopyHealth"], self._database.encode_message("CanopyHealth", fields)

    def inputs(self, now: int, taken: int, check: int) -> Frame:
        fields = {"Now": now, "Taken": taken, "Check": check}
        return IDS["CanopyInputs"], self._database.encode_message("CanopyInputs", fields)

    def arrivals(self, state: int = 0, overload: int = 0, returning: int = 0, ages: Sequence[int] = ()) -> Frame:
        fields = {"CanState": state, "Overload": overload, "Returning": returning, "Count": len(ages)}
        fields |= {f"Age{place}": age for place, age in enumerate([*ages, 0, 0, 0][:3])}
        return IDS["CanopyArrivals"], self._database.encode_message(
            "CanopyArrivals", {**fields, "Tick": (self.tick - 1) % 256}
        )

    def model(self, digits: int, nodes: int) -> Frame:
        return IDS["CanopyModel"], self._database.encode_message("CanopyModel", {"Hash": digits, "Nodes": nodes})

    def _frame(self, name: str, fields: dict[str, int]) -> Frame:
        data = self._database.encode_message(name, {"Sequence": self.sequence, **fields})
        self.sequence = (self.sequence + 1) % 256
        return IDS[name], data


def to_message(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame[0], data=frame[1], is_extended_id=False)
