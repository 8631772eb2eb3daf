# SPDX-License-Identifier: MIT
"""canopy replay: what is equal, and each way in which a log can be wrong, with its place named."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from integration import logs

TICKS = 220
BATTERY, POSTURE, POWER_COMMAND, POSTURE_COMMAND = 0x100, 0x110, 0x200, 0x210
TICK, INPUTS, ARRIVALS, SNAPSHOT, CHANGE, VALUE, HEALTH, MODEL = TRACE = range(0x600, 0x608)

Log = list[can.Message]


def model_file(build_dir: Path, name: str = "nao_home") -> Path:
    return build_dir / "examples" / "nao" / "generated" / name / f"{name}.model.json"


@pytest.fixture(scope="module")
def original(build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Log:
    return logs.make_log(build_dir, "nao_home", TICKS, tmp_path_factory.mktemp("log"))


@pytest.fixture
def log(original: Log) -> Log:
    """A copy to spoil."""
    return copy.deepcopy(original)


@pytest.fixture
def replay(build_dir: Path, tmp_path: Path) -> Callable[..., Result]:
    """Replays a log with nao_home."""

    def run(messages: Log, *options: str, file: str = "run.log", model: str = "nao_home", program: str = "") -> Result:
        path = logs.write_log(tmp_path / file, messages)
        command = ["replay", str(path), "--model", str(model_file(build_dir, model))]
        program = program or str(build_dir / "examples" / "nao" / "nao_home")
        return CliRunner().invoke(main, [*command, "--program", program, *options])

    return run


def tick_number(message: can.Message) -> int:
    """Of a CanopyTick."""
    return int.from_bytes(message.data[2:6], "little")


def place_of(log: Log, identifier: int, tick: int) -> int:
    """Where the frame of a tick is: for commands the one before its CanopyTick, else the one behind it."""
    at = next(i for i, m in enumerate(log) if m.arbitration_id == TICK and tick_number(m) == tick)
    if identifier in (POWER_COMMAND, POSTURE_COMMAND):
        return next(i for i in range(at, -1, -1) if log[i].arbitration_id == identifier)
    return next(i for i in range(at, len(log)) if log[i].arbitration_id == identifier)


def flip(message: can.Message, byte: int, bits: int = 1) -> None:
    data = bytearray(message.data)
    data[byte] ^= bits
    message.data = data


def refused(result: Result, *texts: str) -> None:
    assert result.exit_code == 1, (result.output, result.exception)
    assert result.stderr.startswith("canopy replay: ")
    for text in texts:
        assert text in result.stderr, result.stderr


def differs(result: Result, ticks: int) -> list[dict[str, Any]]:
    """The differences, of a result as JSON."""
    assert result.exit_code == 1, (result.output, result.exception)
    data = json.loads(result.stdout)
    assert (data["equal"], data["ticks"]) == (False, ticks), data
    found: list[dict[str, Any]] = data["differences"]
    assert found
    assert {difference["tick"] for difference in found} == {ticks}
    return found


# --- what is equal ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["nao_home", "nao_power"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_run_is_equal(build_dir: Path, tmp_path: Path, replay: Callable[..., Result], name: str, seed: int) -> None:
    messages = logs.make_log(build_dir, name, 400, tmp_path, seed)
    program = str(build_dir / "examples" / "nao" / name)
    result = replay(messages, "--json", model=name, program=program)
    assert result.exit_code == 0, (result.output, result.exception)
    data = json.loads(result.stdout)
    ids = [message.arbitration_id for message in messages]
    assert (data["equal"], data["ticks"], data["reordered"], data["differences"]) == (True, 400, 0, [])
    assert data["inputs"] == ids.count(BATTERY) + ids.count(POSTURE) - 100
    # All that it sent but the two safe commands at its end.
    assert data["frames"] == sum(ids.count(number) for number in (0x200, 0x210, *TRACE)) - 2
    assert ids.count(CHANGE) > 20
    assert (ids.count(HEALTH), ids.count(SNAPSHOT)) == (100, 20)
    assert ids.count(MODEL) >= 2 * 20
    rejected = next(m.data[1] for m in reversed(messages) if m.arbitration_id == HEALTH and m.data[0] & 15 == 0)
    assert rejected >= 10


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf"])
def test_every_format_is_read(replay: Callable[..., Result], log: Log, suffix: str) -> None:
    # What does not concern the controller is passed over.
    log.insert(5, can.Message(is_error_frame=True, timestamp=1000.0, channel="can0"))
    log.insert(90, logs.frame(0x7F0, b"abc"))
    log.insert(200, can.Message(arbitration_id=BATTERY, data=bytes(8), is_extended_id=True, channel="can0"))
    log.insert(300, logs.frame(TICK, is_remote_frame=True))
    for number, message in enumerate(log):
        message.timestamp = 1000.0 + number / 1000
        message.channel = 0 if suffix != ".log" else "can0"
    result = replay(log, file=f"run{suffix}")
    assert result.exit_code == 0, (result.output, result.exception)
    assert result.stdout.startswith(f"nao_home: {TICKS} ticks replayed, ")
    assert result.stdout.endswith("frames compared: all equal\n")


def test_what_the_clock_and_the_driver_count_is_not_compared(replay: Callable[..., Result], log: Log) -> None:
    for message in log:
        if message.arbitration_id == TICK:
            flip(message, 7, 0xC0)
        if message.arbitration_id == HEALTH:
            for byte in {0: (3, 4, 5, 6, 7), 4: (3, 4)}.get(message.data[0] & 15, range(1, 8)):
                flip(message, byte, 0x7F)
    assert replay(log).exit_code == 0


def test_a_log_may_end_anywhere(replay: Callable[..., Result], log: Log) -> None:
    for end in range(len(log) - 40, len(log)):
        result = replay(log[:end], "--json")
        assert result.exit_code == 0, (end, result.output)
        assert TICKS - 8 <= json.loads(result.stdout)["ticks"] <= TICKS


def test_several_runs(replay: Callable[..., Result], log: Log) -> None:
    twice = log[400:] + log + log[: len(log) - 200]  # of the first one only the end
    result = replay(twice)
    assert result.exit_code == 0, result.output
    assert "has 2 runs of the controller; this is the first, --run chooses" in result.stderr
    second = replay(twice, "--json", "--run", "2")
    data = json.loads(second.stdout)
    assert (second.exit_code, data["run"], data["runs"], data["equal"]) == (0, 2, 2, True)
    assert 100 < data["ticks"] < TICKS
    refused(replay(twice, "--run", "3"), "has 2 runs of the controller, and no run 3")


# --- what is not ------------------------------------------------------------------------------------------------------


def test_a_changed_command_is_named(replay: Callable[..., Result], log: Log) -> None:
    place = place_of(log, POSTURE_COMMAND, 117)
    was = log[place].data[2]
    flip(log[place], 2, 2)
    names = {0: "Stop", 1: "SitUp", 2: "StandUp", 3: "WalkHome"}
    found = differs(replay(log, "--json"), 117)
    expected = {
        "tick": 117,
        "message": "PostureCommand",
        "what": "Mode",
        "recorded": f"{names[was ^ 2]} ({was ^ 2})",
        "replayed": f"{names[was]} ({was})",
        "frame": place + 1,
    }
    assert found == [expected]
    told = replay(log)
    assert told.exit_code == 1
    text = f"nao_home: tick 117 (frame {place + 1} of the log): PostureCommand: Mode: recorded {names[was ^ 2]}"
    assert text in told.stdout
    assert "nao_home: 117 ticks are equal, then the replay differs\n" in told.stdout
    assert "if loop.ticks == 117" in told.stderr


def tick_before(log: Log, place: int) -> int:
    """Of a trace frame."""
    return tick_number(next(log[i] for i in range(place, -1, -1) if log[i].arbitration_id == TICK))


def test_a_changed_status_names_the_node(replay: Callable[..., Result], log: Log) -> None:
    place = next(i for i, m in enumerate(log) if m.arbitration_id == SNAPSHOT and tick_before(log, i) >= 60)
    flip(log[place], 4, 0x03)  # node 2
    (found,) = differs(replay(log, "--json"), tick_before(log, place))
    assert (found["message"], found["what"], found["frame"]) == ("CanopySnapshot", "node 2 'Sit to Stand'", place + 1)
    assert found["recorded"] != found["replayed"]


def test_a_changed_change_names_the_nodes(replay: Callable[..., Result], log: Log) -> None:
    place = next(i for i, m in enumerate(log) if m.arbitration_id == CHANGE and i > 400)
    tick = tick_before(log, place)
    node = log[place].data[3] >> 4
    log[place].data[1] = 5
    found = differs(replay(log, "--json"), tick)
    assert {f"node {node}", f"node {80 + node}"} <= {difference["what"].split(" '")[0] for difference in found}
    assert {difference["frame"] for difference in found} == {place + 1}


@pytest.mark.parametrize("byte", range(8))
@pytest.mark.parametrize(("identifier", "name"), [(BATTERY, "Battery"), (POSTURE, "Posture")])
def test_a_changed_sensor_frame_is_named(
    replay: Callable[..., Result], log: Log, identifier: int, name: str, byte: int
) -> None:
    place = place_of(log, identifier, 45)
    flip(log[place], byte, 0x10)
    result = replay(log)
    refused(result, "are not those that the controller has taken: their bytes or their order are others", "--ticks ")
    tick, first, last, cut = map(
        int, re.findall(r"tick (\d+).* frames (\d+) to (\d+) .*--ticks (\d+)", result.stderr)[0]
    )
    assert first <= place + 1 <= last
    assert 44 <= tick <= 47
    assert cut == tick
    before = replay(log, "--json", "--ticks", str(cut))
    assert (before.exit_code, json.loads(before.stdout)["ticks"]) == (0, cut)


@pytest.mark.parametrize("told", [False, True])
def test_frames_that_the_controller_never_had(replay: Callable[..., Result], log: Log, told: bool) -> None:
    """Where the bus was not as it should be, the controller cannot have heard all; else nothing explains it."""
    last = dict.fromkeys(range(-2, TICKS), 0)
    for message in log:
        if message.arbitration_id == TICK:
            tick = tick_number(message)
        elif message.arbitration_id == INPUTS:
            last[tick] = message.data[5] & 0x0F
    tick = next(
        tick
        for tick in range(110, TICKS)
        if (
            all(last[near] for near in (tick, tick + 1))
            if told
            else not any(last[tick - 2 + near] for near in range(5))
        )
        and not 160 <= tick < 176
    )
    place = place_of(log, BATTERY, tick)
    log[place:place] = [logs.frame(BATTERY, bytes([1, 2, 3, 4, 5, 6, 7, number])) for number in range(5)]
    if told:
        result = replay(log, "--json")
        data = json.loads(result.stdout)
        assert (data["equal"], data["ticks"], data["unheard"]) == (True, TICKS, 5)
        assert "; 5 never reached the controller" in replay(log).stdout
    else:
        refused(replay(log), "the controller has not taken 5 of the frames that the log has: its CAN driver lost them")


def test_frames_that_the_log_never_had(replay: Callable[..., Result], log: Log) -> None:
    for place in sorted((place_of(log, BATTERY, 120), place_of(log, POSTURE, 120)), reverse=True):
        del log[place]
    refused(replay(log), "the log lacks 2 of the frames that the controller has taken; --ticks 1")


def test_all_sensor_frames_of_the_end_are_missing(replay: Callable[..., Result], log: Log) -> None:
    end = place_of(log, BATTERY, 200)
    refused(
        replay(log[:end] + [m for m in log[end:] if m.arbitration_id not in (BATTERY, POSTURE)]),
        "the log ends before all frames that the controller has taken",
    )


def test_no_sensor_frames_at_all(replay: Callable[..., Result], log: Log) -> None:
    refused(
        replay([m for m in log if m.arbitration_id not in (BATTERY, POSTURE)]),
        "taken in its first ticks are not in the log; start the record before the controller",
    )


@pytest.mark.parametrize(
    ("identifier", "text"),
    [
        (TICK, "a CanopyTick is missing"),
        (SNAPSHOT, "1 trace frames are missing, or 1 more than 64"),
        (INPUTS, "CanopyInputs of tick 150 is missing"),
        (ARRIVALS, "CanopyArrivals of tick 150 is missing"),
    ],
)
def test_a_lost_trace_frame_is_a_gap(replay: Callable[..., Result], log: Log, identifier: int, text: str) -> None:
    place = place_of(log, identifier, 150)
    tick = tick_before(log, place)
    del log[place]
    result = replay(log)
    refused(result, "before frame ", text.replace("150", str(tick)), "--ticks 1")
    assert 0 <= int(re.findall(r"before frame (\d+)", result.stderr)[0]) - (place + 1) < 40
    cut = re.findall(r"--ticks (\d+)", result.stderr)[0]
    assert int(cut) == (149 if identifier == TICK else tick)
    assert replay(log, "--ticks", cut).exit_code == 0
    refused(replay(log, "--ticks", "180"), f"has {cut} ticks of this run, not 180: before frame ")


def test_whole_ticks_that_are_missing_are_a_gap(replay: Callable[..., Result], log: Log) -> None:
    """64 trace frames: the sequence numbers alone do not tell."""
    first = place_of(log, TICK, 40)
    numbered = [i for i in range(first, len(log)) if log[i].arbitration_id in (TICK, CHANGE, SNAPSHOT)]
    last = numbered[64]
    left = log[:first] + [m for m in log[first:last] if m.arbitration_id < TICK] + log[last:]
    refused(replay(left), "missing")


@pytest.mark.parametrize("identifier", [POWER_COMMAND, POSTURE_COMMAND])
def test_a_lost_command_is_named(replay: Callable[..., Result], log: Log, identifier: int) -> None:
    del log[place_of(log, identifier, 99)]
    name = {POWER_COMMAND: "PowerCommand", POSTURE_COMMAND: "PostureCommand"}[identifier]
    (found,) = differs(replay(log, "--json"), 99)
    assert (found["message"], found["what"], found["recorded"], found["frame"]) == (name, "frame", "none", None)


def test_a_command_that_somebody_else_sent_is_named(replay: Callable[..., Result], log: Log) -> None:
    place = place_of(log, POWER_COMMAND, 99)
    log.insert(place, logs.frame(POWER_COMMAND, b"\x01\x02\x03"))
    found = differs(replay(log, "--json"), 99)
    assert found[0]["message"] == "PowerCommand"
    assert found[0]["frame"] == place + 1


def test_a_log_that_begins_too_late(replay: Callable[..., Result], log: Log) -> None:
    refused(
        replay(log[400:]),
        " of the controller, in the middle of its run; a replay needs all since its first tick: start `canopy record` "
        "before the controller",
    )


def test_a_log_of_something_else(replay: Callable[..., Result]) -> None:
    refused(replay([logs.frame(0x123, b"abc")]), "has no CanopyTick frames of this controller")


def test_another_model(replay: Callable[..., Result], log: Log) -> None:
    result = replay(log, model="nao_power")
    refused(result, "nao_power.model.json: is not the model of the tree that the controller runs: that one has 4 nodes")
    assert "the file has 3 nodes" in result.stderr


def test_another_program(replay: Callable[..., Result], log: Log, build_dir: Path) -> None:
    found = differs(replay(log, "--json", program=str(build_dir / "examples" / "nao" / "nao_power")), 0)
    assert {"CanopyModel"} <= {difference["message"] for difference in found}


# --- files and programs that are not as they should be ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("program", "texts"),
    [
        ("/nothing/here", ["/nothing/here: cannot be run: No such file or directory; build it"]),
        ("/bin/false", ["/bin/false: ended with status 1 on the record: it said nothing; --keep keeps the record"]),
        ("/bin/true", ["/bin/true: has written no sent; it must know --replay and --sent"]),
    ],
)
def test_a_program_that_cannot_replay(replay: Callable[..., Result], log: Log, program: str, texts: list[str]) -> None:
    refused(replay(log, program=program), *texts)


def test_arguments_are_handed_on_and_the_record_is_kept(
    replay: Callable[..., Result], log: Log, build_dir: Path, tmp_path: Path
) -> None:
    keep = tmp_path / "kept"
    assert replay(log, "--keep", str(keep), "--", "--quiet").exit_code == 0
    refused(replay(log, "--", "--lock-step"), "status 2 on the record: See nao_home --help.")
    data = keep.read_bytes()
    assert data.startswith(logs.BEGIN + b"T")
    result = replay(log[: len(log) // 2], "--keep", str(tmp_path / "no" / "folder"))
    refused(result, "No such file or directory")


# python-can does not close a file that it refuses.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_log_that_cannot_be_read(build_dir: Path, tmp_path: Path) -> None:
    def run(path: Path) -> Result:
        command = ["replay", str(path), "--model", str(model_file(build_dir)), "--program", "x"]
        return CliRunner().invoke(main, command)

    refused(run(tmp_path / "none.log"), "none.log: cannot be read: No such file or directory")
    refused(run(tmp_path / "none.txt"), "none.txt: the suffix says the format, and must be one of .log, .asc, .blf")
    for name, content in (
        ("x.log", b"(1.0) can0 100#0102\nnonsense\n"),
        ("x.blf", b"nonsense"),
        ("y.log", b"\xff\xfe\x00"),
    ):
        (tmp_path / name).write_bytes(content)
        refused(run(tmp_path / name), f"{name}: is no .{name[2:]} log behind frame ")


def test_an_error_is_json_when_asked_for(replay: Callable[..., Result], log: Log) -> None:
    result = replay(log[400:], "--json")
    data = json.loads(result.stdout)
    assert (result.exit_code, data["equal"]) == (1, False)
    assert "in the middle of its run" in data["error"]
