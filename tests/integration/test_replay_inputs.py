# SPDX-License-Identifier: MIT
"""Which frames of a log a tick took, with frames of two senders."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from canopy.replay.inputs import Inputs
from canopy.replay.log import LogError, Recording, Run, Taken
from canopy.replay.ticks import Tick, next_check


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
        tick = Tick(number, number, conditions=rnd.randrange(16))
        tick.ages = [rnd.randrange(65536) for _ in {one.message for one in group}]
        check = tick.check_of_ages(check)
        tick.inputs = bytes(6) + bytes([taken, check])
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
