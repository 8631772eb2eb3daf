# SPDX-License-Identifier: MIT
"""Whoever sends on the bus or on LCM, or hands over a file: no tool ends, hangs, grows, or floods its stderr."""

from __future__ import annotations

import gc
import json
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.model import ModelError, load_model
from canopy.signals import SignalTable
from canopy.trace import TraceDecoder
from canopy.unixbus import FD_LENGTHS, UnixBus
from canopy.watch import Watch
from integration import logs
from integration.lcm_netns import LcmNetwork
from integration.sim_peers import DBC
from integration.trace_source import TraceSource, model_data, to_message, write_model

TRACE_IDS = range(0x600, 0x60A)
LINES_MAX = 60
"""Of stderr, of a tool that runs for some seconds."""
GROWTH_KB = 40_000


def any_frame(chance: random.Random) -> can.Message:
    """A frame of any kind, every second one with an id that the tools look at."""
    kind = chance.random()
    if kind < 0.05:
        return can.Message(is_error_frame=True, arbitration_id=chance.getrandbits(9), dlc=8, data=chance.randbytes(8))
    if kind < 0.1:
        return can.Message(arbitration_id=chance.getrandbits(29), data=chance.randbytes(chance.randrange(9)))
    if kind < 0.15:
        length = chance.choice(sorted(FD_LENGTHS))
        identifier = chance.randrange(0x800)
        data = chance.randbytes(length)
        return can.Message(arbitration_id=identifier, is_extended_id=False, is_fd=True, data=data)
    if kind < 0.2:
        identifier = chance.randrange(0x800)
        return can.Message(arbitration_id=identifier, is_extended_id=False, is_remote_frame=True, dlc=8)
    known = [*TRACE_IDS, 0x100, 0x110, 0x200, 0x210]
    identifier = chance.choice(known) if kind < 0.6 else chance.randrange(0x800)
    data = chance.randbytes(8 if kind < 0.5 else chance.randrange(9))
    return can.Message(arbitration_id=identifier, is_extended_id=False, data=data)


@contextmanager
def noise(name: str, seed: int) -> Iterator[Callable[[], int]]:
    """Some 2,000 hostile frames a second, as long as the context lasts; the function says how many there were."""
    stop, sent = threading.Event(), 0

    def run() -> None:
        nonlocal sent
        chance = random.Random(seed)
        with UnixBus(name) as bus:
            while not stop.wait(0.01):
                for _ in range(20):
                    bus.send(any_frame(chance))
                    sent += 1

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield lambda: sent
    finally:
        stop.set()
        thread.join()


def resident_kb(pid: int) -> int:
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0])


def endure(process: subprocess.Popen[str], seconds: float) -> tuple[str, str]:
    """Lets a program live through it, and ends it as Ctrl-C does; gives what it wrote."""
    time.sleep(seconds / 2)
    assert process.poll() is None
    before = resident_kb(process.pid)
    time.sleep(seconds / 2)
    assert process.poll() is None
    assert resident_kb(process.pid) - before < GROWTH_KB
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0, err
    assert "Traceback" not in err
    assert err.count("\n") < LINES_MAX, err[:3000]
    return out, err


def start(*command: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("name", ["monitor", "bridge", "record", "sim"])
def test_a_tool_lives_through_any_frames(bus_dir: Path, tmp_path: Path, name: str) -> None:
    model = ["--model", str(write_model(tmp_path))]
    command = {
        "monitor": ["canopy", "monitor", *model, "--json", "--period", "0.5"],
        "bridge": ["canopy", "bridge", *model, "--lcm-url", "memq://", "--json"],
        "record": ["canopy", "record", *model, "-o", str(tmp_path / "run.blf"), "--json"],
        "sim": ["canopy_sim", "--dbc", str(DBC), "--no-lcm", "--json"],
    }[name]
    with noise("bus0", 7) as sent:
        process = start(*command, "--can", "unixbus:bus0")
        deadline = time.monotonic() + 60
        while len(list((bus_dir / "bus0").glob(f"{process.pid}-*.sock"))) < 1:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        out, _ = endure(process, 4)
        assert sent() > 3000
    last = json.loads(out.splitlines()[-1])
    if name == "record":
        assert last["frames"] > 1000
    if name == "monitor":
        assert last["refused"] > 50


@pytest.mark.parametrize("name", ["monitor", "bridge", "record"])
def test_one_forged_model_frame_ends_no_tool(bus_dir: Path, tmp_path: Path, name: str) -> None:
    source = TraceSource(4)
    model = str(write_model(tmp_path))
    options = {
        "monitor": ["--model", model, "--json", "--period", "0"],
        "bridge": ["--model", model, "--lcm-url", "memq://", "--json"],
        "record": ["--model", model, "-o", str(tmp_path / "run.log"), "--json"],
    }[name]
    with UnixBus("bus0") as bus:
        process = start("canopy", name, "--can", "unixbus:bus0", *options)
        deadline = time.monotonic() + 30
        while len(list((bus_dir / "bus0").glob("*.sock"))) < 2:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        for number in range(20):
            if number % 4 == 2:
                bus.send(to_message(source.model(0xDEADBEEF, 4)))
            if number % 4 == 3:  # the controller's own
                bus.send(to_message(source.model(0x01234567, 4)))
            for frame in source.frames([1, 3, 1, number % 2]):
                bus.send(to_message(frame))
            time.sleep(0.02)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 0, err
    assert "is not the model of the tree that the controller runs" in err
    assert err.count("is not the model") <= 4
    last: dict[str, Any] = json.loads(out.splitlines()[-1])
    if name == "monitor":
        assert (last["tick"], last["disagreement"]) == (19, None)
    else:
        assert last["ticks"] == 20


def test_decoder_and_watch_take_any_bytes_and_do_not_grow(tmp_path: Path) -> None:
    model = load_model(write_model(tmp_path))
    chance = random.Random(11)
    decoder, watch, table = TraceDecoder(model), Watch(model), SignalTable(model)
    for number in range(60_000):
        identifier = chance.choice(TRACE_IDS)
        data = chance.randbytes(chance.choice((8, 8, 8, chance.randrange(65))))
        decoder.feed(identifier, data)
        watch.feed(identifier, data, number * 1e-4)
        table.feed(chance.choice((0x100, 0x110, 0x200, 0x210)), data, number * 1e-4)
    json.dumps(watch.snapshot(6.0))
    assert len(watch._ticks) < 25_000  # two seconds of them


def test_lcm_packets_by_the_hundred_thousand_do_not_end_the_robot(bus_dir: Path) -> None:
    code = """
import random, socket, sys
import lcm
chance = random.Random(3)
raw = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
raw.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
link = lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
for number in range(100_000):
    kind = number % 4
    if kind == 0:
        raw.sendto(chance.randbytes(chance.randrange(200)), ("239.255.76.67", 7667))
    elif kind == 1:
        raw.sendto(b"LC02" + chance.randbytes(chance.randrange(80)), ("239.255.76.67", 7667))
    elif kind == 2:
        raw.sendto(b"LC03" + chance.randbytes(chance.randrange(80)), ("239.255.76.67", 7667))
    else:
        link.publish("CANOPY_ROBOT_COMMAND", chance.randbytes(chance.randrange(80)))
"""
    with LcmNetwork() as network:
        command = [sys.executable, "-m", "canopy_sim", "--can", "unixbus:bus0", "--dbc", str(DBC), "--json"]
        process = subprocess.Popen(network.command(command), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 30
        while not list(bus_dir.glob("bus0/*.sock")):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(1)
        subprocess.run(network.command([sys.executable, "-c", code]), check=True, timeout=60)
        out, _ = endure(process, 1)
    lcm = json.loads(out)["lcm"]
    assert lcm["commands"] == 0
    assert lcm["refused"] > 3


# --- files ------------------------------------------------------------------------------------------------------------


def damaged(value: Any, chance: random.Random) -> Any:
    """The same JSON with one thing wrong in it."""
    junk: list[Any] = [
        None,
        True,
        -1,
        2**70,
        1e308,
        "",
        "\x1b[2J",
        "x" * 10_000,
        [],
        {},
        [[[[]]]],
        {"a": {}},
        float("nan"),
    ]
    if isinstance(value, dict) and value and chance.random() < 0.85:
        key = chance.choice(sorted(value))
        if chance.random() < 0.2:
            return {name: item for name, item in value.items() if name != key}
        return {**value, key: damaged(value[key], chance)}
    if isinstance(value, list) and value and chance.random() < 0.85:
        place = chance.randrange(len(value))
        return [*value[:place], damaged(value[place], chance), *value[place + chance.randrange(2) :]]
    return chance.choice(junk)


def test_a_hostile_model_file_is_an_error_in_words(tmp_path: Path) -> None:
    path = write_model(tmp_path)
    good = model_data(4)
    chance = random.Random(5)
    refused = 0
    for _ in range(3000):
        path.write_text(json.dumps(damaged(good, chance)))
        try:
            model = load_model(path)
            watch = Watch(model)
            for frame in TraceSource(4).frames([1, 2, 3, 0]):
                watch.feed(*frame, 1.0)
            json.dumps(watch.snapshot(2.0))
        except ModelError as error:
            refused += 1
            assert len(str(error)) < 1100, str(error)[:1100]
    assert refused > 2000


@pytest.mark.parametrize("text", ["", "[" * 100_000, '{"format":' + "9" * 10_000 + "}", "\x00\xff", '"' + "a" * 10**6])
def test_a_model_file_that_is_no_model_is_one_line(bus_dir: Path, tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.model.json"
    path.write_bytes(text.encode("latin-1"))
    result = CliRunner().invoke(main, ["monitor", "--model", str(path), "--can", "unixbus:bus0", "--duration", "0.1"])
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    assert len(result.stderr) < 1000


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # python-can leaves a .blf that it refuses open
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf"])
def test_a_log_that_is_cut_anywhere_is_no_traceback(build_dir: Path, tmp_path: Path, suffix: str) -> None:
    whole = tmp_path / f"whole{suffix}"
    source = TraceSource(4)
    with can.Logger(whole) as writer:
        for number in range(30):
            for place, frame in enumerate(source.frames([1, 3, 1, number % 2])):
                message = to_message(frame)
                message.timestamp = 1000.0 + 0.05 * number + 0.001 * place
                message.channel = "can0"
                writer.on_message_received(message)
    data = whole.read_bytes()
    cut = tmp_path / f"cut{suffix}"
    model = write_model(tmp_path)
    chance = random.Random(9)
    places = sorted({0, 1, len(data) - 1, *(chance.randrange(len(data)) for _ in range(40))})
    for place in places:
        for damage in (data[:place], data[:place] + chance.randbytes(20) + data[place + 20 :]):
            cut.write_bytes(damage)
            result = CliRunner().invoke(main, ["replay", str(cut), "--model", str(model), "--program", "/bin/true"])
            assert result.exit_code in (1, 2), result.output
            assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
            assert result.stderr.count("\n") <= 2
            assert len(result.stderr) < 2000
    gc.collect()


def test_logs_are_read_the_same_with_a_gap_in_them(tmp_path: Path) -> None:
    """The error frame that marks a gap disturbs no reader."""
    path = tmp_path / "gap.log"
    message = can.Message(is_error_frame=True, is_extended_id=False, dlc=8, data=b"GAP\0" + bytes(4))
    logs.write_log(path, logs.stamped([logs.frame(0x100, b"\x01"), message, logs.frame(0x101, b"\x02")]))
    with can.LogReader(path) as reader:
        assert [frame.is_error_frame for frame in reader] == [False, True, False]
