# SPDX-License-Identifier: MIT
"""Ending a program in good order: SIGINT, SIGTERM and SIGHUP set a flag that its loop asks."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopFlag:
    """True once one of the signals has come. A context, for the main thread: the handlers before it come back after."""

    def __init__(self) -> None:
        self._stopped = False
        self._before: dict[signal.Signals, Any] = {}

    def __bool__(self) -> bool:
        return self._stopped

    def __enter__(self) -> StopFlag:
        for number in _SIGNALS:
            # nohup has its way; a shell that ignores SIGINT for its background jobs has not.
            if number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN:
                continue
            self._before[number] = signal.signal(number, self._stop)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self._stopped = True
