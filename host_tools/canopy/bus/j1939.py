# SPDX-License-Identifier: MIT
"""Ids of J1939 and NMEA 2000: which bits of an id count, and one message from several sources (SAE J1939-21).

Bits 26..28 are the priority, 8..25 the parameter group (PGN), 0..7 the source. Where bits 16..23 are below 240, bits
8..15 are the destination and no part of the group.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable

from canopy.bus.source import Source, SourceMessage
from canopy.compiler.errors import CompileError

PRIORITY, DESTINATION, SOURCE = 0x1C000000, 0x0000FF00, 0x000000FF
GROUP = 0x03FFFF00
NULL_ADDRESS = 0xFE
"""As a source: files write it where they mean any."""
TRANSPORT_BYTES = 8
"""What is longer comes in several packets."""
_BROADCAST_FROM = 240


def is_addressed(frame_id: int) -> bool:
    """Has the id a destination?"""
    return (frame_id >> 16) & 0xFF < _BROADCAST_FROM


def group_mask(frame_id: int) -> int:
    """The bits of its parameter group."""
    return GROUP & ~DESTINATION if is_addressed(frame_id) else GROUP


def pgn(frame_id: int) -> int:
    """The parameter group number."""
    return (frame_id & group_mask(frame_id)) >> 8


def _set(message: SourceMessage, field: int, value: int | None) -> None:
    """Gives a field of the id a value that counts; None: any value will do."""
    if value is None:
        message.mask &= ~field
        return
    lowest = field & -field
    message.id = (message.id & ~field) | value * lowest
    message.mask |= field


def _groups(messages: Iterable[SourceMessage]) -> dict[int, set[int]]:
    """Parameter group -> the sources that messages of it have."""
    result: dict[int, set[int]] = {}
    for message in messages:
        if message.is_j1939:
            result.setdefault(pgn(message.frame_id), set()).add(message.frame_id & SOURCE)
    return result


def set_masks(source: Source) -> None:
    """Finds which bits of each id count, and makes a message of its own for each of several sources.

    Raises:
        CompileError: the overlay gives a destination to an id that has none, or an address to one of another kind.
    """
    groups = _groups(source.messages)
    result: list[SourceMessage] = []
    for message in source.messages:
        message.mask = 0x1FFFFFFF if message.is_extended else 0x7FF
        address = message.address
        if not message.is_j1939:
            if address.fields or address.sources:
                raise CompileError(
                    address.place or message.place,
                    f"message '{message.name}' has no J1939 id, so it has no source, destination or priority",
                    'to fix: write `protocol = "j1939"` at the top of the overlay, if all ids of 29 bits are such',
                )
            result.append(message)
            continue
        message.mask = group_mask(message.frame_id)
        if len(groups[pgn(message.frame_id)]) > 1:
            message.mask |= SOURCE  # the file itself tells its messages apart by their source
        if DESTINATION in address.fields and not is_addressed(message.frame_id):
            text = f"parameter group {pgn(message.frame_id)} of message '{message.name}' is for all: no destination"
            raise CompileError(address.place or message.place, text)
        for field, value in address.fields.items():
            _set(message, field, value)
        result += _of_sources(message) if address.sources else [message]
    source.messages = result


def _of_sources(message: SourceMessage) -> list[SourceMessage]:
    result = []
    for name, number in message.address.sources.items():
        one = copy.deepcopy(message)
        one.origin = message.name
        one.name = f"{message.name}_{name}"
        _set(one, SOURCE, number)
        result.append(one)
    return result
