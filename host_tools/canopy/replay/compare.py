# SPDX-License-Identifier: MIT
"""What the program decides in a replay, against what the controller sent into the log: bit for bit, by message.

The replay sends everything at once. In the recorded run a command may have been replaced, taken back or dropped before
it left: the log lacks it, and the E2E counters of those that left are others. So commands are compared without their
E2E bytes, the log's own E2E bytes must be right, and CanopyHealth must have counted what the log lacks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise

import can

from canopy.replay import e2e
from canopy.replay.align import Alignment, Lacking, Replayed, Rules, Same, align, not_counted
from canopy.replay.explain import explain
from canopy.replay.log import COUNTED_MAX, NEEDED, Bus, Run, Sent, key

_OVERRUNS, _PROTECTED_OVERRUNS = bytes([*[0] * 7, 0xC0]), bytes([0xFF, *[0] * 6, 0xC0])
_NO_COUNTS = bytes([0, *[0xFF] * 7])
_HEALTH = {0: bytes([0x10, 0, 0, *[0xFF] * 5]), 4: bytes([0, 0, 0, 0xFF, 0xFF, 0, 0, 0xFF])}
"""Bits that follow from clock, driver and bus, not from the inputs. Of CanopyTick Overruns, and the CRC over them; of
CanopyHealth all but RxRejected in page 0, LeafFaults and Timeouts in page 4."""
_LAST = 1 << 62
"""In the order of the replay's frames: behind all."""


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
    dropped: int = 0
    """Frames of these ticks that the log lacks, and that CanopyHealth counts as not sent."""
    uncounted: int = 0
    """Frames of these ticks that the log lacks so late that no CanopyHealth in it could count them."""
    differences: list[Difference] = field(default_factory=list)
    """Of the first tick that is not equal."""

    def as_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def _are_same(recorded: bytes, replayed: bytes, mask: bytes) -> bool:
    """All bits but those of the mask."""
    return len(recorded) == len(replayed) and all(
        (was ^ now) & ~unlike & 0xFF == 0 for was, now, unlike in zip(recorded, replayed, mask, strict=True)
    )


class Comparison:
    """Of a run's first `ticks` ticks."""

    def __init__(self, bus: Bus, run: Run, ticks: int) -> None:
        self._bus = bus
        self._run = run
        self._ticks = ticks
        self._whole = ticks - 1 if run.gap is None and ticks == len(run.ticks) else ticks
        """Of so many ticks the log has everything: it may end within the last one."""
        self._counted = run.counted
        self._guard = bus.model.trace.guard
        self._found: list[tuple[int, Difference]] = []
        """With its place in the replay."""

    def run(self, frames: Iterable[can.Message]) -> Result:
        """Compares the frames of the replay, given in their order, with the log."""
        replayed, done = self._sort(frames)
        if done < self._ticks:
            self._differ(done, 0, "CanopyTick", ("frame", "sent", "the program ended"), self._run.ticks[done].place)
        alignments = {number: self._align(number, sent) for number, sent in replayed.items()}
        lacking = []
        for number, alignment in alignments.items():
            self._judge(number, alignment, done)
            lacking += self._lacking(number, alignment, replayed[number])
        for one in not_counted(lacking, self._counted, COUNTED_MAX):
            self._differ_lacking(one.message, one.frame)
        return self._sum_up(done, alignments)

    def _sum_up(self, done: int, alignments: dict[int, Alignment]) -> Result:
        first = min((difference.tick for _, difference in self._found), default=None)
        result = Result(ticks=done if first is None else first)
        last = self._ticks if first is None else first
        for alignment in alignments.values():
            compared = alignment.pairs + alignment.other
            result.frames += sum(frame.tick <= min(last, self._ticks - 1) for _, frame in compared)
            result.dropped += sum(frame.tick < min(last, self._whole) for frame in alignment.lacking)
        if self._counted:
            result.uncounted = max(0, result.dropped - self._counted[-1][1])
            result.dropped -= result.uncounted
        self._found.sort(key=lambda found: found[0])
        result.differences = [difference for _, difference in self._found if difference.tick == first]
        return result

    def _sort(self, frames: Iterable[can.Message]) -> tuple[dict[int, list[Replayed]], int]:
        """The replay's frames by message, and how many ticks it has done."""
        result: dict[int, list[Replayed]] = {number: [] for number in self._bus.sent}
        done = 0
        for order, message in enumerate(frames):
            number = key(message.arbitration_id, message.is_extended_id)
            done += self._bus.trace.get(number) == "CanopyTick"
            # A command is sent before its tick's CanopyTick. Those at the program's end are of no tick, and may have
            # replaced those of the last tick before they left.
            tick = done - 1 if number in self._bus.trace else done
            if tick <= self._ticks:
                result.setdefault(number, []).append(Replayed(order, tick, bytes(message.data)))
        return result, min(done, self._ticks)

    def _align(self, number: int, replayed: Sequence[Replayed]) -> Alignment:
        may_lack = 0 if self._is_needed(number) else max((count for _, count in self._counted), default=0)
        ahead = 0 if number in self._bus.trace else self._bus.ahead
        # Behind the last CanopyHealth nothing counts what is lacking.
        counted_after = self._bus.ahead + 1
        whole = min(self._whole, self._counted[-1][0] - counted_after) if self._counted else self._whole
        rules = Rules(ahead, may_lack, self._whole if self._is_needed(number) else whole, self._same(number))
        recorded = self._run.sent.get(number, [])
        found = (align(recorded[start:], replayed, rules) for start in self._starts(number, recorded))
        return min(found, key=Alignment.cost)

    def _starts(self, number: int, recorded: Sequence[Sent]) -> list[int]:
        """Where the run's first frame of a message may be, the most likely place first."""
        starts = list(range(self._run.doubtful.get(number, 0), -1, -1))
        if number in self._bus.protected:
            first = [start for start in starts if start < len(recorded) and not e2e.counter(recorded[start].data)]
            return first or starts[:1]
        return starts

    def _same(self, number: int) -> Same:
        if number in self._bus.protected:
            return lambda recorded, replayed: e2e.without(recorded) == e2e.without(replayed)
        kind = self._bus.trace.get(number, "")
        if kind == "CanopyHealth":
            return lambda recorded, replayed: _are_same(recorded, replayed, _HEALTH.get(replayed[0] & 15, _NO_COUNTS))
        if kind == "CanopyTick":
            mask = _OVERRUNS if self._guard is None else _PROTECTED_OVERRUNS
            return lambda recorded, replayed: _are_same(recorded, replayed, mask)
        return bytes.__eq__

    def _judge(self, number: int, alignment: Alignment, done: int) -> None:
        """Adds the differences that one message shows by itself."""
        name = self._name(number)
        for sent, frame in alignment.other:
            if frame.tick >= self._ticks:
                continue
            for what in explain(self._bus, number, sent.data, frame.data):
                self._differ(frame.tick, frame.order, name, what, sent.place)
        ahead = 0 if number in self._bus.trace else self._bus.ahead
        for sent in alignment.extra:
            if sent.tick + ahead < done:  # else it may be of a tick that is not compared
                self._differ(sent.tick, _LAST, name, ("frame", sent.data.hex(" "), "none"), sent.place)
        if self._is_needed(number):
            for frame in alignment.lacking:
                if frame.tick < self._whole:
                    self._differ_lacking(number, frame)
        if number in self._bus.protected:
            self._judge_e2e(number, alignment.pairs)
        if name == "CanopyTick" and self._guard is not None:
            self._judge_guard(self._guard, alignment.pairs)

    def _judge_guard(self, data_id: int, pairs: Sequence[tuple[Sent, Replayed]]) -> None:
        """The first CanopyTick of the log whose CRC is wrong is a difference."""
        for sent, frame in pairs:
            right = e2e.crc(data_id, sent.data)
            if sent.data[0] != right:
                what = ("Crc", str(sent.data[0]), str(right))
                self._differ(frame.tick, frame.order, "CanopyTick", what, sent.place)
                return

    def _judge_e2e(self, number: int, pairs: Sequence[tuple[Sent, Replayed]]) -> None:
        """The first frame of the log whose counter does not follow, or whose CRC is wrong, is a difference."""
        for place, (sent, frame) in enumerate(pairs):
            counter, crc = place % e2e.COUNTERS, e2e.crc(self._bus.protected[number], sent.data)
            if (e2e.counter(sent.data), sent.data[0]) != (counter, crc):
                was, right = e2e.counter(sent.data), counter
                what = "E2E_Counter"
                if was == right:
                    what, was, right = "E2E_CRC", sent.data[0], crc
                self._differ(frame.tick, frame.order, self._name(number), (what, str(was), str(right)), sent.place)
                return

    def _lacking(self, number: int, alignment: Alignment, replayed: Sequence[Replayed]) -> list[Lacking]:
        """What CanopyHealth must have counted."""
        if self._is_needed(number):
            return []
        following = {frame.order: later.tick for frame, later in pairwise(replayed)}
        # From the next value of a command until CanopyHealth has counted the value that it has replaced: when the trace
        # of a tick leaves, all commands of the tick have left or were counted.
        counted_after = self._bus.ahead + 1
        return [
            Lacking(number, frame, following.get(frame.order, self._ticks) + counted_after)
            for frame in alignment.lacking
            if frame.tick < self._whole
        ]

    def _is_needed(self, number: int) -> bool:
        return self._bus.trace.get(number) in NEEDED

    def _name(self, number: int) -> str:
        return self._bus.sent[number].name if number in self._bus.sent else f"0x{number:X}"

    def _differ_lacking(self, number: int, frame: Replayed) -> None:
        self._differ(frame.tick, frame.order, self._name(number), ("frame", "none", frame.data.hex(" ")), None)

    def _differ(self, tick: int, order: int, message: str, what: tuple[str, str, str], frame: int | None) -> None:
        self._found.append((order, Difference(tick, message, *what, frame)))
