# SPDX-License-Identifier: MIT
"""What a compiler can take, says a bus description, and that nobody can have meant."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from canopy.bus.overlay import heading
from canopy.bus.source import SourceSignal
from canopy.compiler.bus_model import Signal
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.numbers import plain
from canopy.escape.visible import brief

FEW = 256
"""A range that a byte could hold, where the bits hold 256 times as many values, is narrow."""
PLAIN_BITS = 16
"""Unscaled numbers of so many bits often count little: modes, errors."""


@dataclass(frozen=True)
class Remark:
    """A warning: what was taken all the same, or left out, and why."""

    place: Place
    text: str
    help_text: str = ""

    def __str__(self) -> str:
        text = f"{brief(str(self.place))}: warning: {brief(self.text)}"
        return f"{text}\n  help: {brief(self.help_text)}" if self.help_text else text


def left_out(problem: CompileError, so: str = "") -> Remark:
    """Of a message or signal of which there can be no code; `so` says what follows."""
    return Remark(problem.place, f"left out: {problem.message}{so}", problem.help_text)


def impossible_range(message: str, signal: Signal, written: SourceSignal) -> CompileError | None:
    """What is wrong with a range in which no value of the bits is; None: nothing."""
    if signal.is_float or written.minimum is None or written.maximum is None or not written.minimum < written.maximum:
        return None
    scale, offset = Fraction(signal.scale), Fraction(signal.offset)
    low, high = sorted(round((Fraction(end) - offset) / scale) for end in (written.minimum, written.maximum))
    if low <= signal.limits[1] and high >= signal.limits[0]:
        return None
    return CompileError(
        written.place,
        f"no value of signal '{message}.{signal.name}' is in its range [{written.minimum}, {written.maximum}]: its "
        f"{signal.length} bits hold {signal.limits[0]}..{signal.limits[1]} (raw), that is "
        f"{plain(signal.limits[0] * scale + offset)}..{plain(signal.limits[1] * scale + offset)}",
        f'to fix: write in the overlay: {heading(message, signal.name)} range = [LOW, HIGH], or "any"',
    )


def narrow_range(signal: Signal, written: SourceSignal) -> str:
    """Why its range cannot be meant, that refuses almost all values of its bits; "" where it can be."""
    if signal.is_float or signal.is_bool or signal.selects or signal.choices:
        return ""
    if written.minimum is None or written.maximum is None or not written.minimum < written.maximum:
        return ""
    accepted = sum(high - low + 1 for low, high in signal.accepted)
    is_narrow = accepted <= FEW and accepted * FEW < 2**signal.length
    raw_end = (Fraction(written.maximum) - Fraction(signal.offset)) / Fraction(signal.scale)
    is_plain = signal.scale == 1 and signal.length <= PLAIN_BITS
    if signal.signed and signal.low >= 0 and raw_end > signal.limits[1]:
        return "none below 0: its range is one of an unsigned signal"
    if accepted == 1 or (is_narrow and not is_plain):
        return f"for its range is [{written.minimum}|{written.maximum}]"
    return ""


def accepted_text(message: str, signal: Signal) -> str:
    """How many values of its bits a signal takes."""
    accepted = sum(high - low + 1 for low, high in signal.accepted)
    return f"signal '{message}.{signal.name}' takes {accepted} of the {2**signal.length} values of its bits"


def doubts(message: str, signal: Signal, written: SourceSignal) -> list[Remark]:
    """What a reader should look at before a frame is refused on the bus."""
    table = heading(message, signal.name)
    why = narrow_range(signal, written)
    if signal.signed and signal.length == 1:
        text = f"signal '{message}.{signal.name}' has one bit and a sign: its values are 0 and -1"
        return [Remark(written.place, text, f"if it is 0 and 1: write in the overlay: {table} signed = false")]
    wrong = impossible_range(message, signal, written)
    if wrong is not None:
        return [Remark(wrong.place, f"{wrong.message}; it is taken for none", wrong.help_text)]
    if why:
        text = f"{accepted_text(message, signal)}, {why}; frames with any other are refused"
        return [Remark(written.place, text, f'to take them: write in the overlay: {table} range = "any"')]
    return []
