# SPDX-License-Identifier: MIT
"""A controller as seen from its bus: the tree, the signals, how fast it ticks, and since when it has been silent."""

from __future__ import annotations

from collections import deque
from typing import Any

from canopy.model import Model
from canopy.signals import SignalTable
from canopy.trace import CAN_STATES, Health, TraceDecoder, TreeView, status_name

_RATE_WINDOW_S = 2.0
_SILENT_PERIODS = 10  # as the heartbeat's own timeout: ten missed CanopyTick
_FLUSH_PERIODS = 2


class Watch:
    """Feed it the bus's data frames with the time of a monotonic clock [s]."""

    def __init__(self, model: Model) -> None:
        """Reads the DBC beside the model.

        Raises:
            ModelError: The DBC cannot be used.
        """
        self.model = model
        self.signals = SignalTable(model)
        self.view: TreeView | None = None
        """The newest tick; None before the first."""
        self._decoder = TraceDecoder(model)
        self._last_trace: float | None = None
        self._ticks: deque[tuple[float, int]] = deque()

    def feed(self, identifier: int, data: bytes, now: float) -> tuple[TreeView, ...]:
        """Takes one data frame; returns the ticks it completes."""
        self.signals.feed(identifier, data, now)
        if identifier in self.model.trace.values():
            self._last_trace = now
        return self._take(self._decoder.feed(identifier, data), now)

    @property
    def disagreement(self) -> str | None:
        """Why the last CanopyModel was not the model's; None while they agree. Anybody can send one, on a bus."""
        return self._decoder.mismatch

    def idle(self, now: float) -> tuple[TreeView, ...]:
        """Call this often: gives up waiting for frames of a tick that no longer come."""
        if self._last_trace is None or now - self._last_trace < self._periods(_FLUSH_PERIODS):
            return ()
        return self._take(self._decoder.flush(), now)

    def rate(self, now: float) -> float:
        """Ticks per second over the last two seconds; 0 while it is not known."""
        self._forget_old_ticks(now)
        if len(self._ticks) < 2:
            return 0.0
        (first_at, first), (last_at, last) = self._ticks[0], self._ticks[-1]
        return (last - first) / (last_at - first_at) if last_at > first_at else 0.0

    def silent_for(self, now: float) -> float | None:
        """How long no trace frame has come, once that is long [s]; None while the controller is heard."""
        if self._last_trace is None or now - self._last_trace < self._periods(_SILENT_PERIODS):
            return None
        return now - self._last_trace

    def snapshot(self, now: float) -> dict[str, Any]:
        """All that is known, as an object for JSON."""
        view = self.view
        health = (view.health if view else None) or Health()
        bus = view.bus if view else None
        signals: dict[str, dict[str, float | str | None]] = {}
        for reading in self.signals.readings(now):
            signals.setdefault(reading.message, {})[reading.signal] = reading.value
        return {
            "application": self.model.application,
            "tick": view.tick if view else None,
            "root": status_name(view.root_status) if view else None,
            "complete": view.complete if view else False,
            "ticks_per_s": round(self.rate(now), 2),
            "silent_s": None if (silent := self.silent_for(now)) is None else round(silent, 3),
            "nodes": [
                {
                    "name": node.name,
                    "type": node.type,
                    "status": status_name(view.statuses[node.index]) if view else None,
                }
                for node in self.model.nodes
            ],
            "signals": signals,
            "stale": sorted({reading.message for reading in self.signals.readings(now) if reading.stale}),
            "overruns": view.overruns if view else 0,
            "lost": view.lost if view else 0,
            "refused": (view.refused if view else 0) + self.signals.refused,
            "restarts": view.restarts if view else 0,
            "disagreement": self.disagreement,
            "rx_rejected": health.rx_rejected,
            "rx_unknown": health.unknown,
            "tx_dropped": health.tx_dropped,
            "faults": health.faults,
            "bus": CAN_STATES[bus.can_state] if bus else None,
            "overload": bus.overload if bus else None,
            "returning": bus.returning if bus else None,
        }

    def _take(self, views: tuple[TreeView, ...], now: float) -> tuple[TreeView, ...]:
        for view in views:
            if self.view is not None and view.restarts != self.view.restarts:
                self._ticks.clear()
            self.view = view
            self._ticks.append((now, view.tick))
        self._forget_old_ticks(now)
        return views

    def _forget_old_ticks(self, now: float) -> None:
        while self._ticks and now - self._ticks[0][0] > _RATE_WINDOW_S:
            self._ticks.popleft()

    def _periods(self, count: int) -> float:
        return count * self.model.period_us / 1e6
