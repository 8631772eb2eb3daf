# SPDX-License-Identifier: MIT
"""How a controller and its bus are, as CanopyHealth and CanopyInputs tell."""

from __future__ import annotations

from dataclasses import dataclass, replace

CAN_STATES = ("error-active", "error-warning", "error-passive", "blocked", "bus-off", "down", "gone")
"""The state of the bus by its number in CanopyInputs (runtime/include/canopy/can_state.h)."""

LATENESS_US = (16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384)
"""Upper ends of the histogram's classes but the last, which has none [us]."""


@dataclass(frozen=True)
class BusState:
    """What the controller said last of its bus."""

    can_state: int
    """Index of CAN_STATES."""
    overload: bool
    """Frames come faster than they are taken, or were lost: what the tree sees may not be all."""
    returning: bool
    """Safe values go out instead of the tree's, until the bus has shown that it works again."""

    @property
    def is_good(self) -> bool:
        """As it should be."""
        return not (self.can_state or self.overload or self.returning)

    def text(self) -> str:
        """For people, e.g. "blocked, overload"."""
        more = [*["overload"][: self.overload], *["sends safe values"][: self.returning]]
        return ", ".join([CAN_STATES[self.can_state], *more])


def read_bus_state(data: bytes) -> BusState | None:
    """From the 8 bytes of a CanopyInputs; None where there is no such state."""
    state = data[5] & 7
    return BusState(state, bool(data[5] & 0x08), bool(data[5] & 0x10)) if state < len(CAN_STATES) else None


@dataclass(frozen=True)
class Health:
    """Counters since the controller's start, each of which stops at its largest value. None: not told yet."""

    rx_rejected: int | None = None
    """Frames that were refused: form, CRC, counter, range; to 65535, as all without another word."""
    rx_unknown: int | None = None
    """Frames with ids that the controller does not receive; None also where its filter lets none through."""
    rx_filtered: bool | None = None
    """Its filter lets no unknown frames through, so that there is nothing to count."""
    rx_lost: int | None = None
    """By the driver."""
    rx_backlogs: int | None = None
    """Cycles that left frames waiting, to 255."""
    tx_replaced: int | None = None
    """Commands that a newer value replaced before they left."""
    tx_expired: int | None = None
    """Commands that were not out at their deadline."""
    trace_dropped: int | None = None
    """Trace frames for which there was no room, or no time."""
    bus_restarts: int | None = None
    """Tries to bring the bus back, to 255."""
    overruns: int | None = None
    longest_cycle_us: int | None = None
    """To 2^24 - 1 us."""
    latest_start_us: int | None = None
    """Greatest lateness of a cycle, in steps of 10 us to 655,350 us."""
    lateness: tuple[int, ...] | None = None
    """Twelve classes, by LATENESS_US: n: fewer than 4^n cycles, and at least 4^(n-1); 0: none."""
    slips: int | None = None
    """Cycles left out after overruns, to 255."""
    leaf_faults: int | None = None
    """Leaves that returned no valid status."""
    rx_errors: int | None = None
    """Failures of the driver's receive."""
    timeouts: int | None = None
    """Messages that became stale."""


def read_health(data: bytes, before: Health) -> Health | None:
    """What is known with 8 more bytes of a CanopyHealth; None where there is no such page."""
    first, second, third = (int.from_bytes(data[place : place + 2], "little") for place in (1, 3, 5))
    match data[0] & 0x0F:
        case 0:
            filtered = bool(data[0] & 0x10)
            unknown = None if filtered else second
            return replace(
                before,
                rx_rejected=first,
                rx_unknown=unknown,
                rx_filtered=filtered,
                rx_lost=third,
                rx_backlogs=data[7],
            )
        case 1:
            return replace(before, tx_replaced=first, tx_expired=second, trace_dropped=third, bus_restarts=data[7])
        case 2:
            longest, latest = int.from_bytes(data[3:6], "little"), int.from_bytes(data[6:8], "little")
            return replace(before, overruns=first, longest_cycle_us=longest, latest_start_us=10 * latest)
        case 3:
            halves = tuple(byte >> shift & 15 for byte in data[1:7] for shift in (0, 4))
            return replace(before, lateness=halves, slips=data[7])
        case 4:
            return replace(before, leaf_faults=first, rx_errors=second, timeouts=third)
    return None
