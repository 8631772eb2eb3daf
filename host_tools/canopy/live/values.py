# SPDX-License-Identifier: MIT
"""The values that a trace carries: which slots are known, and what they mean."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from fractions import Fraction

from canopy.live.trace_model import Trace, TraceValue

_SLOT_BITS = 32


@dataclass(frozen=True)
class ValueState:
    """One value after a tick."""

    value: TraceValue
    known: int | float | bool | str | None
    """As the application has it; a text for a named number; None: not known."""
    certain: bool
    """It is so in this tick. Else it was so when it was told last, or is not known."""

    @property
    def text(self) -> str:
        """For people, with its unit; "unknown", and a question mark behind what may be another by now."""
        if self.known is None:
            return "unknown"
        if self.known == "" and self.value.words:
            return "none" + ("" if self.certain else "?")
        if isinstance(self.known, bool):
            text = "true" if self.known else "false"
        else:
            text = f"{self.known:.10g}" if isinstance(self.known, float) else str(self.known)
        return f"{text} {self.value.unit}".rstrip() + ("" if self.certain else "?")


def meaning(value: TraceValue, texts: tuple[str, ...], slots: tuple[int, ...]) -> int | float | bool | str:
    """What the 32 bits of a value's slots stand for, the low half first."""
    bits = sum(slot << _SLOT_BITS * place for place, slot in enumerate(slots))
    width = _SLOT_BITS * len(slots)
    if value.type in ("float", "double"):
        number: float = struct.unpack("<f" if value.type == "float" else "<d", bits.to_bytes(width // 8, "little"))[0]
        return number if math.isfinite(number) else str(number)
    if value.type == "text":
        return texts[bits] if bits < len(texts) else f"text {bits}"
    whole = bits - (1 << width) if value.type.startswith("int") and bits >> (width - 1) else bits
    if whole in value.words:
        return value.words[whole]
    if value.type == "bool":
        return bool(whole)
    return _number(whole * value.scale)


def _number(exact: Fraction) -> int | float:
    return exact.numerator if exact.denominator == 1 else float(exact)


class Slots:
    """The slots of a trace, followed as docs/trace.md says."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._bits: list[int | None] = [None] * trace.slots
        self._told: set[int] = set()
        """In the tick at hand."""
        self._more = False
        self._states: tuple[ValueState, ...] = ()
        self._is_settled = False
        """All that is known was certain of the last tick: so it is of the next, when that tells nothing else."""

    def begin(self) -> None:
        """A tick begins."""
        self._told.clear()
        self._more = False

    def has(self, slot: int) -> bool:
        """Is there a slot of this number?"""
        return slot < len(self._bits)

    def was_told(self, slot: int) -> bool:
        """In the tick at hand."""
        return slot in self._told

    def take(self, slot: int, bits: int, more: bool) -> None:
        """What a CanopyValue of the tick at hand says."""
        self._bits[slot] = bits
        self._told.add(slot)
        self._more |= more

    def know(self) -> None:
        """The controller has just started: everything is 0."""
        self._bits = [0] * len(self._bits)
        self._is_settled = False

    def forget(self) -> None:
        """Nothing is known."""
        self._bits = [None] * len(self._bits)
        self._told.clear()
        self._is_settled = False

    def end(self, complete: bool) -> tuple[ValueState, ...]:
        """The values when a tick is over.

        Args:
            complete: All CanopyValue that were announced have come.
        """
        all_told = complete and not self._more
        if self._told or not (all_told and self._is_settled):
            self._states = tuple(self._state(value, all_told) for value in self._trace.values)
            self._is_settled = all_told
        if not complete:
            self._bits = [bits if slot in self._told else None for slot, bits in enumerate(self._bits)]
            self._is_settled = False
        return self._states

    def _state(self, value: TraceValue, all_told: bool) -> ValueState:
        slots = range(value.slot, value.slot + value.slots)
        bits = tuple(known for slot in slots if (known := self._bits[slot]) is not None)
        if len(bits) < value.slots:
            return ValueState(value, None, False)
        return ValueState(value, meaning(value, self._trace.texts, bits), all_told or self._told.issuperset(slots))
