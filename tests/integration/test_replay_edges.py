# SPDX-License-Identifier: MIT
"""canopy replay at the edges of the tick: what is said of arrivals, and commands that never left."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable, Collection
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result
from e2e.p11 import e2e_p11_protect

from canopy.cli import main
from canopy.model import load_model
from canopy.replay.log import read_recording
from integration import logs
from integration.test_replay import (
    ARRIVALS,
    BATTERY,
    CHANGE,
    HEALTH,
    INPUTS,
    MODEL,
    POSTURE_COMMAND,
    POWER_COMMAND,
    SNAPSHOT,
    TICK,
    TRACE,
    Log,
    differs,
    flip,
    model_file,
    place_of,
    refused,
    tick_before,
    tick_number,
)

TICKS = 220
COMMANDS = (POWER_COMMAND, POSTURE_COMMAND)
NAMES = {POWER_COMMAND: "PowerCommand", POSTURE_COMMAND: "PostureCommand"}


@pytest.fixture(scope="module")
def original(build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Log:
    return logs.make_log(build_dir, "nao_home", TICKS, tmp_path_factory.mktemp("log"), seed=5)


@pytest.fixture
def log(original: Log) -> Log:
    """A copy to spoil."""
    return copy.deepcopy(original)


@pytest.fixture
def replay(build_dir: Path, tmp_path: Path) -> Callable[..., Result]:
    """Replays a log with nao_home."""

    def run(messages: Log, *options: str) -> Result:
        path = logs.write_log(tmp_path / "run.log", messages)
        command = ["replay", str(path), "--model", str(model_file(build_dir))]
        return CliRunner().invoke(main, [*command, "--program", str(build_dir / "examples/nao/nao_home"), *options])

    return run


def is_equal(result: Result) -> dict[str, int]:
    """What a replay without differences says as JSON."""
    assert result.exit_code == 0, (result.output, result.exception)
    data: dict[str, int] = json.loads(result.stdout)
    assert data["equal"]
    return data


def tick_of(log: Log, place: int) -> int:
    """Of a command the tick whose CanopyTick comes next, of a trace frame that of the last one."""
    step = 1 if log[place].arbitration_id in COMMANDS else -1
    at = next(i for i in range(place, len(log) if step == 1 else -1, step) if log[i].arbitration_id == TICK)
    return tick_number(log[at])


def protect_again(log: Log) -> None:
    """Gives the commands consecutive counters, as a controller does that has not sent those that are missing."""
    counters = dict.fromkeys(COMMANDS, 0)
    for message in log:
        number = message.arbitration_id
        if number in COMMANDS:
            message.data[1] = message.data[1] & 0xF0 | counters[number]
            e2e_p11_protect(message.data, number, increment_counter=False)
            counters[number] = (counters[number] + 1) % 15


def is_count(message: can.Message) -> bool:
    """Is it the CanopyHealth with TxReplaced, TxExpired and TraceDropped?"""
    return message.arbitration_id == HEALTH and message.data[0] & 15 == 1


def drop(log: Log, places: Collection[int], counted: int | None = None) -> Log:
    """The log without commands that were replaced or expired, counted as so many (None: right) a tick later."""
    ticks = sorted(tick_of(log, place) for place in places)
    for place, message in enumerate(log):
        if is_count(message):
            dropped = sum(tick < tick_of(log, place) for tick in ticks)
            dropped = dropped if counted is None else min(dropped, counted)
            message.data[1:7] = b"".join(
                number.to_bytes(2, "little") for number in (dropped // 2, dropped % 2, dropped // 2)
            )
    left = [message for place, message in enumerate(log) if place not in places]
    protect_again(left)
    return left


def places_of(log: Log, identifier: int, ticks: Collection[int]) -> set[int]:
    return {place_of(log, identifier, tick) for tick in ticks}


# --- arrivals ---------------------------------------------------------------------------------------------------------


def ages_in(message: can.Message) -> int:
    """Ages of a CanopyInputs: how many bytes are told, 3: more in CanopyArrivals."""
    return message.data[5] >> 5 & 3


def test_the_log_has_what_is_tested(log: Log) -> None:
    inputs = [message for message in log if message.arbitration_id == INPUTS]
    assert {0, 1, 2, 3} == {ages_in(message) for message in inputs}
    assert {0, 17, 120} <= {byte for message in inputs for byte in message.data[6 : 6 + ages_in(message)]}
    assert set(logs.BUS_STATES) == {message.data[5] & 0x1F for message in inputs}
    arrivals = [message for message in log if message.arbitration_id == ARRIVALS]
    assert {1, 2, 4} <= {message.data[0] >> 4 & 7 for message in arrivals}


@pytest.mark.parametrize("byte", range(3, 8))
def test_changed_inputs_are_seen(replay: Callable[..., Result], log: Log, byte: int) -> None:
    place = next(
        i for i, m in enumerate(log) if m.arbitration_id == INPUTS and tick_of(log, i) > 90 and ages_in(m) == 2
    )
    tick = tick_of(log, place)
    flip(log[place], byte)
    result = replay(log)
    assert result.exit_code == 1
    assert result.stderr.startswith("canopy replay: "), result.stderr
    assert re.search(rf"--ticks {tick - 1 if tick % 10 else '[0-9]+'}|--ticks {tick}|--ticks {tick + 1}", result.stderr)
    assert replay(log, "--ticks", str(tick)).exit_code == 0


def test_a_time_that_goes_back_is_a_gap(replay: Callable[..., Result], log: Log) -> None:
    """Its lower bits seem to have come round, and the next CanopyModel says that they have not."""
    place = place_of(log, INPUTS, 93)
    log[place].data[0:3] = ((int.from_bytes(log[place].data[0:3], "little") - 60_000) % 2**24).to_bytes(3, "little")
    result = replay(log)
    refused(result, "is not known: CanopyModel frames are missing")
    cut = int(re.findall(r"--ticks (\d+)", result.stderr)[0])
    assert 80 <= cut <= 93
    assert replay(log, "--ticks", str(cut)).exit_code == 0


@pytest.mark.parametrize("byte", [0, 1, 2, 3])
def test_changed_arrivals_are_seen(replay: Callable[..., Result], log: Log, byte: int) -> None:
    place = next(
        i for i, m in enumerate(log) if m.arbitration_id == ARRIVALS and tick_of(log, i) > 90 and m.data[0] >> 4 & 7 > 2
    )
    tick = tick_of(log, place)
    flip(log[place], byte)
    result = replay(log)
    assert result.exit_code == 1
    assert result.stderr.startswith("canopy replay: "), result.stderr
    assert replay(log, "--ticks", str(tick)).exit_code == 0


def test_a_changed_return_is_a_difference(replay: Callable[..., Result], log: Log) -> None:
    """It is not in Check: but other commands follow from it."""
    place = next(i for i, m in enumerate(log) if m.arbitration_id == INPUTS and m.data[5] & 0x10)
    flip(log[place], 5, 0x10)
    differs(replay(log, "--json"), tick_of(log, place))


def test_lost_arrivals_are_named(replay: Callable[..., Result], log: Log) -> None:
    place = next(i for i, m in enumerate(log) if m.arbitration_id == ARRIVALS and tick_of(log, i) > 40)
    tick = tick_of(log, place)
    left = log[:place] + log[place + 1 :]
    refused(replay(left), f"CanopyArrivals of tick {tick} is missing", f"--ticks {tick} replays")
    assert replay(left, "--ticks", str(tick)).exit_code == 0


def test_many_frames_in_a_tick(build_dir: Path, tmp_path: Path, replay: Callable[..., Result]) -> None:
    """More than Taken can count, which tells their number modulo 256: the list of ages has the number itself then."""
    robot = logs.Robot(3)
    steps = [
        logs.Step(1_000_000 + 50_000 * tick, [robot.sensor("Battery") for _ in range(count)], {BATTERY: 3})
        for tick, count in enumerate((2, 1, 300, 1, 256, 2, 520, 0, 3, 3, 3))
    ]
    sent = logs.run_program(build_dir / "examples" / "nao" / "nao_home", steps, tmp_path)
    log = [message for step, answer in zip(steps, sent, strict=False) for message in (*step.frames, *answer)]
    data = is_equal(replay(logs.stamped(log), "--json"))
    assert (data["ticks"], data["inputs"]) == (len(steps), 2 + 1 + 300 + 1 + 256 + 2 + 520 + 9)


# --- versions, times, and other trees ------------------------------------------------------------------------------


def test_the_trace_of_another_tree_plays_no_part(replay: Callable[..., Result], log: Log) -> None:
    """A second controller on the bus, with trace ids of its own, in other ticks than this one."""
    other = copy.deepcopy([message for message in log if message.arbitration_id in TRACE])
    for message in other:
        message.arbitration_id += 0x10
    mixed = [message for i, own in enumerate(log) for message in (own, *other[i + 100 : i + 101])]
    assert len(mixed) > len(log) + 500
    result = replay(logs.stamped(mixed), "--json")
    assert result.exit_code == 0, (result.output, result.exception)
    assert json.loads(result.stdout)["ticks"] == TICKS


def test_a_tick_number_that_wraps_around_is_no_start(build_dir: Path, log: Log, tmp_path: Path) -> None:
    """Tick numbers moved so that 0 comes again where the sequence number is 0, too."""
    first, sequence = 100, log[place_of(log, TICK, 100)].data[6]
    for message in log:
        byte = 6 if message.arbitration_id == TICK else 0
        if message.arbitration_id in (TICK, CHANGE, SNAPSHOT):
            message.data[byte] = message.data[byte] & 0xC0 | (message.data[byte] - sequence) % 64
        if message.arbitration_id == TICK:
            message.data[2:6] = ((tick_number(message) - first) % 2**32).to_bytes(4, "little")
    recording = read_recording(logs.write_log(tmp_path / "x.log", log), load_model(model_file(build_dir)))
    assert (recording.runs, recording.joined) == ([], 2**32 - first)


def test_a_log_of_an_older_version_is_refused_with_a_way_out(replay: Callable[..., Result], log: Log) -> None:
    for message in log:
        if message.arbitration_id == TICK:  # Sequence, Tick, RootStatus, Changes, Overruns
            message.data = bytearray([message.data[6] & 0x3F, *message.data[2:6], message.data[7] & 7, 0, 0])
    place = next(i for i, m in enumerate(log) if m.arbitration_id == TICK)
    refused(
        replay(log),
        f"run.log: frame {place + 1} is no CanopyTick of trace version 2, but of version 0, or of an older one",
        "replay this log with the release of Canopy that recorded it, and with the program and the model file of then",
    )


def test_the_upper_bits_of_the_time(replay: Callable[..., Result], log: Log) -> None:
    """CanopyModel has them. Where it is missing the lower bits go on, and the next one shows whether that was right."""
    model = [i for i, m in enumerate(log) if m.arbitration_id == MODEL and m.data[0] == 0x21]
    assert len(model) > 10
    left = [m for i, m in enumerate(log) if i != model[3]]
    differs(replay(left, "--json"), tick_before(log, model[3]))  # it is missing, and was not counted
    spoilt = copy.deepcopy(log)
    spoilt[model[5]].data[4] += 1
    result = replay(spoilt)
    refused(result, f"the time of tick {tick_before(log, model[6])} is not known: CanopyModel frames are missing")
    refused(
        replay([m for m in log if m.arbitration_id != MODEL]),
        "the time of tick 0 is not known: CanopyModel frames are missing",
        "record again",
    )


def test_a_log_of_two_buses(replay: Callable[..., Result], log: Log) -> None:
    other = copy.deepcopy(log)
    for message in other:
        message.channel = "can1"
    mixed = [message for pair in zip(log, other, strict=True) for message in pair]
    refused(replay(mixed), "has frames of several buses (can0, can1): choose with --channel")
    assert replay(mixed, "--channel", "can1").exit_code == 0


# --- commands that have not left --------------------------------------------------------------------------------------


@pytest.mark.parametrize("replaced", [1, 3, 14, 15, 100])
def test_replaced_commands_are_no_difference(replay: Callable[..., Result], log: Log, replaced: int) -> None:
    places = places_of(log, POSTURE_COMMAND, range(60, 60 + replaced)) | places_of(log, POWER_COMMAND, {60, 63, 110})
    data = is_equal(replay(drop(log, places), "--json"))
    assert (data["ticks"], data["dropped"]) == (TICKS, replaced + 3)
    told = replay(drop(log, set()))
    assert told.exit_code == 0


def test_dropped_commands_are_told(replay: Callable[..., Result], log: Log) -> None:
    result = replay(drop(log, places_of(log, POWER_COMMAND, {0, 1, 70})))
    assert result.exit_code == 0, result.output
    assert result.stdout.endswith("all equal; 3 more did not leave, as CanopyHealth has counted\n")


@pytest.mark.parametrize("identifier", COMMANDS)
def test_more_are_missing_than_were_counted(replay: Callable[..., Result], log: Log, identifier: int) -> None:
    places = places_of(log, identifier, {50, 51, 52, 99, 130})
    (found,) = differs(replay(drop(log, places, counted=3), "--json"), 99)
    assert (found["message"], found["what"], found["recorded"]) == (NAMES[identifier], "frame", "none")
    (found,) = differs(replay(drop(log, places, counted=0), "--json"), 50)


def test_what_is_counted_too_late_is_a_difference(replay: Callable[..., Result], log: Log) -> None:
    """CanopyHealth of the ticks 104 to 164 counts none of what is missing since tick 99."""
    left = drop(log, places_of(log, POWER_COMMAND, {99}))
    for place, message in enumerate(left):
        if is_count(message) and tick_of(left, place) <= 165:
            message.data[1:7] = bytes(6)
    differs(replay(left, "--json"), 99)


def test_a_command_that_the_recorder_lost_was_not_dropped(replay: Callable[..., Result], log: Log) -> None:
    """TxReplaced would cover it, but the counter of the next one shows that it was out."""
    left = drop(log, places_of(log, POWER_COMMAND, {40}))
    for place, message in enumerate(left):
        if is_count(message) and tick_of(left, place) >= 99:
            message.data[1] += 1
    del left[place_of(left, POWER_COMMAND, 99)]
    (found,) = differs(replay(left, "--json"), 100)
    assert (found["message"], found["what"]) == ("PowerCommand", "E2E_Counter")
    assert int(found["recorded"]) == (int(found["replayed"]) + 1) % 15


@pytest.mark.parametrize(("byte", "what"), [(0, "E2E_CRC"), (1, "E2E_Counter")])
def test_wrong_protection_is_a_difference(replay: Callable[..., Result], log: Log, byte: int, what: str) -> None:
    place = place_of(log, POSTURE_COMMAND, 117)
    flip(log[place], byte)
    (found,) = differs(replay(log, "--json"), 117)
    assert (found["message"], found["what"], found["frame"]) == ("PostureCommand", what, place + 1)


def test_a_changed_command_is_named_where_others_are_missing(replay: Callable[..., Result], log: Log) -> None:
    left = drop(log, places_of(log, POSTURE_COMMAND, {60, 61, 115, 119}))
    place = place_of(left, POSTURE_COMMAND, 117)
    left[place].data[2] = 0x7
    protect_again(left)
    found = differs(replay(left, "--json"), 117)
    assert ("PostureCommand", "Mode", place + 1) in [(one["message"], one["what"], one["frame"]) for one in found]


def test_health_and_model_may_be_dropped_too(replay: Callable[..., Result], log: Log) -> None:
    left = drop(log, places_of(log, HEALTH, {100}) | places_of(log, MODEL, {100}))
    assert is_equal(replay(left, "--json"))["dropped"] == 2
    left = drop(log, places_of(log, HEALTH, {100}), counted=0)
    (found,) = differs(replay(left, "--json"), 100)
    assert found["message"] == "CanopyHealth"


def test_changes_and_snapshots_may_be_dropped_too(replay: Callable[..., Result], log: Log) -> None:
    """What a replay needs is there. More than was counted is a gap."""
    change = next(i for i, m in enumerate(log) if m.arbitration_id == CHANGE and tick_of(log, i) > 110)
    places = places_of(log, SNAPSHOT, {50, 90, 130, 170}) | {change}
    data = is_equal(replay(drop(log, places), "--json"))
    assert (data["ticks"], data["dropped"]) == (TICKS, 5)
    refused(replay(drop(log, places, counted=2)), "1 trace frames are missing, or 1 more than 64", "--ticks 1")


@pytest.mark.parametrize("ticks", [1, 2, 4])
@pytest.mark.parametrize("first", [0, 80])
def test_commands_overtake_the_trace(replay: Callable[..., Result], log: Log, ticks: int, first: int) -> None:
    """On a loaded bus the trace waits, up to four periods, and commands of the next ticks leave first."""
    for replaced in (set(), {first}, {first + 1, first + ticks}):
        left = drop(log, places_of(log, POSTURE_COMMAND, replaced))
        start = next(i for i, m in enumerate(left) if m.arbitration_id == POWER_COMMAND and tick_of(left, i) == first)
        end = place_of(left, POWER_COMMAND, first + ticks + 1)
        commands = [message for message in left[start:end] if message.arbitration_id < TICK]
        trace = [message for message in left[start:end] if message.arbitration_id >= TICK]
        data = is_equal(replay(left[:start] + commands + trace + left[end:], "--json"))
        assert (data["ticks"], data["dropped"]) == (TICKS, len(replaced))
