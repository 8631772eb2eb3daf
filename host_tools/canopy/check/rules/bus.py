# SPDX-License-Identifier: MIT
"""What a DBC says that a compiler can take, and that nobody can have meant. Only with --dbc."""

from __future__ import annotations

from collections.abc import Iterator

from canopy.bus import doubts
from canopy.check.facts import Facts
from canopy.check.registry import Hit, Severity, rule


@rule(
    "swapped-range",
    Severity.WARNING,
    "A range whose minimum is not below its maximum",
    why="It is taken for no range at all: every value of the bits is accepted, and none is limited. A swapped range of "
    "a multiplexer's values selects nothing.",
    way_out="Swap the ends, or write 0 for both where there is no range.",
)
def swapped_range(facts: Facts) -> Iterator[Hit]:
    """[0|0] is how DBCs say that there is none."""
    if facts.bus is None:
        return
    for message, signal, written in facts.bus.signals():
        low, high = written.minimum, written.maximum
        if low is not None and high is not None and low >= high and (low or high):
            where = facts.bus.place(message, signal)
            yield Hit(where, f"signal '{message.name}.{signal.name}' has the range [{low}|{high}]")
    for name, found in facts.bus.reversed_ranges():
        yield Hit(found.place, f"signal '{name}.{found.signal}' is in the branches {found.text}, which are none")


@rule(
    "never-stale",
    Severity.WARNING,
    "An input that never gets stale",
    why="With neither GenMsgTimeoutTime nor GenMsgCycleTime a message is fresh for ever once it has been received: a "
    "loose cable is not noticed, and leaves act on old values.",
    way_out="Give the message a GenMsgTimeoutTime, or its GenMsgCycleTime.",
)
def never_stale(facts: Facts) -> Iterator[Hit]:
    """Inputs only: what the timeout of an output is for, its receivers know."""
    if facts.bus is None:
        return
    for message in facts.bus.bus.receive:
        if message.timeout_us == 0:
            yield Hit(facts.bus.place(message), f"input '{message.name}' never gets stale")


@rule(
    "short-timeout",
    Severity.WARNING,
    "A timeout that is shorter than the message's cycle, or than the controller's period",
    why="The message gets stale between two frames that come in time, or between two ticks.",
    way_out="Raise GenMsgTimeoutTime to some cycles: one lost frame is no fault.",
)
def short_timeout(facts: Facts) -> Iterator[Hit]:
    """The period is known with --period-ms."""
    if facts.bus is None:
        return
    for message in facts.bus.bus.messages:
        timeout = facts.bus.timeout_ms(message)
        received = message.name in facts.bus.bus.received
        limits = [("cycle", message.cycle_ms), ("period of the controller", facts.bus.period_ms if received else 0)]
        for what, least in limits:
            if 0 < timeout < least:
                place = facts.bus.attribute_place("GenMsgTimeoutTime", message)
                text = f"message '{message.name}' has a timeout of {timeout} ms, and the {what} is {least} ms"
                yield Hit(place, text)
                break


@rule(
    "shared-data-id",
    Severity.ERROR,
    "One E2EDataId on two messages",
    why="The data id tells a frame of one message from one of another, where both have the same length and come under "
    "the wrong id: the end-to-end protection cannot see such a frame any more.",
    way_out="Give each message a data id of its own, on the whole bus.",
)
def shared_data_id(facts: Facts) -> Iterator[Hit]:
    """Of all messages of the bus: a wrong frame can come from anyone."""
    first: dict[int, str] = {}
    for data_id, name, place in facts.bus.data_ids() if facts.bus is not None else ():
        other = first.setdefault(data_id, name)
        if other != name:
            yield Hit(place, f"messages '{other}' and '{name}' have the same E2EDataId {data_id}")


@rule(
    "narrow-range",
    Severity.WARNING,
    "A range that refuses almost all values of its bits",
    why="A frame with a value out of range is refused as a whole. A range that was meant for raw values, for another "
    "scale, or for an unsigned signal refuses most frames.",
    way_out="Correct the range, the scale or the sign (@1+), or the overlay's `range`; 0 for both ends is no range.",
)
def narrow_range(facts: Facts) -> Iterator[Hit]:
    """Signals with a table of values have their ranges for it."""
    if facts.bus is None:
        return
    for message, signal, written in facts.bus.signals():
        why = doubts.narrow_range(signal, written)
        if why:
            yield Hit(facts.bus.place(message, signal), f"{doubts.accepted_text(message.name, signal)}, {why}")
