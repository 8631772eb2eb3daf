# SPDX-License-Identifier: MIT
"""The tick whose frames are arriving: which are still to come, and of which nodes it tells."""

from __future__ import annotations

from canopy.live.frames import ChangeFrame, SnapshotFrame, TickFrame, ValueFrame

_ALL_TOLD = 1
_NODES_WAIT = 2


class OpenTick:
    """What CanopyTick has announced, and what has come of it.

    In the order of the bus: CanopySnapshot, CanopyChange, CanopyValue.
    """

    def __init__(self, number: int, frame: TickFrame) -> None:
        self.number = number
        self.root_status = frame.root_status
        self.inputs_left = True
        """CanopyInputs. It belongs to no tick that is lost, so without it a tick is complete nevertheless."""
        self.snapshot_left = frame.has_snapshot
        self.changes_left = frame.has_changes
        self.values_left = frame.values
        self.told: set[int] = set()
        """Nodes that a CanopySnapshot or a CanopyChange has named."""
        self.last: int | None = None
        """Named by a CanopyChange."""
        self._first = 0
        self._more = _ALL_TOLD
        self._changes = 0  # frames, with those that are known to be missing
        self._intact = True

    @property
    def nodes_left(self) -> bool:
        """Frames about nodes are still to come."""
        return self.snapshot_left or self.changes_left

    @property
    def is_over(self) -> bool:
        """Nothing is to come any more."""
        return not (self.nodes_left or self.values_left)

    @property
    def is_complete(self) -> bool:
        """All that was announced has come."""
        return self._intact and self.is_over

    @property
    def more_wait(self) -> bool:
        """More nodes have changed than fit."""
        return self._more == _NODES_WAIT

    def expects_snapshot(self, frame: SnapshotFrame, missing: int) -> bool:
        """Is it this tick's? Then it comes right behind the CanopyTick."""
        return self.snapshot_left and not missing and self.last is None and frame.tick == self.number % 8

    def expects_change(self, frame: ChangeFrame, missing: int, most: int) -> bool:
        """Can it be this tick's, with so many frames missing before it, and `most` CanopyChange at most?"""
        if not self.changes_left or frame.tick != self.number % 16 or self.snapshot_left > missing:
            return False
        if self._changes + missing - self.snapshot_left >= most:
            return False
        if self.last is None or self.last < frame.nodes[0]:
            begins_again = self.last is not None and self.last < self._first
            return not begins_again or frame.nodes[-1] < self._first
        return self.last >= self._first > frame.nodes[-1]

    def take_change(self, frame: ChangeFrame, missing: int) -> None:
        """Notes what comes behind it, when it is this tick's."""
        self._changes += missing - self.snapshot_left + 1
        self._intact &= not missing
        self.snapshot_left = False
        if self.last is None:
            self._first = frame.nodes[0]
        self.last = frame.nodes[-1]
        if frame.more:
            self.changes_left = False
            self._more = frame.more

    def expects_value(self, frame: ValueFrame) -> bool:
        """Can it be this tick's?"""
        return self.values_left > 0 and frame.tick == self.number % 16

    def tells(self, node: int) -> bool:
        """Is the code that was told last of this node that of this tick, when nothing of the tick is missing?"""
        return not self.more_wait or node in self.told or self._spans(node)

    def _spans(self, node: int) -> bool:
        """Between the first node and the last one that CanopyChange frames have named, going around."""
        if self.last is None:
            return False
        if self._first <= self.last:
            return self._first <= node <= self.last
        return node >= self._first or node <= self.last
