# SPDX-License-Identifier: MIT
"""The tick whose frames are arriving: which are still to come, and of which nodes it tells."""

from __future__ import annotations

from canopy.live.frames import ArrivalsFrame, ChangeFrame, SnapshotFrame, TickFrame, ValueFrame

_NODES_WAIT = 2


class OpenTick:
    """What CanopyTick has announced, and what has come of it.

    In the order of the bus: CanopyInputs, CanopyArrivals, CanopySnapshot, CanopyChange, CanopyValue.
    """

    def __init__(self, number: int, frame: TickFrame) -> None:
        self.number = number
        self.root_status = frame.root_status
        self.told: set[int] = set()
        """Nodes that a CanopySnapshot or a CanopyChange has named."""
        self.last: int | None = None
        """Named by a CanopyChange."""
        self.is_followed = False
        """Some frame of the trace has come behind CanopyTick."""
        self.values_left = frame.values
        self._sequence = frame.sequence
        self._has_snapshot = frame.has_snapshot
        self._place = 0
        """Of the last frame about nodes: how many numbers behind CanopyTick's."""
        self._inputs_left = True
        self._arrivals_left = False
        self._snapshot_left = frame.has_snapshot
        self._changes_left = frame.has_changes
        self._more = 0
        self._runs: list[tuple[int, int]] = []
        """First and last node of CanopyChange frames that follow each other without a gap."""
        self._first = 0
        self._is_intact = True
        self._has_values = False

    @property
    def nodes_left(self) -> bool:
        """Frames about nodes are still to come."""
        return self._snapshot_left or self._changes_left

    @property
    def is_complete(self) -> bool:
        """All that was announced of nodes and values has come."""
        return self._is_intact and not (self.nodes_left or self.values_left)

    @property
    def is_over(self) -> bool:
        """Nothing is to come any more."""
        return not (self._inputs_left or self._arrivals_left or self.nodes_left or self.values_left)

    @property
    def tells_all(self) -> bool:
        """What it has not named has not changed."""
        return self._is_intact and not self.nodes_left and self._more != _NODES_WAIT

    def take_inputs(self, has_more_ages: bool) -> None:
        """CanopyInputs has come."""
        self._inputs_left, self._arrivals_left = False, has_more_ages

    def may_have(self, frame: ArrivalsFrame) -> bool:
        """Is it this tick's, whether or not CanopyInputs has announced it? Also when the tick is over."""
        return frame.tick == self.number % 16 and not self.told and not self._has_values

    def take_arrivals(self, frame: ArrivalsFrame) -> None:
        """Notes what comes behind it, when it is this tick's."""
        self._inputs_left = False
        self._arrivals_left &= not frame.is_last

    def expects_snapshot(self, frame: SnapshotFrame) -> bool:
        """Is it this tick's? Then its number is the next one behind CanopyTick's."""
        begun = self.told or self._has_values
        fits = frame.tick == self.number % 8 and self._distance(frame.sequence) == 1
        return self._snapshot_left and not begun and fits

    def take_snapshot(self) -> None:
        """It is this tick's."""
        self._snapshot_left = False
        self._place = 1
        self._pass_ages()

    def expects_change(self, frame: ChangeFrame, most: int) -> bool:
        """Can it be this tick's, with `most` CanopyChange at most?"""
        fits = frame.tick == self.number % 16
        place = self._distance(frame.sequence)
        return self._changes_left and not self._has_values and fits and self._place < place <= most + self._has_snapshot

    def _distance(self, sequence: int) -> int:
        """How many numbers behind CanopyTick's. A tick has fewer than 64."""
        return (sequence - self._sequence) % 64

    def goes_round(self, frame: ChangeFrame) -> bool:
        """Are its nodes behind those before: going up, begun once more at 0 at most, ended before the first one?"""
        if self.last is None:
            return True
        if self.last < frame.nodes[0]:
            return self.last >= self._first or frame.nodes[-1] < self._first
        return self.last >= self._first > frame.nodes[-1]

    def take_change(self, frame: ChangeFrame, missing: int) -> None:
        """Notes what comes behind it, when it is this tick's, with so many frames missing before it."""
        self._place = self._distance(frame.sequence)
        self._is_intact &= not missing and not self._snapshot_left
        self._snapshot_left = False
        self._pass_ages()
        first = frame.nodes[0]
        if self.last is None:
            self._first = first
        elif not missing:
            first = self._runs.pop()[0]
        self._runs.append((first, frame.nodes[-1]))
        self.last = frame.nodes[-1]
        self._changes_left = not frame.more
        self._more = frame.more

    def expects_value(self, frame: ValueFrame) -> bool:
        """Can it be this tick's?"""
        return self.values_left > 0 and frame.tick == self.number % 16

    def take_value(self) -> None:
        """One of this tick's."""
        self.values_left -= 1
        self._has_values = True
        self._pass_ages()

    def _pass_ages(self) -> None:
        """Behind CanopyInputs and CanopyArrivals: those that have not come are lost."""
        self._inputs_left = self._arrivals_left = False

    def tells(self, node: int) -> bool:
        """Is the code that was told last of this node, if it is known, that of this tick?"""
        return self.tells_all or node in self.told or any(_spans(run, node) for run in self._runs)


def _spans(run: tuple[int, int], node: int) -> bool:
    """Between two nodes, going around."""
    first, last = run
    return first <= node <= last if first <= last else node >= first or node <= last
