# SPDX-License-Identifier: MIT
"""How long frames take on the wire, and what follows from it: load, and room for what waits."""

from __future__ import annotations

from canopy.compiler.bus_model import Bus

ARRIVALS_IN_FRAME = 3  # messages that one CanopyArrivals frame tells of
SLOW_TRACE = ("CanopyHealth", "CanopyModel")
SHORTEST_FRAME_BITS = 47  # classic, 11-bit id, no data, no stuff bit, interframe space included


def frame_bits(length: int, *, extended: bool, fd: bool) -> int:
    """Bits of a frame on the wire with the most stuff bits, interframe space included.

    Classic: 47 (extended 67) + 8 a byte, and one stuff bit for four of the 34 (54) + 8 a byte that are stuffed
    (Davis et al., "Controller Area Network (CAN) schedulability analysis", 2007). FD frames are counted at the nominal
    bit rate: an upper bound.
    """
    fixed, stuffed = (67, 54) if extended else (47, 34)
    return fixed + (8 if fd else 0) + 8 * length + (stuffed + 8 * length - 1) // 4


def can_load_percent(bus: Bus, period_ms: int, changes_max: int, bitrate: int) -> float:
    """Share of the bit rate that all cyclic messages of the DBC take, with a full trace in every tick."""
    per_second = sum(
        frame_bits(length, extended=extended, fd=fd) * 1000 / cycle for length, extended, fd, cycle in bus.load if cycle
    )
    for name, frames in (
        ("CanopyTick", 1),
        ("CanopyInputs", 1),
        ("CanopyArrivals", arrivals_frames(bus)),
        ("CanopyChange", changes_max),
        ("CanopySnapshot", 1),
    ):
        if name in bus.trace and bus.trace[name].cycle_ms == 0:
            message = bus.trace[name]
            per_second += frames * frame_bits(8, extended=message.extended, fd=False) * 1000 / period_ms
    return round(100 * per_second / bitrate, 2)


def frames_in(duration_us: int, bitrate: int) -> int:
    """Most frames that a bus can carry in a time, at least 1."""
    return max(1, -(-duration_us * bitrate // (SHORTEST_FRAME_BITS * 1_000_000)))


def frame_us(bitrate: int) -> int:
    """How long a classic frame of 8 bytes with a 29-bit id takes at most [us], rounded up."""
    return -(-frame_bits(8, extended=True, fd=False) * 1_000_000 // bitrate)


def arrivals_frames(bus: Bus) -> int:
    """CanopyArrivals frames of a tick that takes frames of all messages."""
    return max(1, -(-len(bus.receive) // ARRIVALS_IN_FRAME))


def trace_frames(bus: Bus, changes_max: int) -> int:
    """Most trace frames of one tick."""
    frames = {"CanopyChange": changes_max, "CanopyArrivals": arrivals_frames(bus)}
    return sum(frames.get(kind, 1) for kind in bus.trace)


def every_ticks(bus: Bus, name: str, period_ms: int) -> int:
    """The slow trace message of this name is sent in every so-many-th tick."""
    message = bus.trace.get(name)
    return max(1, message.cycle_ms // period_ms) if message is not None else 1


def trace_capacity(bus: Bus, changes_max: int, period_ms: int, ticks: int) -> int:
    """Trace frames that can wait: all those of so many ticks in a row, rounded up to a power of two."""
    slow = [name for name in SLOW_TRACE if name in bus.trace]
    frames = ticks * (trace_frames(bus, changes_max) - len(slow))
    frames += sum(-(-ticks // every_ticks(bus, name, period_ms)) for name in slow)
    return 1 << max(0, frames - 1).bit_length()
