# SPDX-License-Identifier: MIT
"""A controller as seen from its bus: the tree, the signals, how fast it ticks, and since when it has been silent."""

from __future__ import annotations

from collections import deque
from dataclasses import asdict
from typing import Any

from canopy.live.codes import code_name
from canopy.live.rest_of_tick import RestOfTick
from canopy.model import Model
from canopy.signals import SignalTable
from canopy.trace import CAN_STATES, TraceDecoder, TreeView

_RATE_WINDOW_S = 2.0
_SILENT_PERIODS = 10  # as the heartbeat's own timeout: ten missed CanopyTick


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
        self._rest = RestOfTick(model)
        self._last_trace: float | None = None
        self._ticks: deque[tuple[float, int]] = deque()

    def feed(self, identifier: int, data: bytes, now: float) -> tuple[TreeView, ...]:
        """Takes one data frame; returns the ticks it completes."""
        views = self.idle(now)
        self.signals.feed(identifier, data, now)
        if identifier in self.model.trace.names:
            self._last_trace = now
        self._rest.saw(identifier, now)
        return views + self._take(self._decoder.feed(identifier, data), now)

    @property
    def disagreement(self) -> str | None:
        """Why the last CanopyModel was not the model's; None while they agree. Anybody can send one, on a bus."""
        return self._decoder.mismatch

    def idle(self, now: float) -> tuple[TreeView, ...]:
        """Call this often: gives up waiting for frames of a tick that no longer come."""
        return self._take(self._decoder.flush(), now) if self._rest.is_over(now) else ()

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
        bus = view.bus if view else None
        signals: dict[str, dict[str, float | str | None]] = {}
        for reading in self.signals.readings(now):
            signals.setdefault(reading.message, {})[reading.signal] = reading.value
        return {
            "application": self.model.application,
            "tick": view.tick if view else None,
            "root": view.root_status.name if view else None,
            "complete": view.complete if view else False,
            "ticks_per_s": round(self.rate(now), 2),
            "silent_s": None if (silent := self.silent_for(now)) is None else round(silent, 3),
            "nodes": self._nodes(view),
            "values": self._values(view),
            "signals": signals,
            "stale": sorted({reading.message for reading in self.signals.readings(now) if reading.stale}),
            "overruns": view.overruns if view else 0,
            "lost": view.lost if view else 0,
            "refused": (view.refused if view else 0) + self.signals.refused,
            "restarts": view.restarts if view else 0,
            "disagreement": self.disagreement,
            "crc_errors": view.crc_errors if view else 0,
            "health": asdict(view.health) if view else None,
            "bus": CAN_STATES[bus.can_state] if bus else None,
            "overload": bus.overload if bus else None,
            "returning": bus.returning if bus else None,
        }

    def _nodes(self, view: TreeView | None) -> list[dict[str, Any]]:
        nodes = []
        for node in self.model.nodes:
            shown: dict[str, Any] = {"name": node.name, "type": node.type, "status": None}
            if view is not None:
                state = view.nodes[node.index]
                told = code_name(state.code)
                shown |= {"status": told if state.certain else "unknown", "told": told, "certain": state.certain}
                shown |= {"since": state.since, "since_exact": state.exact}
            nodes.append(shown)
        return nodes

    @staticmethod
    def _values(view: TreeView | None) -> list[dict[str, Any]]:
        return [
            {
                "kind": state.value.kind,
                "name": state.value.title,
                "node": state.value.node,
                "value": state.known,
                "unit": state.value.unit,
                "certain": state.certain,
            }
            for state in (view.values if view else ())
        ]

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
