# SPDX-License-Identifier: MIT
"""The trace's status codes: 4 bits that say what a node has returned last, and whether it was ticked."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class Status(IntEnum):
    """What a node is, or has returned last."""

    UNKNOWN = -1
    IDLE = 0
    RUNNING = 1
    SUCCESS = 2
    FAILURE = 3
    SKIPPED = 4


UNKNOWN = -1
"""Stands for a code that is not known."""
NO_CODE = 15
"""On the bus: no node, or no status."""
_KEPT = 4
_RESET_NOW = 8
_RESET = 11


def last_result(code: int) -> Status:
    """What the node has returned last; IDLE: nothing since the start."""
    if code > _RESET:
        return Status(code - _RESET)
    if code > _RESET_NOW:
        return Status(code - _RESET_NOW)
    return Status(code - _KEPT if code > _KEPT else code)


def status(code: int) -> Status:
    """What the node is now: IDLE where its parent has reset it."""
    return Status.IDLE if code > _RESET_NOW else last_result(code)


def was_ticked(code: int) -> bool:
    """In the tick of the code."""
    return 0 < code <= _KEPT or _RESET_NOW < code <= _RESET


def code_name(code: int) -> str:
    """E.g. "RUNNING", "SUCCESS (kept)", "IDLE (halted)", "unknown".

    Kept: not ticked, and its parent keeps the result. Now: ticked in this tick, and then reset by its parent.
    """
    if code == UNKNOWN:
        return "unknown"
    if 0 <= code <= _KEPT:
        return Status(code).name
    if code <= _RESET_NOW:
        return f"{last_result(code).name} (kept)"
    was = "halted" if last_result(code) is Status.RUNNING else f"was {last_result(code).name}"
    return f"IDLE ({was}{' now' if code <= _RESET else ''})"


class NodeState(NamedTuple):
    """What is known of a node after a tick."""

    code: int
    """The code told last; UNKNOWN: none is known."""
    certain: bool
    """The code is the node's in this tick. Else it may be another one by now, or was not told at all."""
    since: int | None
    """Since this tick the node has the code; None where it is not certain."""
    exact: bool
    """Since just this tick; else since this one or an earlier one."""

    @property
    def status(self) -> Status:
        """What the node is; UNKNOWN where that is not certain."""
        return status(self.code) if self.certain else Status.UNKNOWN

    @property
    def text(self) -> str:
        """For people; with a question mark what was told last and may be another by now."""
        return code_name(self.code) + ("" if self.certain or self.code == UNKNOWN else "?")


NOTHING_KNOWN = NodeState(UNKNOWN, False, None, False)
