# SPDX-License-Identifier: MIT
"""Which frames of a log a tick took, with frames of two senders."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from canopy.live.frames import ArrivalsFrame
from canopy.replay.inputs import Inputs
from canopy.replay.log import LogError, Recording, Run, Taken
from canopy.replay.ticks import Tick, find_times, next_check


def synthetic(seed: int, ticks: int = 60) -> tuple[Recording, Run, list[list[Taken]]]:
    """Frames of two senders, and ticks that took them."""
    rnd = random.Random(seed)
    received = [
        Taken(
            place,
            rnd.choice((0x100, 0x110, 0x7)),
            rnd.choice("AB"),
            bytes([place % 256]),
            rnd.choice((None, rnd.randrange(256), rnd.randrange(256))),
        )
        for place in range(1, 400)
    ]
    start, run = rnd.randrange(100), Run(before=0)
    run.before = min(start + 3, 120)
    taken = check = 0
    place = start
    groups = []
    for number in range(ticks):
        group = received[place : place + rnd.choice((0, 1, 2, 2, 5))]
        for one in group:
            check = next_check(check, one.fold) if one.fold is not None else check
        place += len(group)
        taken = (taken + len(group)) % 256
        tick = Tick(number, number, inputs=bytes(5) + bytes([rnd.randrange(16), 0, 0]))
        tick.frames = len(group)
        tick.ages = [rnd.randrange(65536) for _ in {one.message for one in group}]
        check = tick.check_of_ages(check)
        tick.inputs = bytes([0, 0, 0, taken, check]) + tick.inputs[5:]
        run.ticks.append(tick)
        groups.append(group)
    return Recording(Path("x.log"), received=received, runs=[run]), run, groups


def flat(groups: list[list[Taken]]) -> list[bytes]:
    return [one.datagram for group in groups for one in group]


@pytest.mark.parametrize("seed", range(40))
def test_the_first_frame_is_found(seed: int) -> None:
    recording, run, groups = synthetic(seed)
    inputs = Inputs(recording, run, len(run.ticks))
    assert [[one.datagram for one in group] for group in inputs] == [
        [one.datagram for one in group] for group in groups
    ]
    assert len(inputs) == len(flat(groups))
    assert inputs.reordered == 0


@pytest.mark.parametrize("seed", range(40))
def test_neighbours_of_different_senders_may_have_changed_places(seed: int) -> None:
    recording, run, groups = synthetic(seed)
    taken = [one for group in groups for one in group]
    rnd = random.Random(seed)
    swapped = 0
    first = recording.received.index(taken[0])
    at = 8
    while at < len(taken) - 20:
        a, b = recording.received[first + at : first + at + 2]
        if a.sender != b.sender and None not in (a.fold, b.fold) and a.fold != b.fold:
            recording.received[first + at : first + at + 2] = [b, a]
            swapped += 1
            at += 9
        at += rnd.randrange(1, 4)
    inputs = Inputs(recording, run, len(run.ticks))
    assert [[one.datagram for one in group] for group in inputs] == [
        [one.datagram for one in group] for group in groups
    ]
    assert inputs.reordered == swapped


def test_frames_of_one_sender_keep_their_order() -> None:
    recording, run, groups = synthetic(7)
    taken = [one for group in groups for one in group]
    first = recording.received.index(taken[0])
    for at in range(10, len(taken) - 20):
        a, b = recording.received[first + at : first + at + 2]
        if a.sender == b.sender and None not in (a.fold, b.fold) and a.fold != b.fold:
            recording.received[first + at : first + at + 2] = [b, a]
            with pytest.raises(LogError, match="order"):
                Inputs(recording, run, len(run.ticks))
            return
    pytest.fail("no such pair")


def tick_with(list_of_ages: bytes, taken: int, many: bool = False) -> Tick:
    """A tick whose list of ages goes through CanopyInputs and, where it is too long, CanopyArrivals."""
    tick = Tick(5, 1)
    count = min(len(list_of_ages), 3)
    head = list_of_ages[:2].ljust(2, b"\0")
    tick.take_inputs(bytes([0, 0, 0, taken % 256, 0, count << 5 | many << 7]) + head)
    assert tick.is_whole == (count < 3)
    rest = list_of_ages[2:]
    while rest:
        last = len(rest) <= 7
        data = bytes([5 | min(len(rest), 7) << 4 | last << 7]) + rest[:7].ljust(7, b"\0")
        frame = ArrivalsFrame.read(data)
        assert frame is not None
        tick.take_arrivals(frame)
        assert tick.is_whole == last
        rest = rest[7:]
    return tick


@pytest.mark.parametrize(
    ("list_of_ages", "before", "taken", "many", "frames", "ages"),
    [
        (b"", 7, 7, False, 0, []),
        (b"\x00", 255, 256, False, 1, [0]),
        (b"\x05\xfe", 250, 253, False, 3, [5, 254]),
        (b"\xff\xff\x00", 0, 1, False, 1, [255]),
        (b"\xff\xff\xff\x07", 0, 9, False, 9, [65535, 7]),
        (bytes(range(1, 30)), 0, 29, False, 29, list(range(1, 30))),
        ((256).to_bytes(4, "little") + b"\x03", 9, 9, True, 256, [3]),
        ((70_000).to_bytes(4, "little") + b"\x03\x04", 0, 70_000, True, 70_000, [3, 4]),
    ],
)
def test_the_list_of_ages_is_read(
    list_of_ages: bytes, before: int, taken: int, many: bool, frames: int, ages: list[int]
) -> None:
    tick = tick_with(list_of_ages, taken, many)
    assert tick.read_ages(before)
    assert (tick.frames, tick.ages) == (frames, ages)


@pytest.mark.parametrize(
    ("list_of_ages", "taken", "many"),
    [
        (b"\x05", 0, False),  # an age without a frame
        (b"", 1, False),  # a frame without an age
        (b"\x05\x06", 1, False),  # more messages than frames
        (b"\xff", 1, False),  # cut off
        (b"\xff\x01", 1, False),
        (b"\x00\x01", 256, True),  # a number that is cut off
        ((255).to_bytes(4, "little") + b"\x03", 255, True),  # not many
        ((257).to_bytes(4, "little") + b"\x03", 256, True),  # not what Taken says
    ],
)
def test_a_list_of_ages_that_cannot_be_is_refused(list_of_ages: bytes, taken: int, many: bool) -> None:
    assert not tick_with(list_of_ages, taken, many).read_ages(0)


def ticks_at(times: list[int], told: set[int]) -> list[Tick]:
    """Ticks at certain times, with the upper bits of those at some places."""
    return [
        Tick(
            number,
            number,
            inputs=(time % 2**24).to_bytes(3, "little") + bytes(5),
            upper=time >> 24 if number in told else None,
        )
        for number, time in enumerate(times)
    ]


UPPER = 1 << 24


@pytest.mark.parametrize(
    ("times", "told", "known"),
    [
        ([5, 6, 7], {0}, 3),
        ([5, 6, 7], set(), 0),
        ([9 * UPPER - 1, 9 * UPPER, 9 * UPPER + 5], {0, 1}, 3),
        ([9 * UPPER - 1, 9 * UPPER, 9 * UPPER + 5], {0}, 3),  # the frame is missing: the lower bits go back
        ([9 * UPPER - 1, 9 * UPPER, 9 * UPPER + 5], {2}, 3),
        ([5, 100 * UPPER, 300 * UPPER + 2], {0, 1, 2}, 3),  # ticks far apart tell them each time
        ([5, 9 * UPPER + 1, 9 * UPPER + 2, 9 * UPPER + 3], {0, 3}, 1),  # more than once around, and nobody said when
        ([5, 6, 7, UPPER], {0, 3}, 4),
        ([UPPER, 7], {0, 1}, 1),  # back
    ],
)
def test_the_times_of_ticks(times: list[int], told: set[int], known: int) -> None:
    ticks = ticks_at(times, told)
    assert find_times(ticks) == known
    assert [tick.now for tick in ticks[:known]] == times[:known]
