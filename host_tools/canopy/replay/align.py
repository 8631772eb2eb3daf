# SPDX-License-Identifier: MIT
"""Which frame of a log is which frame of the replay.

The replay sends everything that the program decided. The log may lack frames that were replaced, taken back or dropped
before they left; then CanopyHealth has counted them. So the log's frames of a message are the replay's, in the same
order, with some left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from canopy.replay.log import Sent

Same = Callable[[bytes, bytes], bool]


@dataclass(frozen=True)
class Replayed:
    """A frame that the program has sent in the replay."""

    order: int
    """Its place among all frames of the replay."""
    tick: int
    data: bytes


@dataclass
class Alignment:
    """What became of one message's frames."""

    pairs: list[tuple[Sent, Replayed]] = field(default_factory=list)
    """Equal ones."""
    other: list[tuple[Sent, Replayed]] = field(default_factory=list)
    """Of the first tick with such: they differ."""
    lacking: list[Replayed] = field(default_factory=list)
    """The log has none."""
    extra: list[Sent] = field(default_factory=list)
    """The replay has none."""

    def cost(self) -> tuple[int, int]:
        """Less is better: differences first."""
        return len(self.other) + len(self.extra), len(self.lacking)


@dataclass(frozen=True)
class Rules:
    """What an alignment of one message may do."""

    ahead: int
    """A frame may be of a tick so many behind the one that the trace gives it."""
    may_lack: int
    """So many frames may be lacking where the log has another one. Where it has none, any number may."""
    whole: int
    """From this tick on any number may."""
    same: Same
    """Are a frame of the log and one of the replay equal?"""


def align(recorded: Sequence[Sent], replayed: Sequence[Replayed], rules: Rules) -> Alignment:
    """Aligns one message's frames.

    A frame of the log is given the first one of the replay that it can be: so before any tick as few as possible are
    lacking.

    Args:
        recorded: Of the log, with the tick that the trace gives them.
        replayed: Of the replay.
        rules: What is allowed.
    """
    result = Alignment()
    place = now = 0
    while now < len(replayed):
        frame = replayed[now]
        if result.other and frame.tick > result.other[0][1].tick:
            return result
        if place == len(recorded) or recorded[place].tick > frame.tick:
            result.lacking.append(frame)
        elif recorded[place].tick + rules.ahead < frame.tick:
            result.extra.append(recorded[place])
            now -= 1
            place += 1
        elif rules.same(recorded[place].data, frame.data):
            result.pairs.append((recorded[place], frame))
            place += 1
        elif (len(result.lacking) < rules.may_lack or frame.tick >= rules.whole) and _comes_later(
            recorded[place], replayed, now, rules
        ):
            result.lacking.append(frame)
        else:
            result.other.append((recorded[place], frame))
            place += 1
        now += 1
    result.extra += recorded[place:]
    return result


def _comes_later(sent: Sent, replayed: Sequence[Replayed], now: int, rules: Rules) -> bool:
    for later in range(now + 1, len(replayed)):
        if replayed[later].tick > sent.tick + rules.ahead:
            return False
        if rules.same(sent.data, replayed[later].data):
            return True
    return False


@dataclass(frozen=True)
class Lacking:
    """A frame that the log lacks."""

    message: int
    """Its key."""
    frame: Replayed
    due: int
    """From this tick on CanopyHealth counts it, if it was dropped."""


def not_counted(lacking: Sequence[Lacking], counted: Sequence[tuple[int, int]], saturated: int) -> list[Lacking]:
    """Of the frames that a log lacks, those of the first tick in which more are lacking than CanopyHealth counts.

    Args:
        lacking: In any order.
        counted: Tick and number of every CanopyHealth that tells it. What is due behind the last one nothing counts;
            where there is none at all, nothing may lack.
        saturated: A number that may be any larger one.
    """
    ordered = sorted(lacking, key=lambda one: one.frame.order)
    found: list[list[Lacking]] = []
    if not counted:
        found.append(ordered)
    for tick, dropped in counted:
        if dropped < saturated:
            found.append([one for one in ordered if one.due <= tick][dropped:])
    first = min((rest[0].frame.tick for rest in found if rest), default=None)
    result = {one.frame.order: one for rest in found for one in rest if one.frame.tick == first}
    return list(result.values())
