# SPDX-License-Identifier: MIT
"""The socketcan driver on vcan0, with can-utils and python-can as foreign peers. Runs inside tests/rig/with-vcan."""

from __future__ import annotations

import re
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest

from integration.can_probe import CanProbe

SPEC = "socketcan:vcan0"
ERROR_BUS_DOWN = "-3"
ERROR_UNSUPPORTED = -5
ERROR_ARGUMENT = -1
FRAMES = [
    "123#1122",
    "7FF#",
    "1FFFFFFF#0102030405060708",
    "00000123#AA",
    "321#R5",
    "100##0" + 12 * "5A",
    "18DAF110##3" + 64 * "A5",
]


def run(*command: str) -> None:
    subprocess.run(command, check=True)


@pytest.fixture(autouse=True)
def vcan0() -> Iterator[None]:
    """The interface is up, carries CAN FD, and has no queue of its own, before and after each test."""

    def reset() -> None:
        run("ip", "link", "set", "vcan0", "down")
        run("ip", "link", "set", "vcan0", "mtu", "72")
        run("ip", "link", "set", "vcan0", "up")

    reset()
    yield
    reset()


@pytest.fixture
def program(helper: Callable[[str], Path]) -> Path:
    return helper("can_probe")


@pytest.fixture
def probe(vcan0: None, program: Path) -> Iterator[CanProbe]:
    with CanProbe(program, SPEC) as opened:
        yield opened


def receivers() -> int:
    """Number of sockets that the kernel gives all frames of vcan0."""
    return Path("/proc/net/can/rcvlist_all").read_text().count("vcan0 ")


class Candump:
    """A running candump -L, which sees every frame from now on."""

    def __init__(self) -> None:
        before = receivers()
        self.process = subprocess.Popen(["candump", "-L", "vcan0"], stdout=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 10
        while receivers() == before:
            assert time.monotonic() < deadline, "candump did not start"
            time.sleep(0.01)

    def frame(self) -> str:
        """Returns the next frame, as cansend takes it.

        Newer kernels mark a CAN FD frame with 4 in its flags, which candump prints and cansend does not need.
        """
        assert self.process.stdout is not None
        text = self.process.stdout.readline().split()[2]
        return re.sub("##(.)", lambda found: f"##{int(found[1], 16) & 3:X}", text)

    def __enter__(self) -> Candump:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.mark.parametrize("frame", FRAMES)
def test_every_kind_of_frame_both_ways(program: Path, frame: str) -> None:
    with Candump() as candump, CanProbe(program, SPEC) as probe:
        assert probe.send(frame) == 1
        assert candump.frame() == frame
        assert probe.receive(0) == "none"  # nobody hears himself
        run("cansend", "vcan0", frame)
        assert probe.receive() == frame
        assert probe.stats()["sent"] == probe.stats()["received"] == 1


@pytest.mark.parametrize("frame", ["123#1122", "7FF#", "321#R5"])
def test_the_rest_of_a_frame_is_zero(probe: CanProbe, frame: str) -> None:
    """The kernel's frame always has 8 bytes. Those that are not data carry nothing of the program's memory."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind(("vcan0",))
        raw.settimeout(10)
        assert probe.send(frame) == 1
        seen = raw.recv(16)
    data = b"" if "R" in frame else bytes.fromhex(frame.partition("#")[2])
    assert seen[5:8] == bytes(3)
    assert seen[8:] == data.ljust(8, b"\0")


def test_filter_by_ids(program: Path) -> None:
    with CanProbe(program, SPEC, "accept=100,80000200") as probe:
        for frame in ("101#", "00000100#", "200#", "00000200#", "100#R0", "100#"):
            run("cansend", "vcan0", frame)
        assert [probe.receive() for _ in range(3)] == ["00000200#", "100#R0", "100#"]
        assert probe.receive(20) == "none"


def test_what_a_bus_cannot_carry_is_refused(probe: CanProbe) -> None:
    assert probe.send("800#") == ERROR_ARGUMENT
    assert probe.send("100##0" + 9 * "00") == ERROR_ARGUMENT
    assert probe.stats()["tx_dropped"] == 2


def test_classic_interface_refuses_fd_frames(program: Path) -> None:
    run("ip", "link", "set", "vcan0", "down")
    run("ip", "link", "set", "vcan0", "mtu", "16")
    run("ip", "link", "set", "vcan0", "up")
    with CanProbe(program, SPEC) as probe:
        assert probe.send("100##0AA") == ERROR_UNSUPPORTED
        assert probe.send("100#AA") == 1


def test_frames_lost_in_the_kernel_are_counted(program: Path, probe: CanProbe) -> None:
    count = 20_000
    with CanProbe(program, SPEC) as sender:
        assert sender.ask(f"burst {count} 123#1122334455667788") == f"taken {count} full 0 failed 0"
        kept = int(probe.ask("drain"))
        assert 1000 < kept < count  # the default buffer would have held 278
        assert sender.send("124#") == 1
    assert probe.receive() == "124#"  # brings the count
    assert probe.stats()["rx_dropped"] == count - kept
    assert probe.stats()["received"] == kept + 1


def test_link_down_and_up_on_the_same_socket(probe: CanProbe) -> None:
    run("ip", "link", "set", "vcan0", "down")
    assert probe.receive(5000) == ERROR_BUS_DOWN  # at once, not after the timeout
    assert probe.receive(20) == "none"  # told once; then a wait is a wait
    assert probe.ask("send 123#") == ERROR_BUS_DOWN
    assert probe.stats()["tx_dropped"] == 1
    run("ip", "link", "set", "vcan0", "up")
    assert probe.send("123#") == 1
    run("cansend", "vcan0", "321#AA")
    assert probe.receive() == "321#AA"


def test_interface_that_is_removed(program: Path) -> None:
    run("ip", "link", "add", "dev", "vcan7", "type", "vcan")
    with CanProbe(program, "socketcan:vcan7") as probe:
        assert probe.ask("send 123#") == ERROR_BUS_DOWN  # opened while down
        run("ip", "link", "set", "vcan7", "up")
        assert probe.send("123#") == 1
        run("ip", "link", "del", "vcan7")
        assert probe.ask("send 123#") == ERROR_BUS_DOWN


def test_error_frames_are_counted_and_handed_over_on_request(program: Path, probe: CanProbe) -> None:
    with CanProbe(program, SPEC, "accept=100", "errors") as curious:
        run("cansend", "vcan0", "20000040#0000000000000000")  # bus-off
        run("cansend", "vcan0", "100#AA")
        assert [curious.receive(), curious.receive()] == ["20000040#0000000000000000", "100#AA"]
        assert probe.receive() == "100#AA"
        assert probe.stats()["error_frames"] == curious.stats()["error_frames"] == 1
        assert probe.stats()["received"] == 1


def test_full_transmit_queue_drops_and_counts(probe: CanProbe) -> None:
    run("tc", "qdisc", "add", "dev", "vcan0", "root", "tbf", "rate", "8kbit", "burst", "64", "limit", "160")
    try:
        with Candump() as candump:
            taken, full, failed = (int(word) for word in probe.ask("burst 100 123#11").split()[1::2])
            assert taken > 0
            assert full > 0
            assert failed == 0
            stats = probe.stats()
            assert (stats["sent"], stats["tx_dropped"]) == (taken, full)
            assert [candump.frame() for _ in range(taken)] == taken * ["123#11"]
            deadline = time.monotonic() + 10
            while probe.send("124#") != 1:  # the queue drains, and the same socket goes on
                assert time.monotonic() < deadline
                time.sleep(0.05)
            assert candump.frame() == "124#"
    finally:
        run("tc", "qdisc", "del", "dev", "vcan0", "root")


def test_kernel_time_stamp_of_the_last_frame(probe: CanProbe) -> None:
    assert probe.ask("stamp") == "0"
    before = time.time_ns()
    run("cansend", "vcan0", "123#")
    after = time.time_ns()
    time.sleep(0.2)  # the stamp is that of the arrival, not of the reading
    assert probe.receive() == "123#"
    assert before <= int(probe.ask("stamp")) <= after


def test_python_can_as_the_peer(probe: CanProbe) -> None:
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        bus.send(can.Message(arbitration_id=0x1ABCDEF0, data=[1, 2, 3]))
        assert probe.receive() == "1ABCDEF0#010203"
        assert probe.send("123#0A") == 1
        msg = bus.recv(5)
        assert msg is not None
        assert (msg.arbitration_id, bytes(msg.data)) == (0x123, b"\x0a")


@pytest.mark.parametrize(("interface", "way_out"), [("nocan9", "ip link add dev vcan0"), ("lo", "not a CAN interface")])
def test_interface_that_cannot_be_opened(program: Path, interface: str, way_out: str) -> None:
    with pytest.raises(RuntimeError, match=way_out):
        CanProbe(program, f"socketcan:{interface}")


def test_wait_lasts_as_long_as_asked(probe: CanProbe) -> None:
    start = time.monotonic()
    assert probe.receive(150) == "none"
    assert 0.15 <= time.monotonic() - start < 5
