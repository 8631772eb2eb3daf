# SPDX-License-Identifier: MIT
"""canopy bridge as a process: trace frames on a unixbus in, LCM messages out."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest

from canopy.canbus import open_bus
from canopy.lcm_link import DEFAULT_URL
from integration.lcm_netns import NO_ROUTE, LcmNetwork
from integration.trace_source import SLOTS, TEXTS, VALUES, Frame, TraceSource, to_message, write_model

PEER = str(Path(__file__).with_name("lcm_peer.py"))
TYPES = ["CANOPY_TREE=tree_status_t", "CANOPY_TREE_STRUCTURE=tree_structure_t"]
SPEC = "unixbus:bridge"


class Process:
    """A program with pipes, which ends with the context."""

    def __init__(self, command: list[str]) -> None:
        self.popen = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def line(self) -> str:
        assert self.popen.stdout is not None
        return self.popen.stdout.readline()

    def end(self, number: signal.Signals | None = signal.SIGTERM) -> tuple[str, str]:
        """Ends it with a signal (None: it ends by itself); gives stdout and stderr."""
        if number is not None:
            self.popen.send_signal(number)
        return self.popen.communicate(timeout=20)

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *_: object) -> None:
        if self.popen.poll() is None:
            self.popen.kill()
        self.popen.communicate()


def bridge_command(model: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "canopy", "bridge", "--model", str(model), "--can", SPEC, *options]


def wait_for_participants(bus_dir: Path, count: int) -> None:
    end = time.monotonic() + 20
    while len(list((bus_dir / "bridge").glob("*.sock"))) < count:
        assert time.monotonic() < end, "nobody came to the bus"
        time.sleep(0.02)


@pytest.fixture
def bus(bus_dir: Path) -> Iterator[can.BusABC]:
    with open_bus(SPEC) as opened:
        yield opened


def send(bus: can.BusABC, frames: list[Frame]) -> None:
    for frame in frames:
        bus.send(to_message(frame))


def test_each_tick_becomes_a_message_and_losses_are_said_once(tmp_path: Path, bus_dir: Path, bus: can.BusABC) -> None:
    model = write_model(tmp_path, values=VALUES, texts=TEXTS)
    source = TraceSource(4, SLOTS, snapshot_every=1, values_max=3)
    statuses = [[1, 3, 1, 0], [1, 3, 2, 1], [2, 9, 7, 2], [2, 9, 7, 2], [2, 9, 7, 3]]
    with LcmNetwork() as network:
        listen = [sys.executable, PEER, "listen", DEFAULT_URL, "60", *TYPES]
        with Process(network.command(listen)) as listener:
            assert json.loads(listener.line()) == {"listening": True}
            command = bridge_command(model, "--json", "--structure-period", "0.1")
            with Process(network.command(command)) as bridge:
                wait_for_participants(bus_dir, 2)
                send(bus, [source.health(0, 7, 6, 5, last=4), source.health(4, 3, 2, 1)])
                send(bus, [source.health(3, 0x21, 0, 0xF000, last=9)])
                for number, tick in enumerate(statuses):
                    frames = source.frames(tick, root=1 if number < 2 else 2, overruns=number, values=[number, 0, 1])
                    send(bus, frames if number not in (1, 3) else [*frames[:2], *frames[3:]])  # the snapshot is lost
                trees: list[dict[str, Any]] = []
                structures: list[dict[str, Any]] = []
                while len(trees) < len(statuses) or len(structures) < 2:
                    message = json.loads(listener.line())
                    (trees if message["channel"] == "CANOPY_TREE" else structures).append(message)
                summary, errors = bridge.end()
    assert bridge.popen.returncode == 0
    assert [tree["tick"] for tree in trees] == [0, 1, 2, 3, 4]
    # Of a tick with a loss nothing is certain: shown is what was told last. The next snapshot makes all certain again.
    assert [tree["code"] for tree in trees] == [statuses[number] for number in (0, 0, 2, 2, 4)]
    assert [tree["certain"] for tree in trees] == [[number not in (1, 3)] * 4 for number in range(5)]
    assert [tree["since"] for tree in trees][2:] == [[2] * 4, [-1] * 4, [4] * 4]
    assert [tree["since_exact"] for tree in trees] == [[True] * 4] + [[False] * 4] * 4
    assert [(tree["root_status"], tree["root"]) for tree in trees] == [(1, "RUNNING")] * 2 + [(2, "SUCCESS")] * 3
    assert [tree["running"] for tree in trees] == [["n2"], [], [], [], []]
    assert [tree["failed"] for tree in trees] == [["n1"], [], [], [], ["n3"]]
    assert [tree["complete"] for tree in trees] == [number not in (1, 3) for number in range(5)]
    assert {tree["bus"] for tree in trees} == {"error-active"}
    assert trees[-1]["value_name"][:3] == ["count", "arm/far", "warm"]
    assert [tree["value"][0] for tree in trees] == ["0", "1", "2", "3", "4"]
    assert trees[-1]["value"] == ["4", f"{2**32} mm", "0 °C", "none", "", "0", "0", "false"]
    assert trees[-1]["value_certain"] == [True] * 8
    assert [tree["overruns"] for tree in trees] == [0, 1, 2, 3, 4]
    assert [tree["trace_lost"] for tree in trees] == [0, 0, 1, 1, 2]  # the next CanopyTick shows it
    assert abs(trees[-1]["utime"] / 1e6 - time.time()) < 60
    fixed = {name: trees[-1][name] for name in ("application", "model_hash", "num_nodes")}
    assert fixed == {"application": "nao_home", "model_hash": "0123456789abcdef", "num_nodes": 4}
    counters = ("rx_rejected", "rx_unknown", "rx_lost", "rx_backlogs", "leaf_faults", "rx_errors", "timeouts", "slips")
    assert [trees[-1][name] for name in counters] == [7, 6, 5, 4, 3, 2, 1, 9]
    assert trees[-1]["lateness"] == [1, 2] + [0] * 9 + [15]
    assert [trees[-1][name] for name in ("tx_replaced", "longest_cycle", "can_state")] == [-1, -1, 0]
    assert trees[-1]["health"].startswith("7 refused, 6 unknown, 5 lost by the driver, 4 backlogs, ")
    structure = structures[-1]
    assert (structure["application"], structure["model_hash"]) == ("nao_home", "0123456789abcdef")
    assert (structure["tree_id"], structure["num_nodes"], structure["parent"]) == ("GetHome", 4, [-1, 0, 0, 0])
    assert structure["type"] == ["ReactiveFallback", "Look", "Look", "Look"]
    assert (structure["name"], structure["category"]) == (["Get home", "n1", "n2", "n3"], [0, 2, 2, 2])
    counted = json.loads(summary)
    assert (counted["ticks"], counted["incomplete"], counted["lost"], counted["refused"]) == (5, 2, 2, 0)
    assert counted["published"] >= 7
    assert errors.count("trace frames are lost on the way") == 1, errors


def test_silence_publishes_the_tick_at_hand(tmp_path: Path, bus_dir: Path, bus: can.BusABC) -> None:
    with LcmNetwork() as network:
        listen = [sys.executable, PEER, "listen", DEFAULT_URL, "60", TYPES[0]]
        with Process(network.command(listen)) as listener:
            listener.line()
            with Process(network.command(bridge_command(write_model(tmp_path)))) as bridge:
                wait_for_participants(bus_dir, 2)
                send(bus, TraceSource(4).frames([1, 0, 0, 0])[:1])
                message = json.loads(listener.line())
                summary, _ = bridge.end(signal.SIGINT)
    assert (message["tick"], message["code"], message["bus"]) == (0, [0] * 4, "unknown")
    assert message["certain"] == [False] * 4
    assert bridge.popen.returncode == 0
    assert "1 ticks seen (1 incomplete, 0 missed)" in summary


def test_without_lcm_it_counts_and_ends_by_itself(tmp_path: Path, bus_dir: Path, bus: can.BusABC) -> None:
    source = TraceSource(4)
    with Process([*NO_ROUTE, *bridge_command(write_model(tmp_path), "--duration", "1", "--json")]) as bridge:
        wait_for_participants(bus_dir, 2)
        send(bus, source.frames([1, 0, 0, 0]) + source.frames([2, 0, 0, 0]))
        # No trace frames: remote, error, other ids, garbage.
        bus.send(can.Message(arbitration_id=0x600, is_extended_id=False, is_remote_frame=True, dlc=8))
        bus.send(can.Message(arbitration_id=0x601, is_extended_id=False, data=b"123"))
        bus.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=b"123"))
        summary, errors = bridge.end(None)
    assert bridge.popen.returncode == 0
    counted = json.loads(summary)
    assert (counted["ticks"], counted["published"], counted["refused"], counted["lost"]) == (2, 0, 1, 0)
    assert errors.count("going on without LCM") == 1


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        ("bus0", "'bus0' is no CAN bus: write socketcan:INTERFACE, unixbus:NAME or unixbus:/a/folder"),
        ("socketcan:", "is no CAN bus"),
        ("socketcan:nothing0", "cannot open socketcan:nothing0"),
        ("unixbus:/nothing/here/bus", "cannot open unixbus:/nothing/here/bus"),
    ],
)
@pytest.mark.parametrize("tool", ["bridge", "monitor"])
def test_a_bus_that_is_not_there_is_one_line(tmp_path: Path, tool: str, spec: str, text: str) -> None:
    command = [sys.executable, "-m", "canopy", tool, "--model", str(write_model(tmp_path)), "--can", spec]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert done.returncode == 1
    assert done.stderr.startswith(f"canopy {tool}: ")
    assert text in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("tool", ["bridge", "monitor"])
def test_the_model_of_another_tree_is_one_line_with_a_way_out(
    tmp_path: Path, bus_dir: Path, bus: can.BusABC, tool: str
) -> None:
    source, model = TraceSource(4), write_model(tmp_path)
    command = [sys.executable, "-m", "canopy", tool, "--model", str(model), "--can", SPEC, "--duration", "2"]
    with Process([*NO_ROUTE, *command]) as watcher:
        wait_for_participants(bus_dir, 2)
        send(bus, [source.model(0x01234567, 4), *source.frames([1, 0, 0, 0]), source.model(0x01234567, 5)])
        _, errors = watcher.end(None)
    assert watcher.popen.returncode == 0  # anybody can send one: it is shown, and ends nothing
    line = next(line for line in errors.splitlines() if "is not the model" in line)
    assert line.startswith(
        f"canopy {tool}: {model}: is not the model of the tree that the controller runs: that one has "
    )
    assert "5 nodes and the hash 01234567…, the file has 4 nodes and 01234567…" in line
    assert "canopy image build --model" in line


@pytest.mark.parametrize("tool", ["bridge", "monitor"])
def test_a_model_that_is_not_there_is_one_line(tmp_path: Path, tool: str) -> None:
    command = [sys.executable, "-m", "canopy", tool, "--model", str(tmp_path / "x.json"), "--can", "unixbus:x"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert done.returncode == 1
    assert done.stderr.startswith(f"canopy {tool}: {tmp_path / 'x.json'}: cannot be read")
    assert done.stderr.count("\n") == 1
