# SPDX-License-Identifier: MIT
"""What an output must have besides its layout: a cycle that fits the ticks, and a safe value for each signal."""

from __future__ import annotations

from canopy.bus.overlay import to_write
from canopy.compiler.bus_model import Message, Signal, float_value
from canopy.compiler.dbc_file import Dbc, attribute, attribute_place, number
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.limits import EVERY, TIME_MS, whole
from canopy.compiler.signal_reader import is_safe


def check_outputs(dbc: Dbc, messages: tuple[Message, ...], period_ms: int) -> None:
    """Raises CompileError for the first of them that cannot be sent; its help names the overlay's line to write."""
    for message in messages:
        owner = dbc.message(message.name)
        place = attribute_place(dbc, "GenMsgCycleTime", owner)
        attribute(dbc, "GenMsgCycleTime", TIME_MS, owner)  # a whole number of ms
        if message.cycle_ms == 0 or message.cycle_ms % period_ms:
            raise CompileError(
                place,
                f"message '{message.name}' is sent every {message.cycle_ms} ms, which is no multiple of the period",
                f"{to_write(dbc.path, 'cycle_ms = MS', message.name)}, a multiple of {period_ms}; or change the period",
            )
        check_every(place, message, period_ms)
        for signal in message.signals:
            written = owner.signal(signal.name)
            if number(dbc, "GenSigInactiveValue", owner, written) is None:
                line = to_write(dbc.path, "safe = VALUE", message.name, signal.name)
                raise CompileError(
                    written.place,
                    f"output '{message.name}.{signal.name}' has no safe value",
                    f"{line} (or GenSigInactiveValue in the DBC)",
                )
            _check_safe(attribute_place(dbc, "GenSigInactiveValue", owner, written), message, signal)


def check_every(place: Place, message: Message, period_ms: int) -> None:
    """A longer one would become another number of ticks in C, 0 among them."""
    whole(
        max(1, message.cycle_ms // period_ms),
        EVERY,
        f"GenMsgCycleTime of message '{message.name}', {message.cycle_ms} ms in ticks of {period_ms} ms,",
        place,
        f"at most {EVERY.high * period_ms} ms with this period",
    )


def _check_safe(place: Place, message: Message, signal: Signal) -> None:
    if is_safe(signal):
        return
    if signal.is_float:
        safe, *ends = (f"{float_value(bits, signal.length):g}" for bits in (signal.safe, signal.low, signal.high))
        allowed = "..".join(ends)
    else:
        safe = str(signal.safe)
        allowed = ", ".join(f"{low}..{high}" if low < high else f"{low}" for low, high in signal.accepted)
    raise CompileError(
        place, f"the safe value {safe} of output '{message.name}.{signal.name}' is outside its range: {allowed} (raw)"
    )
