# SPDX-License-Identifier: MIT
"""Tools on a unixbus that is not there, goes away, is made anew, is full, or belongs to somebody else."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from multiprocessing.queues import Queue
from pathlib import Path

import can
import pytest
from click.testing import CliRunner

from canopy.can_bus.folder import PARTICIPANTS_MAX
from canopy.can_bus.steady import Gap, SteadyBus
from canopy.canbus import open_bus
from canopy.cli import main
from canopy.process.say import AT_ONCE, Voice
from canopy.record import Recorder, open_log
from canopy.unixbus import UnixBus
from integration.trace_source import write_model

USERS = (54321, 54322)
GROUP = 54300


def frame(identifier: int = 0x123) -> can.Message:
    return can.Message(arbitration_id=identifier, is_extended_id=False, data=b"\x01")


def tool(name: str, bus: str, *options: str) -> list[str]:
    return [sys.executable, "-m", "canopy", name, "--can", bus, *options]


def tools(tmp_path: Path, bus: str) -> dict[str, list[str]]:
    model = str(write_model(tmp_path))
    return {
        "monitor": tool("monitor", bus, "--model", model, "--json"),
        "bridge": tool("bridge", bus, "--model", model, "--lcm-url", "memq://"),
        "record": tool("record", bus, "-o", str(tmp_path / "run.log")),
    }


# --- a bus that is not there ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["monitor", "bridge", "record"])
def test_a_listener_makes_no_bus_by_a_typing_error(bus_dir: Path, tmp_path: Path, name: str) -> None:
    with UnixBus("robot"), UnixBus("arm"):
        command = tools(tmp_path, "unixbus:robto")[name]
        done = subprocess.run([*command, "--duration", "0.5"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert sorted(path.name for path in bus_dir.iterdir()) == ["arm", "robot"]
    assert f"there is no bus 'robto'; the buses in {bus_dir} are: arm, robot" in done.stderr
    assert f"canopy {name}: nothing came on unixbus:robto; `canopy buses` lists the buses" in done.stderr


def test_a_listener_joins_a_bus_that_is_made_later(bus_dir: Path) -> None:
    with SteadyBus("unixbus:late", Voice("test")) as listener:
        assert listener.recv(0.05) is None
        assert listener.is_away
        with UnixBus("late") as sender:
            deadline = time.monotonic() + 20
            received = None
            while received is None and time.monotonic() < deadline:
                sender.send(frame())
                received = listener.recv(0.05)
        assert received is not None
        assert (listener.heard, listener.outages) == (1, 0)


def test_record_makes_the_bus_where_it_is_told_to(bus_dir: Path, tmp_path: Path) -> None:
    command = tool("record", "unixbus:new", "-o", str(tmp_path / "run.log"), "--create", "--duration", "0.3")
    assert subprocess.run(command, capture_output=True, timeout=60, check=False).returncode == 1  # nothing came
    assert (bus_dir / "new").is_dir()


def test_buses_are_listed_with_who_takes_part(bus_dir: Path) -> None:
    with UnixBus("robot") as living:
        dead = bus_dir / "robot" / "1-00c0ffee.sock"
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.bind(str(dead))
        result = CliRunner().invoke(main, ["buses", "--json"])
        found = {bus["name"]: bus for bus in map(json.loads, result.stdout.splitlines())}
        assert found["unixbus:robot"]["participants"] == 1
        assert found["unixbus:robot"]["processes"] == [os.getpid()]
        assert not dead.exists()
        assert "unixbus:robot  1 of at most 320 participants" in CliRunner().invoke(main, ["buses"]).stdout
        living.send(frame())  # nobody has deleted its own socket


def test_no_bus_at_all_is_status_1(bus_dir: Path) -> None:
    result = CliRunner().invoke(main, ["buses"])
    if result.exit_code == 0:  # a machine with CAN interfaces
        assert "unixbus:" not in result.stdout
    else:
        assert (result.exit_code, result.stdout) == (1, "")
        assert f"{bus_dir} holds no unixbus" in result.stderr


# --- a bus that goes away ---------------------------------------------------------------------------------------------


def test_a_listener_is_not_deaf_after_its_bus_was_made_anew(bus_dir: Path) -> None:
    gaps: list[Gap] = []
    with UnixBus("bus0"), SteadyBus("unixbus:bus0", Voice("test")) as listener:
        listener.on_gap = gaps.append
        shutil.rmtree(bus_dir / "bus0")
        with pytest.raises(can.CanOperationError):  # as soon as somebody looks
            listener.send(frame())
        with UnixBus("bus0") as again:
            deadline = time.monotonic() + 20
            while listener.recv(0.05) is None:
                assert time.monotonic() < deadline
                again.send(frame())
    assert listener.outages == len(gaps) == 1
    assert "somebody deleted" in gaps[0].why or "No such file" in gaps[0].why


def test_python_cans_own_bus_tells_that_it_is_deaf(bus_dir: Path) -> None:
    with UnixBus("bus0") as bus:
        shutil.rmtree(bus_dir / "bus0")
        with pytest.raises(can.CanOperationError, match="open it anew"):
            bus.recv(5)


@pytest.mark.parametrize("name", ["monitor", "bridge", "record"])
def test_a_tool_goes_on_on_a_bus_that_was_made_anew(bus_dir: Path, tmp_path: Path, name: str) -> None:
    sender = UnixBus("bus0")
    process = subprocess.Popen(
        tools(tmp_path, "unixbus:bus0")[name], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    _wait_for_participants(bus_dir / "bus0", 2)
    sender.send(frame())
    shutil.rmtree(bus_dir / "bus0")
    sender.shutdown()
    with UnixBus("bus0") as sender:
        _wait_for_participants(bus_dir / "bus0", 2)
        sender.send(frame())
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 0, err
    assert err.count("waiting for it") == err.count("is there after") == 1


def _wait_for_participants(folder: Path, count: int) -> None:
    deadline = time.monotonic() + 30
    while len(list(folder.glob("*.sock"))) < count:
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf"])
def test_a_gap_is_marked_in_every_format(tmp_path: Path, suffix: str) -> None:
    log = tmp_path / f"run{suffix}"
    with open_log(log, force=False) as writer:
        recorder = Recorder(writer, log, "bus0", None, Voice("test"))
        for number in range(3):
            message = frame(0x100 + number)
            message.timestamp = 1000.0 + number
            recorder.take(message)
        recorder.mark(Gap(1002.5, 1.25, "is göne"))
        message = frame(0x200)
        message.timestamp = 1004.0
        recorder.take(message)
    assert (recorder.summary.frames, recorder.summary.away_s) == (4, 1.25)
    with can.LogReader(log) as reader:
        read = list(reader)
    assert [message.is_error_frame for message in read] == [False, False, False, True, False]
    assert [message.arbitration_id for message in read if not message.is_error_frame] == [0x100, 0x101, 0x102, 0x200]
    assert read[3].timestamp - read[0].timestamp == pytest.approx(3.75, abs=0.01)
    if suffix == ".log":
        assert "#47415000E2040000" in log.read_text()
    elif suffix == ".asc":
        assert "bus0 gap of 1.250 s" in log.read_text()


# --- a bus that is full, and one of somebody else ---------------------------------------------------------------------


def test_a_full_bus_is_said_with_the_way_out(bus_dir: Path) -> None:
    folder = bus_dir / "bus0"
    folder.mkdir()
    sockets = []
    for number in range(PARTICIPANTS_MAX):
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        sock.bind(str(folder / f"{number}-00c0ffee.sock"))
        sockets.append(sock)
    try:
        with pytest.raises(can.CanInitializationError, match=r"has 320 participants.*canopy buses"):
            UnixBus("bus0")
        assert len(list(folder.iterdir())) == PARTICIPANTS_MAX
        sockets[5].close()  # dies
        UnixBus("bus0").shutdown()
    finally:
        for sock in sockets:
            sock.close()


def as_user(user: int, work: Callable[[str, Queue[str]], None], folder: Path) -> tuple[BaseProcess, Queue[str]]:
    """Runs a function as somebody else, who is in the group GROUP; gives the process, and what it has put."""
    context = multiprocessing.get_context("fork")  # the interpreter may lie where others cannot read it
    said: Queue[str] = context.Queue()

    def become_and_work() -> None:
        os.umask(0o022)
        os.setgroups([GROUP])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
        work(str(folder), said)

    process = context.Process(target=become_and_work)
    process.start()
    return process, said


def call_until_answered(folder: str, said: Queue[str]) -> None:
    with UnixBus(folder) as bus:
        end = time.monotonic() + 30
        while time.monotonic() < end:
            bus.send(frame(0x123))
            message = bus.recv(0.05)
            if message is not None and message.arbitration_id == 0x321:
                said.put("answered")
                return


def answer(folder: str, said: Queue[str]) -> None:
    try:
        with UnixBus(folder, create=False) as bus:
            assert bus.recv(20) is not None
            for _ in range(20):
                bus.send(frame(0x321))
                time.sleep(0.02)
            said.put("has answered")
    except can.CanInitializationError as error:
        said.put(str(error))


two_users = pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")


@two_users
def test_a_shared_folder_joins_two_users(bus_dir: Path) -> None:
    bus_dir.chmod(0o755)
    folder = bus_dir / "shared"
    folder.mkdir()
    os.chown(folder, 0, GROUP)
    folder.chmod(0o2770)
    first, heard = as_user(USERS[0], call_until_answered, folder)
    _wait_for_participants(folder, 1)
    sock = next(folder.glob("*.sock")).stat()
    assert (stat.S_IMODE(sock.st_mode), sock.st_uid, sock.st_gid) == (0o660, USERS[0], GROUP)
    second, said = as_user(USERS[1], answer, folder)
    assert said.get(timeout=60) == "has answered"
    assert heard.get(timeout=60) == "answered"
    for process in (first, second):
        process.join(30)
        assert process.exitcode == 0
    assert list(folder.iterdir()) == []


@two_users
def test_a_bus_of_ones_own_is_closed_to_others(bus_dir: Path) -> None:
    bus_dir.chmod(0o755)
    folder = bus_dir / "own"
    folder.mkdir()
    os.chown(folder, USERS[0], USERS[0])
    folder.chmod(0o700)
    first, _ = as_user(USERS[0], call_until_answered, folder)
    _wait_for_participants(folder, 1)
    second, said = as_user(USERS[1], answer, folder)
    assert "Permission denied" in said.get(timeout=60)
    first.kill()
    for process in (first, second):
        process.join(30)


# --- what is said -----------------------------------------------------------------------------------------------------


def test_a_flood_of_one_kind_is_counted_not_printed(capsys: pytest.CaptureFixture[str]) -> None:
    voice = Voice("tool")
    for number in range(10_000):
        voice.say(f"bad thing {number}", "bad")
    voice.say("something else")
    voice.end()
    voice.end()
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        *(f"tool: bad thing {number}" for number in range(AT_ONCE)),
        "tool: something else",
        f"tool: {10_000 - AT_ONCE} further lines like these were counted, not printed",
    ]


def test_kinds_that_others_choose_do_not_grow_without_end(capsys: pytest.CaptureFixture[str]) -> None:
    voice = Voice("tool")
    for number in range(10_000):
        voice.say(f"bad thing {number}")
    assert len(capsys.readouterr().err.splitlines()) < 100
    assert len(voice._kinds) < 100


def test_the_counters_of_all_times_are_summed(bus_dir: Path) -> None:
    with open_bus("unixbus:bus0"), SteadyBus("unixbus:bus0", Voice("test"), create=True) as bus:
        bus.send(frame())
        shutil.rmtree(bus_dir / "bus0")
        with pytest.raises(can.CanOperationError):
            bus.send(frame())
        deadline = time.monotonic() + 10
        while bus.is_away:
            assert time.monotonic() < deadline
            bus.recv(0.05)
        bus.send(frame())
        assert bus.counters["sent"] == 2
        assert bus.counters["outages"] == 1
