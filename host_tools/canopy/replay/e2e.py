# SPDX-License-Identifier: MIT
"""The end-to-end protection of the commands in a log (AUTOSAR E2E Profile 11, runtime/include/canopy/e2e.h)."""

from __future__ import annotations

COUNTERS = 15
_POLYNOMIAL = 0x1D


def _step(byte: int) -> int:
    for _ in range(8):
        byte = byte << 1 ^ (_POLYNOMIAL if byte & 0x80 else 0)
        byte &= 0xFF
    return byte


_TABLE = bytes(_step(byte) for byte in range(256))


def crc(data_id: int, data: bytes) -> int:
    """What byte 0 must be, from the 16-bit data id and the bytes behind byte 0."""
    value = 0
    for byte in (data_id & 0xFF, data_id >> 8, *data[1:]):
        value = _TABLE[value ^ byte]
    return value


def counter(data: bytes) -> int:
    """The counter of a protected frame of at least 2 bytes."""
    return data[1] & 0x0F


def without(data: bytes) -> bytes:
    """The frame without CRC and counter: what the program decided."""
    return bytes([0, data[1] & 0xF0]) + data[2:] if len(data) > 1 else data
