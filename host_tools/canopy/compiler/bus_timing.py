# SPDX-License-Identifier: MIT
"""How long frames take on the wire, and what follows from it: load, and room for what waits."""

from __future__ import annotations

from canopy.compiler.bus_model import Bus

SHORTEST_FRAME_BITS = 47  # classic, 11-bit id, no data, no stuff bit, interframe space included


def frame_bits(length: int, *, extended: bool, fd: bool) -> int:
    """Bits of a frame on the wire with the most stuff bits, interframe space included.

    Classic: 47 (extended 67) + 8 a byte, and one stuff bit for four of the 34 (54) + 8 a byte that are stuffed
    (Davis et al., "Controller Area Network (CAN) schedulability analysis", 2007). FD frames are counted at the nominal
    bit rate: an upper bound.
    """
    fixed, stuffed = (67, 54) if extended else (47, 34)
    return fixed + (8 if fd else 0) + 8 * length + (stuffed + 8 * length - 1) // 4


def can_load_percent(bus: Bus, bitrate: int) -> float:
    """Share of the bit rate that all cyclic messages of the DBC take."""
    per_second = sum(
        frame_bits(length, extended=extended, fd=fd) * 1000 / cycle for length, extended, fd, cycle in bus.load if cycle
    )
    return round(100 * per_second / bitrate, 2)


def frames_in(duration_us: int, bitrate: int) -> int:
    """Most frames that a bus can carry in a time, at least 1."""
    return max(1, -(-duration_us * bitrate // (SHORTEST_FRAME_BITS * 1_000_000)))


def frame_us(bitrate: int) -> int:
    """How long a classic frame of 8 bytes with a 29-bit id takes at most [us], rounded up."""
    return -(-frame_bits(8, extended=True, fd=False) * 1_000_000 // bitrate)
