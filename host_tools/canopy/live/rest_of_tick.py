# SPDX-License-Identifier: MIT
"""How long the rest of a tick may still come, for those who have a clock; the decoder has none."""

from __future__ import annotations

from canopy.model import Model

_PERIODS_MAX = 7
"""CanopySnapshot has the tick's number modulo 8: after more periods it could be one of a later tick."""


class RestOfTick:
    """Tell it of each frame, with the time of a monotonic clock [s]."""

    def __init__(self, model: Model) -> None:
        self._tick_id = model.trace.ids["CanopyTick"]
        self._wait = min(_PERIODS_MAX, model.trace.waits_periods) * model.period_us / 1e6
        self._begun: float | None = None

    def saw(self, identifier: int, now: float) -> None:
        """A frame has come."""
        if identifier == self._tick_id:
            self._begun = now

    def is_over(self, now: float) -> bool:
        """Nothing of the tick at hand can come any more: what comes now is of a later one. Then flush the decoder."""
        return self._begun is not None and now - self._begun > self._wait
