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
from integration.rig.vcan import IS_GUEST, Queue, load_vcan, run

SPEC = "socketcan:vcan0"
ACTIVE, WARNING, PASSIVE, BUS_OFF, DOWN, GONE = range(6)
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


needs_own_kernel = pytest.mark.skipif(not IS_GUEST, reason="sets the clock, or loads a module anew: not on this kernel")


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
def echo(vcan0: None) -> Iterator[None]:
    """vcan0 tells when a frame is out, as a real controller does."""
    load_vcan(echo=True)
    yield
    load_vcan(echo=False)


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
        assert probe.ask("outcome") == "sent"
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


@needs_own_kernel
def test_every_kind_of_frame_is_known_by_its_echo(echo: None, program: Path) -> None:
    with Candump() as candump, Queue("vcan0", 100) as queue, CanProbe(program, SPEC) as probe:
        for number, frame in enumerate(FRAMES):
            queue.block()
            assert probe.send(frame) == 1
            assert probe.ask("outcome") == "pending"
            assert probe.send(frame) == 0  # one at a time
            run("cansend", "vcan0", "124#55")  # of another process: blocked, too, and not ours
            queue.release()
            assert [candump.frame(), candump.frame()] == [frame, "124#55"]
            assert probe.ask("outcome") == "sent"
            assert probe.receive() == "124#55"
            assert probe.receive(0) == "none"  # nobody hears himself
            assert probe.stats()["sent"] == number + 1


@needs_own_kernel
def test_a_foreign_frame_is_no_echo(echo: None, program: Path) -> None:
    with Queue("vcan0", 100) as queue, CanProbe(program, SPEC, "accept=7FF") as probe:
        queue.block()
        assert probe.send("123#11") == 1
        for other in ("123#12", "123#1111", "124#11", "00000123#11", "123##011"):
            run("cansend", "vcan0", other)
        run("ip", "link", "set", "vcan0", "down")  # all are gone, ours too
        run("ip", "link", "set", "vcan0", "up")
        assert probe.ask("outcome") == "aborted"
        stats = probe.stats()
        assert (stats["sent"], stats["tx_dropped"]) == (0, 1)
        queue.release()
        assert probe.send("123#13") == 1
        assert probe.ask("outcome") == "sent"


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


def state(probe: CanProbe) -> int:
    time.sleep(0.1)  # the interface's flags are looked at every 50 ms
    return int(probe.ask("state"))


def test_interface_that_is_removed_and_made_anew(program: Path) -> None:
    run("ip", "link", "add", "dev", "vcan7", "type", "vcan")
    with CanProbe(program, "socketcan:vcan7", "accept=321") as probe:
        assert "ip link set" in probe.ask("advice 0")
        assert probe.ask("send 123#") == ERROR_BUS_DOWN  # opened while down
        assert state(probe) == DOWN
        run("ip", "link", "set", "vcan7", "up")
        assert state(probe) == ACTIVE
        assert probe.ask("advice 0") == "none"
        assert probe.send("123#") == 1
        run("ip", "link", "del", "vcan7")
        assert probe.ask("send 123#") == ERROR_BUS_DOWN
        assert state(probe) == GONE
        probe.ask("restart")
        assert state(probe) == GONE
        run("ip", "link", "add", "dev", "vcan7", "type", "vcan")
        assert state(probe) == GONE  # another interface, of the same name
        probe.ask("restart")
        assert state(probe) == DOWN
        run("ip", "link", "set", "vcan7", "up")
        assert state(probe) == ACTIVE
        assert probe.send("123#") == 1
        run("cansend", "vcan7", "322#AA")  # the filter is the old one
        run("cansend", "vcan7", "321#AA")
        while (frame := probe.receive()) == ERROR_BUS_DOWN:
            pass
        assert frame == "321#AA"
        run("ip", "link", "del", "vcan7")


@needs_own_kernel
def test_an_interface_that_is_gone_starts_no_process(program: Path, tmp_path: Path) -> None:
    """Asked for a name that does not exist, the kernel may start modprobe, and the control loop waits for its end."""
    setting = Path("/proc/sys/kernel/modprobe")
    modprobe = setting.read_text(encoding="utf-8")
    seen, stand_in = tmp_path / "seen", tmp_path / "modprobe"
    stand_in.write_text(f'#!/bin/sh\necho "$@" >> {seen}\n', encoding="utf-8")
    stand_in.chmod(0o755)
    run("ip", "link", "add", "dev", "vcan7", "type", "vcan")
    try:
        setting.write_text(str(stand_in), encoding="utf-8")
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as other, pytest.raises(OSError):
            other.bind(("vcan8",))
        assert "netdev-vcan8" in seen.read_text(encoding="utf-8")  # so it is what the kernel does
        seen.unlink()
        with CanProbe(program, "socketcan:vcan7") as probe:
            run("ip", "link", "set", "vcan7", "up")
            assert state(probe) == ACTIVE
            run("ip", "link", "del", "vcan7")
            for _ in range(5):
                assert state(probe) == GONE
                probe.ask("restart")
            assert not seen.exists()
    finally:
        setting.write_text(modprobe, encoding="utf-8")


def test_the_controllers_state_is_read_from_error_frames(probe: CanProbe) -> None:
    for frame, expected in (
        ("20000004#0008000000000000", WARNING),
        ("20000004#0020000000000000", PASSIVE),
        ("20000004#0001000000000000", PASSIVE),  # a receive buffer overflowed: says nothing of the state
        ("20000004#0040000000000000", ACTIVE),
        ("20000208#0000000000006000", WARNING),  # error counters: 96,
        ("20000208#0000000000000080", PASSIVE),  # 128,
        ("20000208#0000000000000008", ACTIVE),  # and few
        ("20000040#0000000000000000", BUS_OFF),
        ("20000004#0040000000000000", BUS_OFF),  # only a restart ends that
        ("20000100#0000000000000000", ACTIVE),
    ):
        run("cansend", "vcan0", frame)
        assert int(probe.ask("state")) == expected, frame
    assert probe.receive(0) == "none"  # none of it is handed over


def test_bus_off_is_ended_by_switching_the_interface(probe: CanProbe) -> None:
    run("cansend", "vcan0", "20000040#0000000000000000")
    assert state(probe) == BUS_OFF
    probe.ask("restart")  # a controller without restart-ms: off and on
    assert state(probe) == ACTIVE
    assert probe.send("123#") == 1
    assert probe.receive(0) == "none"


@needs_own_kernel
@pytest.mark.parametrize("step_s", [3600.0, -3600.0, 0.5, -0.5])
def test_setting_the_wall_clock_changes_no_age(probe: CanProbe, step_s: float) -> None:
    """The frame is stamped before the clock is set, and read after it."""
    try:
        assert probe.receive(0) == "none"  # the queue is empty
        run("cansend", "vcan0", "123#")
        time.sleep(0.3)
        time.clock_settime(time.CLOCK_REALTIME, time.time() + step_s)
        assert probe.receive() == "123#"
        age_s = int(probe.ask("age")) * 1e-6
        assert 0.3 <= age_s < 0.3 + 0.6  # older by less than a step that both clocks allow
        time.sleep(0.01)
        assert probe.receive(0) == "none"
        run("cansend", "vcan0", "124#")
        time.sleep(0.2)
        assert probe.receive() == "124#"
        assert 0.2 <= int(probe.ask("age")) * 1e-6 < 0.2 + 0.15
    finally:
        time.clock_settime(time.CLOCK_REALTIME, time.time() - step_s)


def test_error_frames_are_counted_and_handed_over_on_request(program: Path, probe: CanProbe) -> None:
    with CanProbe(program, SPEC, "accept=100", "errors") as curious:
        run("cansend", "vcan0", "20000040#0000000000000000")  # bus-off
        run("cansend", "vcan0", "100#AA")
        assert [curious.receive(), curious.receive()] == ["20000040#0000000000000000", "100#AA"]
        assert probe.receive() == "100#AA"
        assert int(probe.ask("state")) == int(curious.ask("state")) == BUS_OFF
        assert probe.stats()["error_frames"] == curious.stats()["error_frames"] == 1
        assert probe.stats()["received"] == 1


def test_a_queue_that_is_full_of_others_frames_is_no_error(probe: CanProbe) -> None:
    run("tc", "qdisc", "add", "dev", "vcan0", "root", "tbf", "rate", "8kbit", "burst", "64", "limit", "160")
    try:
        with Candump() as candump:
            taken, full, failed = (int(word) for word in probe.ask("burst 100 123#11").split()[1::2])
            assert taken > 0
            assert full > 0
            assert failed == 0
            stats = probe.stats()
            assert (stats["sent"], stats["tx_dropped"]) == (taken, 0)  # what was not taken may be offered again
            assert [candump.frame() for _ in range(taken)] == taken * ["123#11"]
            deadline = time.monotonic() + 10
            while probe.send("124#") != 1:  # the queue drains, and the same socket goes on
                assert time.monotonic() < deadline
                time.sleep(0.05)
            assert candump.frame() == "124#"
    finally:
        run("tc", "qdisc", "del", "dev", "vcan0", "root")


def test_an_interface_with_a_queue_and_without_an_echo_is_told(program: Path) -> None:
    with Queue("vcan0", 100) as queue, CanProbe(program, SPEC) as probe:
        assert "does not tell when a frame is out" in probe.ask("advice 0")
        assert probe.ask("advice 1") == "none"
        queue.block()
        assert probe.send("123#11") == 1
        assert probe.ask("outcome") == "pending"
        queue.release()
        assert probe.ask("outcome") == "sent"  # out of the queue: more is not known
        queue.block()
        assert probe.send("123#12") == 1
        assert probe.send("123#13") == 0  # one at a time
        queue.release()
        assert probe.send("123#13") == 0  # until it was asked about
        assert probe.ask("outcome") == "sent"
        assert probe.send("123#13") == 1


def test_a_frame_is_as_old_as_its_arrival(probe: CanProbe) -> None:
    before = time.monotonic()
    run("cansend", "vcan0", "123#")
    after = time.monotonic()
    time.sleep(0.2)  # counted from the arrival, not from the reading
    assert probe.receive() == "123#"
    read = time.monotonic()
    arrived = read - int(probe.ask("age")) * 1e-6
    assert before - 0.01 <= arrived <= after + (time.monotonic() - read)


def test_frames_of_a_long_queue_are_each_as_old_as_they_are(probe: CanProbe) -> None:
    assert probe.receive(0) == "none"
    sent = []
    for number in range(40):  # more than the driver takes from the kernel at once
        sent.append(time.monotonic())
        run("cansend", "vcan0", f"{0x100 + number:03X}#")
        time.sleep(0.005)
    for number in range(40):
        assert probe.receive() == f"{0x100 + number:03X}#"
        arrived = time.monotonic() - int(probe.ask("age")) * 1e-6
        assert sent[number] - 0.03 <= arrived <= [*sent, time.monotonic()][number + 1] + 0.03


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
