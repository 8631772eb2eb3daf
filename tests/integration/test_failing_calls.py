# SPDX-License-Identifier: MIT
"""Every call of the operating system fails once: nothing latches, nothing goes unsaid, nothing is lost uncounted."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from canopy.unixbus import UnixBus
from integration import missions
from integration.can_probe import CanProbe
from integration.failing import Fault, exchange
from integration.sim_peers import DBC
from integration.trace_source import TraceSource, to_message, write_model

ERRORS = {
    "socket": (errno.EMFILE, errno.ENOMEM),
    "bind": (errno.ENOMEM, errno.ENOSPC),
    "connect": (errno.ENOMEM, errno.EACCES),
    "setsockopt": (errno.ENOMEM,),
    "send": (errno.ENOMEM, errno.ENOBUFS, errno.EAGAIN, errno.EINTR, errno.EIO, errno.ENETDOWN),
    "recvmsg": (errno.ENOMEM, errno.EINTR, errno.EAGAIN, errno.EIO, errno.ENOBUFS),
    "read": (errno.EINTR, errno.EIO),
    "write": (errno.EINTR, errno.EIO),
    "ppoll": (errno.EINTR, errno.ENOMEM),
    "eventfd": (errno.EMFILE,),
    "getrandom": (errno.EINTR,),
    "stat": (errno.ENOMEM, errno.EACCES, errno.EIO),
    "stat64": (errno.ENOMEM, errno.EACCES, errno.EIO),
    "lstat64": (errno.ENOMEM,),
    "mkdir": (errno.ENOSPC,),
    "chmod": (errno.EPERM,),
    "rename": (errno.EIO,),
    "opendir": (errno.EMFILE, errno.ENOMEM),
    "readdir": (errno.EIO,),
    "readdir64": (errno.EIO,),
    "pthread_create": (errno.EAGAIN,),
}
"""What the unixbus driver calls, and how it can fail."""

CALLS_MAX = 12
"""Later calls are like earlier ones."""

SAMPLE = int(os.environ.get("CANOPY_FAULTS", "60"))
"""How many of the faults are tried, chosen by CANOPY_SEED; 0: all."""


def all_faults() -> list[Fault]:
    return [
        Fault(call, number, at) for call, numbers in ERRORS.items() for number in numbers for at in range(1, CALLS_MAX)
    ]


def sampled(faults: list[Fault]) -> list[Fault]:
    if SAMPLE == 0 or len(faults) <= SAMPLE:
        return faults
    return random.Random(int(os.environ.get("CANOPY_SEED", "1"))).sample(faults, SAMPLE)


@pytest.mark.parametrize("fault", sampled(all_faults()), ids=str)
def test_a_call_of_the_c_driver_fails_once(
    bus_dir: Path, build_dir: Path, helper: Callable[[str], Path], fault: Fault
) -> None:
    environment = fault.environment(build_dir, bus_dir.name)
    with UnixBus("bus0") as peer:
        try:
            probe = CanProbe(helper("can_probe"), "unixbus:bus0", environment=environment)
        except RuntimeError as error:  # it cannot begin: it says why, and leaves nothing behind
            assert "CAN bus" in str(error)
            assert "(" in str(error)
            assert len(list((bus_dir / "bus0").iterdir())) == 1
            return
        with probe:
            at_peer, at_probe = exchange(probe, peer, 0x10)
            if probe.ask("state") != "0":
                probe.ask("restart")
            time.sleep(0.02)
            probe.ask("drain")  # what came late
            while peer.recv(0.02):
                at_peer -= 1
            assert exchange(probe, peer, 0x20) == (0, 0)
            stats = probe.stats()
            assert at_peer <= stats["tx_dropped"]
            assert at_probe <= stats["rx_dropped"] + peer.counters["tx_dropped"]
    assert list((bus_dir / "bus0").iterdir()) == []


def test_the_faults_reach_the_calls(bus_dir: Path, build_dir: Path, helper: Callable[[str], Path]) -> None:
    """Else the test above would prove nothing: each function of the list is called, or its twin is."""
    called = set()
    for call in ERRORS:
        count = bus_dir / f"count-{call}"
        environment = Fault(call, errno.EIO, 0).environment(build_dir, bus_dir.name, count)
        with (
            UnixBus("bus0") as peer,
            CanProbe(helper("can_probe"), "unixbus:bus0", environment=environment) as probe,
        ):
            assert exchange(probe, peer, 0x10) == (0, 0)
        if count.exists():
            called.add(call.removesuffix("64"))
    assert called == {call.removesuffix("64") for call in ERRORS}


def test_one_error_does_not_make_a_controller_deaf(bus_dir: Path, build_dir: Path) -> None:
    fault = Fault("recvmsg", errno.ENOMEM, 40, 3)
    bus = f"unixbus:{bus_dir}/bus0"
    with missions.Observer(build_dir, "nao_home", bus) as observer:
        controller = subprocess.Popen(
            [str(build_dir / "examples" / "nao" / "nao_home"), "--can", bus],
            env=fault.environment(build_dir, bus_dir.name),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        simulator = subprocess.Popen(
            [sys.executable, "-m", "canopy_sim", "--can", bus, "--dbc", str(DBC), "--no-lcm"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            observer.wait_for(lambda: observer.modes["PostureCommand"][-1:] not in ([], ["Stop"]), 60)
            ticks = len(observer.views)
            observer.wait_for_ticks(ticks + 60, stall=60)  # well past the error, and the timeouts behind it
            assert observer.modes["PostureCommand"][-1] != "Stop"
        finally:
            simulator.send_signal(signal.SIGINT)
            controller.send_signal(signal.SIGINT)
            out, err = controller.communicate(timeout=60)
            simulator.wait(60)
    assert controller.returncode == 0, (out, err)


TOOL_FAULTS = [
    *(Fault("recv", number, at) for number in (errno.ENOMEM, errno.EIO, errno.EINTR) for at in (1, 4)),
    Fault("recv", errno.ENOMEM, 2, 20),
    Fault("poll", errno.ENOMEM),
    Fault("bind", errno.ENOMEM),
    Fault("socket", errno.EMFILE),
    Fault("connect", errno.ENOMEM, 2),
]


def run_tool(
    command: list[str], environment: dict[str, str], bus_dir: Path
) -> tuple[subprocess.CompletedProcess[str], int]:
    """Runs a tool while 12 ticks are on the bus; gives its end, and how many frames were sent."""
    source = TraceSource(4)
    sent = 0
    with UnixBus("bus0") as bus:
        process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 30
        while process.poll() is None and len(list((bus_dir / "bus0").glob("*.sock"))) < 2:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        for number in range(12):
            for message in source.frames([1, 3, 1, number % 2]):
                bus.send(to_message(message))
                sent += 1
            time.sleep(0.03)
        time.sleep(0.3)
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    return subprocess.CompletedProcess(command, process.returncode, out, err), sent


@pytest.mark.parametrize("fault", TOOL_FAULTS, ids=str)
@pytest.mark.parametrize("name", ["record", "monitor", "bridge"])
def test_a_call_of_a_tool_fails_once(bus_dir: Path, build_dir: Path, tmp_path: Path, name: str, fault: Fault) -> None:
    model = str(write_model(tmp_path))
    options = {
        "record": ["-o", str(tmp_path / "run.log"), "--json"],
        "monitor": ["--model", model, "--json", "--period", "0"],
        "bridge": ["--model", model, "--lcm-url", "memq://", "--json"],
    }[name]
    command = [sys.executable, "-m", "canopy", name, "--can", "unixbus:bus0", *options]
    done, sent = run_tool(command, fault.environment(build_dir, bus_dir.name), bus_dir)
    assert "Traceback" not in done.stderr
    if done.returncode != 0:
        assert done.returncode == 1
        assert f"canopy {name}: cannot open unixbus:bus0" in done.stderr
        assert os.strerror(fault.number) in done.stderr
        return
    if name == "record":
        data = json.loads(done.stdout)
        assert data["frames"] + data["lost"] >= sent or data["outages"] > 0
    elif name == "bridge":
        assert json.loads(done.stdout)["ticks"] >= 10
    else:
        assert json.loads(done.stdout.splitlines()[-1])["tick"] == 11


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("at", [1, 2])
@pytest.mark.parametrize("suffix", [".log", ".blf"])
def test_a_log_that_cannot_be_written_is_said(
    bus_dir: Path, build_dir: Path, tmp_path: Path, suffix: str, number: int, at: int
) -> None:
    log = tmp_path / f"run{suffix}"
    command = [sys.executable, "-m", "canopy", "record", "--can", "unixbus:bus0", "-o", str(log)]
    environment = Fault("write", number, at, 1000).environment(build_dir, log.name)
    done, _ = run_tool(command, environment, bus_dir)
    assert "Traceback" not in done.stderr
    if done.returncode != 0:
        assert done.returncode == 3
        assert os.strerror(number) in done.stderr.splitlines()[-1]
    else:
        assert at > 1  # so little is written at once


@pytest.mark.parametrize("fault", [Fault("sendmsg", errno.ENOBUFS, 2), Fault("sendmsg", errno.ENETDOWN, 1, 5)], ids=str)
def test_lcm_that_fails_is_counted_and_comes_back(bus_dir: Path, build_dir: Path, tmp_path: Path, fault: Fault) -> None:
    model = str(write_model(tmp_path))
    environment = fault.environment(build_dir, bus_dir.name)
    inside = [f"{name}={value}" for name, value in environment.items() if name.startswith(("FAIL_", "LD_", "ASAN_"))]
    network = "ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo; exec env"  # of which no call fails
    enter = ["unshare", "--net", "sh", "-c", f'{network} "$@"', "-", *inside]
    command = [sys.executable, "-m", "canopy", "bridge", "--model", model, "--can", "unixbus:bus0", "--json"]
    done, _ = run_tool([*enter, *command], dict(os.environ), bus_dir)
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    assert 1 <= data["publish_failed"] <= fault.times
    assert data["published"] >= 10 - fault.times
    assert done.stderr.count("cannot publish") == 1
