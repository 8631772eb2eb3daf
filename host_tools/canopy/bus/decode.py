# SPDX-License-Identifier: MIT
"""The values in a frame, for the host tools: by the same model of a message from which the C codec is made."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

from canopy.bus.source import SourceSignal
from canopy.compiler.bus_model import Message, Signal, float_value
from canopy.compiler.codec import segments


class UndecodableError(Exception):
    """The bytes are not those of the message."""


def _raw(signal: Signal, data: bytes) -> int | float:
    bits = sum(
        ((data[part.byte] >> part.low) & ((1 << part.bits) - 1)) << part.shift for part in segments(signal)
    )  # fmt: skip
    if signal.is_float:
        return float_value(bits, signal.length)
    return bits - (1 << signal.length) if signal.signed and bits >> (signal.length - 1) else bits


def raw_values(message: Message, data: bytes) -> dict[str, int | float]:
    """Raw values by the signals' names in the file, of those that are in the frame.

    Raises:
        UndecodableError: The length is another one, or a multiplexer has a value that selects nothing.
    """
    if not message.length <= len(data) <= message.longest:
        raise UndecodableError(f"{len(data)} bytes")
    found: dict[str, int | float] = {}
    result: dict[str, int | float] = {}
    for signal in message.signals:  # a multiplexer before what it selects
        chosen = (any(low <= found.get(s.signal, -1) <= high for low, high in s.values) for s in signal.selectors)
        if not all(chosen):
            continue
        value = _raw(signal, data)
        if signal.selects and not any(low <= value <= high for low, high in signal.selects):
            raise UndecodableError(f"{signal.name} is {value}")
        found[signal.c_name] = result[signal.name] = value
    return result


def physical(signal: Signal, raw: int | float) -> float | str:
    """The value in the signal's unit, or its name in the table."""
    for value, text in signal.choices:
        if value == raw:
            return text
    if isinstance(raw, float):
        return raw * float(signal.scale) + float(signal.offset)
    exact = raw * Fraction(signal.scale) + Fraction(signal.offset)
    return int(exact) if exact.denominator == 1 else float(exact)


def decimals(signal: Signal | SourceSignal) -> int:
    """Digits behind the point that tell one raw value from the next."""
    exponents = (Decimal(number).normalize().as_tuple().exponent for number in (signal.scale, signal.offset))
    return max(0, *(-exponent for exponent in exponents if isinstance(exponent, int)))


class IdTable:
    """Finds the message that a frame is: by its whole id, else by the bits of it that count."""

    def __init__(self, messages: tuple[Message, ...]) -> None:
        """Of several messages that a frame can be, that one is found of whose id most bits count."""
        self._exact = {(message.extended, message.id): message for message in messages if message.is_exact}
        masked = (message for message in messages if not message.is_exact)
        self._masked = sorted(masked, key=lambda message: -message.mask.bit_count())

    def find(self, identifier: int, extended: bool) -> Message | None:
        """The message; None: there is none."""
        found = self._exact.get((extended, identifier))
        if found is None and extended:
            matching = (m for m in self._masked if not (identifier ^ m.id) & m.mask)
            found = next(matching, None)
        return found
