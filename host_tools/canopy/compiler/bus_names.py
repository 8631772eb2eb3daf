# SPDX-License-Identifier: MIT
"""C names for a bus: every message, signal and named value gets one, and no two the same, whatever the DBC calls them.

The first of two that would become the same name keeps it, the second gets `_2`, and so on (messages by id, signals as
in the DBC). The generated header shows the DBC's name beside each.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable

from canopy.compiler.bus_model import Enumerator, Message, Signal
from canopy.compiler.names import snake

# What may not be a member or a local variable: words of C++ (a C++ program may include the header), macros that
# compilers define without being asked, and the variables of the generated functions.
_WORDS = """
alignas alignof and and_eq asm atomic bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield
compl concept consteval constexpr constinit const_cast decltype delete dynamic_cast explicit export final friend
mutable namespace new noexcept not not_eq nullptr operator or or_eq override private protected public
reinterpret_cast requires static_assert static_cast template this thread_local throw try typeid typename typeof
using virtual wchar_t xor xor_eq near far linux unix i386 arm errno data in input length limited out output self
size value choice fresh age_ms int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t size_t
"""
_TAKEN = frozenset(_WORDS.split())
_IMAGE_MEMBERS = ("now", "can_state", "overload", "written", "saturated", "halting")
_BUS_WORDS = (
    "bus", "bus_h", "codec_h", "input", "output", "acceptance", "rx_messages", "tx_messages", "tx_bytes",
    "output_signals", "transport_bytes",
)  # fmt: skip
# What the application's header adds, with the same prefix.
_APPLICATION_WORDS = ("period_us", "tree_hash", "nodes", "words", "texts")
_SIGNAL_WORDS = ("physical", "per_unit", "fixed", "from_fixed")
_MESSAGE_WORDS = ("id", "mask", "length", "extended", "fd", "cycle_ms", "data_id")


class _Names(set[str]):
    """Names that are taken, and the last number that was put behind each."""

    def __init__(self, *names: str) -> None:
        super().__init__(names)
        self.last: dict[str, int] = {}


def _free(wanted: str, taken: Iterable[_Names], prefix: str = "") -> str:
    """`wanted`, or with the first number from 2 that makes it new in all sets, which get it."""
    sets = list(taken)
    stem, name = wanted.rstrip("_"), wanted
    number = sets[0].last.get(prefix + wanted, 1)
    while name in sets[0] or any(prefix + name in names for names in sets[1:]):
        number += 1
        name = f"{stem}_{number}"
    sets[0].last[prefix + wanted] = number
    sets[0].add(name)
    for names in sets[1:]:
        names.add(prefix + name)
    return name


def _spelled(text: str) -> str:
    """A text with its signs as words, `Fuse+` as `Fuse plus`, and letters that C does not have by their numbers."""
    text = re.sub(r"\+", " plus ", text)
    text = re.sub(r"(?<![A-Za-z0-9])-(?=\w)|(?<=\w)-(?!\w)|^-$", " minus ", text)
    return re.sub(r"[^\W\d_a-zA-Z]+", lambda found: "_" + "_".join(f"u{ord(c):x}" for c in found[0]) + "_", text)


def _enumerators(signal: Signal, stem: str, everything: _Names) -> tuple[Enumerator, ...]:
    result = []
    for value, text in signal.choices:
        word = snake(_spelled(text)).strip("_") or f"value_{'minus_' if value < 0 else ''}{abs(value)}"
        name = _free(f"{stem}_{word}", [everything])
        result.append(Enumerator(value, text, name.upper()))
    return tuple(result)


def _name_signals(message: Message, everything: _Names) -> Message:
    members = _Names(*_TAKEN)
    named = []
    for signal in message.signals:
        wanted = snake(_spelled(signal.name))
        c_name = _free(f"{wanted}_" if wanted in _TAKEN else wanted, [members, everything], f"{message.c_name}_")
        while any(f"{message.c_name}_{c_name}_{word}" in everything for word in _SIGNAL_WORDS):
            c_name = _free(wanted, [members, everything], f"{message.c_name}_")
        everything |= {f"{message.c_name}_{c_name}_{word}" for word in _SIGNAL_WORDS}
        named.append(dataclasses.replace(signal, c_name=c_name))
    names = {signal.name: signal.c_name for signal in named}
    for place, signal in enumerate(named):
        named[place] = dataclasses.replace(
            signal,
            enumerators=_enumerators(signal, f"{message.c_name}_{signal.c_name}", everything),
            selectors=tuple(dataclasses.replace(s, signal=names[s.signal]) for s in signal.selectors),
            has_name=_free(f"has_{signal.c_name}", [members]) if signal.selectors else "",
        )
    return dataclasses.replace(message, signals=tuple(named))


def name_messages(messages: tuple[Message, ...]) -> tuple[Message, ...]:
    """The messages with C names. Selectors name multiplexers as the DBC does before, as C does after.

    Names of messages come first, so that no signal takes one from them.
    """
    members = _Names(*_TAKEN, *_IMAGE_MEMBERS)
    everything = _Names(*_BUS_WORDS, *_APPLICATION_WORDS)
    named = []
    for message in messages:
        wanted = snake(_spelled(message.name))
        wanted = f"{wanted}_" if wanted in members else wanted
        named.append(dataclasses.replace(message, c_name=_free(wanted, [members, everything])))
    for message in named:
        everything |= {f"{message.c_name}_{word}" for word in _MESSAGE_WORDS}
    return tuple(_name_signals(message, everything) for message in named)
