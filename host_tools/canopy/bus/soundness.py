# SPDX-License-Identifier: MIT
"""What of a bus description can be taken: a message that cannot be is left out, with the reason; the rest stays."""

from __future__ import annotations

from canopy.bus.source import Source, SourceMessage, SourceSignal
from canopy.compiler.bus_model import Ranges, cut, merge
from canopy.compiler.errors import CompileError


def mask(signal: SourceSignal) -> int:
    """Bit 8 * byte + bit in it is set for each bit of the signal."""
    ones = (1 << signal.length) - 1
    if signal.little_endian:
        return ones << signal.start
    # Motorola: `start` is the most significant bit; the next lower one is to its right, then bit 7 of the next byte.
    first, skipped = signal.start // 8, 7 - signal.start % 8
    size = (skipped + signal.length + 7) // 8
    filled = ones << (8 * size - skipped - signal.length)
    return int.from_bytes(filled.to_bytes(size, "big"), "little") << (8 * first)


def _layout(signal: SourceSignal) -> tuple[object, ...]:
    return (
        signal.start, signal.length, signal.little_endian, signal.is_signed, signal.is_float, signal.scale,
        signal.offset, signal.minimum, signal.maximum, signal.multiplexer, signal.is_multiplexer,
    )  # fmt: skip


def _first_bit(signal: SourceSignal) -> int:
    """Where the signal begins, from the left: the order of the members in C."""
    return signal.start if signal.little_endian else 8 * (signal.start // 8) + 7 - signal.start % 8


def meet(one: Ranges, other: Ranges) -> bool:
    """Have they a number in common?"""
    return any(cut(other, low, high) for low, high in one)


def _free(name: str, suffix: str, taken: set[str]) -> str:
    """`name` with the suffix, and with a number if that is taken, too."""
    result, number = f"{name}{suffix}", 2
    while result in taken:
        result, number = f"{name}{suffix}_{number}", number + 1
    taken.add(result)
    return result


def _join_names(message: SourceMessage) -> None:
    """Signals of one name in several branches are one, where they are the same; else the second gets another name."""
    taken = {signal.name for signal in message.signals}
    kept: dict[str, list[SourceSignal]] = {}
    for signal in message.signals:
        others = kept.setdefault(signal.name, [])
        same = next((other for other in others if signal.branches and _layout(other) == _layout(signal)), None)
        if same is None:
            others.append(signal)
            continue
        same.branches = merge([*same.branches, *signal.branches])
        same.comment = same.comment or signal.comment
    message.signals = sorted((signal for others in kept.values() for signal in others), key=_first_bit)
    for name, others in kept.items():
        for signal in others[1:]:
            signal.name = _free(name, f"_m{signal.branches[0][0]}" if signal.branches else "_2", taken)
            text = f"message '{message.name}' has another signal '{name}': this one is '{signal.name}' here"
            message.notes.append((signal.place, text))


def _check_multiplexers(message: SourceMessage) -> None:
    known = {signal.name for signal in message.signals if signal.is_multiplexer}
    for signal in message.signals:
        if (signal.marker or signal.branches) and signal.multiplexer not in known:
            raise CompileError(
                signal.place,
                f"signal '{message.name}.{signal.name}' is multiplexed, but it is not clear by which multiplexer",
                f"add SG_MUL_VAL_ {message.id} {signal.name} MULTIPLEXER RANGES; to the DBC",
            )


def _drop_what_does_not_fit(message: SourceMessage) -> None:
    for signal in list(message.signals):
        last = (mask(signal).bit_length() - 1) // 8
        if last >= message.length:
            reason = CompileError(
                signal.place,
                f"signal '{message.name}.{signal.name}' does not fit: it ends in byte {last}, and the message has "
                f"{message.length} bytes",
                f"to fix: write `length = {last + 1}` for the message in the overlay, if its frames are so long",
            )
            message.drop(signal, reason)


def _conditions(message: SourceMessage, signal: SourceSignal) -> dict[str, Ranges]:
    """Multiplexer -> values it has when the signal is in the frame."""
    result: dict[str, Ranges] = {}
    owners = {other.name: other for other in message.signals}
    while signal.multiplexer is not None and signal.multiplexer not in result:
        result[signal.multiplexer] = signal.branches
        signal = owners[signal.multiplexer]
    return result


def overlap(message: SourceMessage) -> tuple[str, str] | None:
    """Two signals that have a bit in common in a frame; None: there are none. The message can be received only."""
    masks = [(mask(signal), signal) for signal in message.signals]
    together = 0
    for own, _ in masks:
        if together & own:
            break
        together |= own
    else:
        return None  # no two at all: the usual case
    conditions = {signal.name: _conditions(message, signal) for signal in message.signals}
    for place, (own, signal) in enumerate(masks):
        for other_mask, other in masks[place + 1 :]:
            if own & other_mask:
                mine, theirs = conditions[signal.name], conditions[other.name]
                if all(meet(mine[name], theirs[name]) for name in mine.keys() & theirs.keys()):
                    return signal.name, other.name
    return None


def check_message(message: SourceMessage) -> None:
    """Finds what is wrong with a message by itself, unless that is known. Raises nothing: see `problem`."""
    if message.problem is not None:
        return
    try:
        _check_multiplexers(message)
        _drop_what_does_not_fit(message)
    except CompileError as error:
        message.problem = error


def name_apart(source: Source) -> None:
    """Gives each message and signal a name of its own; the first of several keeps it. Before the overlay names them."""
    taken = {message.name for message in source.messages}
    names: set[str] = set()
    for message in source.messages:
        if message.problem is None:
            _join_names(message)
        if message.name not in names:
            names.add(message.name)
            continue
        old = message.name
        message.name = _free(old, f"_{message.frame_id:X}", taken)
        text = f"there is another message '{old}': this one is '{message.name}' here"
        message.notes.append((message.place, text))


def check_source(source: Source) -> None:
    """Finds what is wrong with each message, and among them: of two with one id the first one stays."""
    identifiers: dict[tuple[bool, int, int], SourceMessage] = {}
    for message in source.messages:
        check_message(message)
        if message.problem is not None:
            continue
        key = (message.is_extended, message.frame_id & message.mask, message.mask)
        other = identifiers.setdefault(key, message)
        if other is not message:
            text = f"messages '{other.name}' and '{message.name}' have the same id 0x{message.frame_id:X}"
            help_text = f"to have '{message.name}': write `leave_out = true` for '{other.name}' in the overlay"
            message.problem = CompileError(message.place, text, help_text)
