# SPDX-License-Identifier: MIT
"""A message as cantools has it, for those who encode with it: the simulator, and tests that compare."""

from __future__ import annotations

from decimal import Decimal

from cantools.database.can import Message, Signal
from cantools.database.conversion import BaseConversion

from canopy.bus.source import SourceMessage, SourceSignal

BRANCHES_MAX = 1 << 12
"""cantools makes a list of each value of a multiplexer's range."""


def _number(value: Decimal) -> int | float:
    return int(value) if value == value.to_integral_value() else float(value)


def _signal(signal: SourceSignal) -> Signal:
    branches = [value for low, high in signal.branches for value in range(low, min(high, low + BRANCHES_MAX) + 1)]
    return Signal(
        name=signal.name,
        start=signal.start,
        length=signal.length,
        byte_order="little_endian" if signal.little_endian else "big_endian",
        is_signed=signal.is_signed,
        conversion=BaseConversion.factory(
            scale=_number(signal.scale),
            offset=_number(signal.offset),
            choices=dict(signal.choices) or None,  # type: ignore[arg-type]
            is_float=signal.is_float,
        ),
        minimum=None if signal.minimum is None else _number(signal.minimum),
        maximum=None if signal.maximum is None else _number(signal.maximum),
        unit=signal.unit or None,
        receivers=list(signal.receivers),
        comment=signal.comment or None,
        is_multiplexer=signal.is_multiplexer,
        multiplexer_ids=branches[:BRANCHES_MAX] or None,
        multiplexer_signal=signal.multiplexer,
    )


def cantools_message(message: SourceMessage) -> Message:
    """The message. A multiplexer's branches beyond the first BRANCHES_MAX values are not in it."""
    return Message(
        frame_id=message.frame_id,
        name=message.name,
        length=message.length,
        signals=[_signal(signal) for signal in message.signals],
        comment=message.comment or None,
        senders=list(message.senders),
        is_extended_frame=message.is_extended,
        is_fd=message.is_fd,
        strict=False,
    )
