# SPDX-License-Identifier: MIT
"""End-to-end protection of a frame: AUTOSAR E2E Profile 11, DataIDMode BOTH, offset 0.

Byte 0 holds the CRC, which the library autosar-e2e computes; the low half of byte 1 holds a counter 0..14. The rule for
the receiver is the controller's own (runtime/include/canopy/e2e.h): two implementations, one contract.
"""

from __future__ import annotations

from e2e.p11 import e2e_p11_check, e2e_p11_protect

COUNTERS = 15
"""The counter runs 0..14; 15 is not a valid counter."""

MAX_DELTA = 3
"""Largest step of the counter that is accepted: up to two frames in a row may be lost."""


class Protector:
    """Sender's side of one message: counts, and protects each frame."""

    def __init__(self, data_id: int) -> None:
        """`data_id` is the DBC's attribute E2EDataId, 0..65535."""
        self._data_id = data_id
        self._counter = 0

    def protect(self, data: bytearray) -> None:
        """Writes the next counter and the CRC into `data` (2..64 bytes)."""
        data[1] = data[1] & 0xF0 | self._counter
        self._counter = (self._counter + 1) % COUNTERS
        e2e_p11_protect(data, self._data_id, increment_counter=False)


class Checker:
    """Receiver's side of one message."""

    def __init__(self, data_id: int) -> None:
        """`data_id` is the DBC's attribute E2EDataId, 0..65535."""
        self._data_id = data_id
        self._last: int | None = None

    def check(self, data: bytes) -> str | None:
        """Checks a frame of 2..64 bytes and moves the memory of the counter on.

        Returns:
            None: use the frame. Else the reason to refuse it: "crc" (nothing was changed), "repeated" (the counter has
            not moved), "sequence" (it has moved too far: too many lost, or the sender restarted; the next frame in
            order is used).
        """
        counter = data[1] & 0x0F
        if counter >= COUNTERS or not e2e_p11_check(bytearray(data), self._data_id):
            return "crc"
        last, self._last = self._last, counter
        if last is None:
            return None
        delta = (counter - last) % COUNTERS
        if delta == 0:
            return "repeated"
        return None if delta <= MAX_DELTA else "sequence"
