# SPDX-License-Identifier: MIT
"""Bounds in time, for this tree, bus, bit rate and a load by others: waits, ages, reactions, safe values.

Frames of others take, in any time t, at most `burst` longest frames and the share `load` of t (a leaky bucket: Cruz, "A
calculus for network delay", 1991), and all of them win the arbitration. An output's frame then waits at most R, the
least solution of

    R = B + I + sum over own messages j, up to and with this one, of n_j (C_j + L) + L + burst C + load R

with C the time of the longest frame, B = C for the one that is on the wire already, I = C for a less urgent one of our
own that a mailbox holds, n_j = ceil(R / T_j) frames of a message with cycle T_j, and L the latency of the transmit
interrupt (Davis et al., "Controller Area Network (CAN) schedulability analysis: Refuted, revisited and revised", 2007,
with the others' messages as one stream). docs/safety.md says what is assumed.

All times are in us, in exact fractions until they are shown, and rounded up then.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from canopy.compiler.bus_model import Bus, Message
from canopy.compiler.bus_timing import frame_bits

LOAD_PERCENT = 60
BURST = 10
LATENCY_US = 50
_LONGEST_BITS = frame_bits(8, extended=True, fd=False)


@dataclass(frozen=True)
class Others:
    """What the rest of the bus and the transmit interrupt may do to us."""

    load_percent: int = LOAD_PERCENT
    """Share of the bus that frames of others take, all of a higher priority; 0..99."""
    burst: int = BURST
    """So many of their frames may come in a row on top of that."""
    latency_us: int = LATENCY_US
    """From a free mailbox to its next frame. A driver that is polled: as long as a frame."""


@dataclass(frozen=True)
class InputBound:
    """Of a received message [us]; None: there is no bound, since it has no cycle time or is never stale."""

    name: str
    age_us: int | None
    """Age of its values at a decision, while its sender keeps to its cycle."""
    stale_us: int | None
    """After its last frame no tick acts on it any more."""


@dataclass(frozen=True)
class OutputBound:
    """Of a sent message [us]; None: it may wait for ever at this load."""

    name: str
    deadline_us: int
    wait_us: int | None
    """From the tick to the end of its frame on the wire."""
    reaction_us: int | None
    """From the end of an input's frame to the end of the output's."""
    safe_us: int | None
    """From the last frame of an input that falls silent to the end of the frame with the safe value; None too where no
    input gets stale."""


@dataclass(frozen=True)
class Bounds:
    """All bounds of an application, for one load by others."""

    others: Others
    frames_per_tick: int
    inputs: tuple[InputBound, ...]
    outputs: tuple[OutputBound, ...]
    load_limit_percent: int | None
    """The highest load by others at which every output keeps its deadline and no input gets stale; None: not even 0."""


def _time_us(message: Message, bitrate: int) -> Fraction:
    bits = frame_bits(message.length, extended=message.extended, fd=message.fd)
    return Fraction(bits * 1_000_000, bitrate)


def _ceil(value: Fraction) -> int:
    return -(-value.numerator // value.denominator)


def _wait(bus: Bus, index: int, bitrate: int, others: Others) -> Fraction | None:
    """The longest wait of output `index`; None: longer than its cycle's hundredfold."""
    share = Fraction(others.load_percent, 100)
    longest = max([Fraction(_LONGEST_BITS * 1_000_000, bitrate), *(_time_us(message, bitrate) for message in bus.send)])
    fixed = (2 + others.burst) * longest + others.latency_us
    more_urgent = bus.send[: index + 1]
    limit = 100 * bus.send[index].cycle_ms * 1000
    wait = fixed
    while wait <= limit:
        own = sum(
            (
                _ceil(wait / (message.cycle_ms * 1000)) * (_time_us(message, bitrate) + others.latency_us)
                for message in more_urgent
            ),
            Fraction(0),
        )
        longer = (fixed + own) / (1 - share)
        if longer <= wait:
            return wait
        wait = longer
    return None


def _age(message: Message, bitrate: int, others: Others) -> int | None:
    """Its sender's frame may leave at once the one time, and wait as long as it can the next time."""
    if not message.cycle_us:
        return None
    share = Fraction(others.load_percent, 100)
    longest = Fraction(_LONGEST_BITS * 1_000_000, bitrate)
    own = _time_us(message, bitrate)
    wait = ((1 + others.burst) * max(longest, own) + own) / (1 - share) - own
    return message.cycle_us + _ceil(wait)


def _inputs(bus: Bus, bitrate: int, others: Others) -> tuple[InputBound, ...]:
    return tuple(
        InputBound(
            message.name,
            _age(message, bitrate, others),
            message.timeout_us or None,
        )
        for message in bus.receive
    )


def _outputs(bus: Bus, bitrate: int, others: Others) -> tuple[OutputBound, ...]:
    timeouts = [message.timeout_us for message in bus.receive if message.timeout_us]
    result = []
    for index, message in enumerate(bus.send):
        exact = _wait(bus, index, bitrate, others)
        wait = None if exact is None else _ceil(exact)
        # An output that is not due in every tick waits for its tick.
        due_us = message.cycle_ms * 1000
        result.append(
            OutputBound(
                message.name,
                due_us,
                wait,
                None if wait is None else due_us + wait,
                None if wait is None or not timeouts else max(timeouts) + due_us + wait,
            )
        )
    return tuple(result)


def refusal(bus: Bus, bounds: Bounds) -> tuple[str, str] | None:
    """What is not kept at the stated load, and the way out; None: everything is."""
    others = bounds.others
    at = f"at {others.load_percent} % load by others, in bursts of {others.burst} frames"
    limit = bounds.load_limit_percent
    most = f"it can be kept up to {limit} %" if limit is not None else "it cannot be kept at any load"
    way_out = f"{most}: state what your bus has with --foreign-load and --foreign-burst, or take longer cycles"
    for output in late_outputs(bounds):
        wait = "for ever" if output.wait_us is None else f"{output.wait_us / 1000:.1f} ms"
        late = f"message '{output.name}' may wait {wait} for the bus {at}"
        return f"{late}, and is replaced after its cycle of {output.deadline_us // 1000} ms", way_out
    for bound in stale_inputs(bus, bounds):
        return f"message '{bound.name}' may get stale {at} although its sender keeps to its cycle", way_out
    return None


def late_outputs(bounds: Bounds) -> list[OutputBound]:
    """Outputs that may not be out at their deadline."""
    return [output for output in bounds.outputs if output.wait_us is None or output.wait_us > output.deadline_us]


def stale_inputs(bus: Bus, bounds: Bounds) -> list[InputBound]:
    """Inputs that may get stale although their sender keeps to its cycle."""
    timeouts = {message.name: message.timeout_us for message in bus.receive}
    return [
        bound
        for bound in bounds.inputs
        if bound.age_us is not None and timeouts[bound.name] and bound.age_us >= timeouts[bound.name]
    ]


def _at(bus: Bus, bitrate: int, others: Others, frames: int, limit: int | None) -> Bounds:
    return Bounds(
        others,
        frames,
        _inputs(bus, bitrate, others),
        _outputs(bus, bitrate, others),
        limit,
    )


def make_bounds(bus: Bus, bitrate: int, others: Others, trace_frames: int) -> Bounds:
    """All bounds. `trace_frames`: most trace frames of a tick."""
    frames = len(bus.send) + trace_frames
    limit = None
    low, high = 0, 100
    while low < high:
        middle = (low + high) // 2
        tried = _at(bus, bitrate, Others(middle, others.burst, others.latency_us), frames, None)
        if late_outputs(tried) or stale_inputs(bus, tried):
            high = middle
        else:
            low, limit = middle + 1, middle
    return _at(bus, bitrate, others, frames, limit)
