# SPDX-License-Identifier: MIT
"""What the program sends in a replay, against what the controller sent into the log: bit for bit, by message."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

import can
from cantools.database.can import Message as DbcMessage

from canopy.replay.log import Bus, Run, Sent, key
from canopy.trace import status_name

NOT_COMPARED = {"CanopyTick": bytes([0] * 7 + [0xFF]), "CanopyHealth": bytes([0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0])}
"""Bits that do not follow from the inputs: Overruns; RxUnknown and TxDropped."""
_SNAPSHOT_NODES = 10
_NO_NODE = 0xFFFF
_NO_STATUS = 15


@dataclass(frozen=True)
class Difference:
    """One value that the log and the replay disagree about."""

    tick: int
    message: str
    what: str
    """A signal, a node, or "frame"."""
    recorded: str
    replayed: str
    frame: int | None
    """Number of the frame in the log; None: the log has none."""

    def text(self) -> str:
        """One line for people."""
        where = f"tick {self.tick}" + (f" (frame {self.frame} of the log)" if self.frame is not None else "")
        return f"{where}: {self.message}: {self.what}: recorded {self.recorded}, replayed {self.replayed}"


@dataclass
class Result:
    """What a comparison came to."""

    ticks: int = 0
    """Ticks that are equal, from the first one on."""
    frames: int = 0
    """Frames compared."""
    differences: list[Difference] = field(default_factory=list)
    """Of the first tick that is not equal."""

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


class Comparison:
    """Feed it the frames of the replay in their order."""

    def __init__(self, bus: Bus, run: Run, ticks: int) -> None:
        self._bus = bus
        self._run = run
        self._ticks = ticks
        self._next = dict.fromkeys(bus.sent, 0)
        self._tick = -1
        self._result = Result()
        self._cut = run.gap is None and ticks == len(run.ticks)

    def run(self, frames: Iterable[can.Message]) -> Result:
        """Compares up to the end of the first tick that differs."""
        for message in frames:
            number = key(message.arbitration_id, message.is_extended_id)
            self._tick += self._bus.trace.get(number) == "CanopyTick"
            # A command is sent before its tick's CanopyTick.
            tick = self._tick if number in self._bus.trace else self._tick + 1
            if tick >= self._ticks:
                break  # the safe commands at the program's end, whose time nobody knows
            if self._result.differences and tick > self._result.differences[0].tick:
                break
            self._compare(number, bytes(message.data), tick)
        if not self._result.differences:
            self._look_for_more()
        first = self._result.differences
        self._result.ticks = first[0].tick if first else self._tick_count()
        return self._result

    def _tick_count(self) -> int:
        return min(self._tick + 1, self._ticks)

    def _compare(self, number: int, data: bytes, tick: int) -> None:
        recorded = self._recorded(number)
        name = self._bus.sent[number].name if number in self._bus.sent else f"0x{number:X}"
        if recorded is None or recorded.tick > tick:
            # The log may end within the last tick.
            if not (self._cut and tick == self._ticks - 1):
                self._differ(tick, name, "frame", "none", data.hex(" "), None)
            if recorded is None or not self._same(number, recorded.data, data):
                return
        self._next[number] += 1
        self._result.frames += 1
        if not self._same(number, recorded.data, data):
            for what, was, now in self._explain(number, recorded.data, data):
                self._differ(tick, name, what, was, now, recorded.place)

    def _recorded(self, number: int) -> Sent | None:
        frames = self._run.sent.get(number, [])
        place = self._next.get(number, 0)
        return frames[place] if place < len(frames) else None

    def _same(self, number: int, recorded: bytes, replayed: bytes) -> bool:
        mask = NOT_COMPARED.get(self._bus.trace.get(number, ""))
        if mask is None or len(recorded) != len(mask) or len(replayed) != len(mask):
            return recorded == replayed
        return all((a ^ b) & ~bits == 0 for a, b, bits in zip(recorded, replayed, mask, strict=True))

    def _differ(self, tick: int, message: str, what: str, recorded: str, replayed: str, frame: int | None) -> None:
        self._result.differences.append(Difference(tick, message, what, recorded, replayed, frame))

    def _look_for_more(self) -> None:
        """Frames that the log has and the replay does not send."""
        done = self._tick_count()
        if done < self._ticks:
            self._differ(done, "CanopyTick", "frame", "sent", "the program ended", self._run.ticks[done].place)
            return
        for number in self._bus.sent:
            recorded = self._recorded(number)
            if recorded is not None and recorded.tick < self._ticks:
                name = self._bus.sent[number].name
                self._differ(recorded.tick, name, "frame", recorded.data.hex(" "), "none", recorded.place)

    def _explain(self, number: int, recorded: bytes, replayed: bytes) -> list[tuple[str, str, str]]:
        """What differs, by signal or by node; the frame's bytes where they cannot be decoded."""
        kind = self._bus.trace.get(number)
        if kind in ("CanopyChange", "CanopySnapshot"):
            read = _changes if kind == "CanopyChange" else _snapshot
            return self._explain_nodes(read(recorded), read(replayed))
        message = self._bus.sent[number]
        was, now = _decode(message, recorded), _decode(message, replayed)
        names = [name for name in was if was[name] != now.get(name)]
        values = [name for name in names if not name.startswith("E2E_")] or names
        found = [(name, was[name], now.get(name, "none")) for name in values]
        return found or [("frame", recorded.hex(" "), replayed.hex(" "))]

    def _explain_nodes(self, was: dict[int, str], now: dict[int, str]) -> list[tuple[str, str, str]]:
        nodes = self._bus.model.nodes
        found = []
        for node in sorted(was.keys() | now.keys()):
            if was.get(node) != now.get(node):
                name = f"node {node}" + (f" '{nodes[node].name}'" if node < len(nodes) else "")
                found.append((name, was.get(node, "not in this frame"), now.get(node, "not in this frame")))
        return found or [("Sequence", "another one", "another one")]


def _decode(message: DbcMessage, data: bytes) -> dict[str, str]:
    try:
        raw = message.decode_simple(data, decode_choices=False, scaling=False)
        values = message.decode_simple(data)
    except Exception:
        # cantools: too short, an unknown multiplexer
        return {"frame": data.hex(" ")}
    return {
        name: f"{value} ({raw[name]})" if isinstance(value, str) or not isinstance(value, int | float) else f"{value:g}"
        for name, value in values.items()
    }


def _status(code: int) -> str:
    try:
        return status_name(code)
    except ValueError:
        return f"code {code}"


def _changes(data: bytes) -> dict[int, str]:
    pairs = (
        (int.from_bytes(data[1:3], "little"), data[5] & 15),
        (int.from_bytes(data[3:5], "little"), data[5] >> 4),
    )
    return {node: _status(code) for node, code in pairs if node != _NO_NODE}


def _snapshot(data: bytes) -> dict[int, str]:
    first = int.from_bytes(data[1:3], "little")
    codes = [(byte >> shift) & 15 for byte in data[3:] for shift in (0, 4)]
    return {first + place: _status(code) for place, code in enumerate(codes) if code != _NO_STATUS}
