# SPDX-License-Identifier: MIT
"""The unixbus between processes: the C driver and python-can's interface `canopy`, and python-can's own tools on it."""

from __future__ import annotations

import os
import pty
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest

from canopy.can_bus.folder import buses_folder
from canopy.unixbus import UnixBus, decode, encode
from integration.can_probe import CanProbe

FRAMES = {
    "123#1122": can.Message(arbitration_id=0x123, data=[0x11, 0x22], is_extended_id=False),
    "7FF#": can.Message(arbitration_id=0x7FF, is_extended_id=False),
    "1FFFFFFF#0102030405060708": can.Message(arbitration_id=0x1FFFFFFF, data=range(1, 9)),
    "00000123#AA": can.Message(arbitration_id=0x123, data=[0xAA]),
    "321#R5": can.Message(arbitration_id=0x321, dlc=5, is_remote_frame=True, is_extended_id=False),
    "100##0" + 12 * "5A": can.Message(arbitration_id=0x100, data=12 * [0x5A], is_fd=True, is_extended_id=False),
    "18DAF110##3" + 64 * "A5": can.Message(
        arbitration_id=0x18DAF110, data=64 * [0xA5], is_fd=True, bitrate_switch=True, error_state_indicator=True
    ),
}


def standard(arbitration_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=arbitration_id, data=data, is_extended_id=False)


def wait_for(condition: Callable[[], bool], timeout_s: float = 10.0) -> None:
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "did not happen in time"
        time.sleep(0.005)


@pytest.fixture
def probe_program(helper: Callable[[str], Path]) -> Path:
    return helper("can_probe")


@pytest.fixture
def bus(bus_dir: Path) -> Iterator[can.BusABC]:
    """A participant made the way every user of python-can makes it: by the name of the interface."""
    with can.Bus(interface="canopy", channel="bus0") as opened:
        yield opened


@pytest.fixture
def peer(bus: can.BusABC) -> Iterator[UnixBus]:
    with UnixBus("bus0") as opened:
        yield opened


def bare_socket(folder: Path, name: str) -> socket.socket:
    """A participant that never reads, or that never lived."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    sock.bind(str(folder / name))
    return sock


def own_address(bus: can.BusABC) -> str:
    assert isinstance(bus, UnixBus)
    return str(bus._own)


def test_entry_point_gives_the_class(bus: can.BusABC) -> None:
    assert isinstance(bus, UnixBus)
    assert "bus0" in bus.channel_info


@pytest.mark.parametrize("text", FRAMES)
def test_every_kind_of_frame_goes_from_c_to_python_and_back(bus: can.BusABC, probe_program: Path, text: str) -> None:
    with CanProbe(probe_program, "unixbus:bus0") as probe:
        before = time.time()
        assert probe.send(text) == 1
        msg = bus.recv(5)
        assert msg is not None
        assert msg.equals(FRAMES[text], timestamp_delta=None, check_channel=False)
        assert before <= msg.timestamp <= time.time()
        assert msg.is_rx

        bus.send(FRAMES[text])
        assert probe.receive() == text
        assert probe.stats()["received"] == probe.stats()["sent"] == 1
        assert bus.recv(0) is None  # nobody hears himself
        assert probe.receive(0) == "none"


def test_c_filter_by_ids(bus: can.BusABC, probe_program: Path) -> None:
    with CanProbe(probe_program, "unixbus:bus0", "accept=100,80000200") as probe:
        for msg in (standard(0x101), standard(0x200), can.Message(arbitration_id=0x200), standard(0x100)):
            bus.send(msg)
        assert [probe.receive(), probe.receive(), probe.receive(20)] == ["00000200#", "100#", "none"]


def test_error_frames_are_counted_and_handed_over_on_request(bus: can.BusABC, probe_program: Path) -> None:
    error = can.Message(arbitration_id=0x40, is_error_frame=True, data=8 * [0])
    with (
        CanProbe(probe_program, "unixbus:bus0") as plain,
        CanProbe(probe_program, "unixbus:bus0", "accept=100", "errors") as curious,
    ):
        bus.send(error)
        assert curious.receive() == "20000040#0000000000000000"
        assert plain.receive(50) == "none"
        assert plain.stats()["error_frames"] == curious.stats()["error_frames"] == 1


def test_many_frames_in_order_without_a_loss(bus: can.BusABC, probe_program: Path) -> None:
    burst, bursts = 250, 6
    with CanProbe(probe_program, "unixbus:bus0") as probe:
        for first in range(0, burst * bursts, burst):
            for i in range(first, first + burst):
                bus.send(standard(i))
            for i in range(first, first + burst):
                assert probe.receive() == f"{i:03X}#"
            assert probe.ask(f"burst {burst} 123#") == f"taken {burst} full 0 failed 0"
            assert all(bus.recv(5) is not None for _ in range(burst))
        assert probe.stats()["rx_dropped"] == probe.stats()["tx_dropped"] == 0
    assert isinstance(bus, UnixBus)
    assert bus.counters == {"sent": burst * bursts, "tx_dropped": 0, "rx_dropped": 0, "malformed": 0}


def test_own_messages_on_request(bus: can.BusABC) -> None:
    with UnixBus("bus0", receive_own_messages=True) as self_hearing:
        self_hearing.send(standard(0x123, b"\x01"))
        own, other = self_hearing.recv(5), bus.recv(5)
        assert own is not None
        assert other is not None
        assert not own.is_rx
        assert own.equals(other, timestamp_delta=1.0, check_direction=False)
        assert self_hearing.recv(0) is None


def test_python_filters(bus: can.BusABC) -> None:
    filters: list[can.typechecking.CanFilter] = [{"can_id": 0x120, "can_mask": 0x7F0, "extended": False}]
    with UnixBus("bus0", can_filters=filters) as peer:
        for arbitration_id in (0x110, 0x121, 0x130, 0x12F):
            bus.send(standard(arbitration_id))
        received = [peer.recv(5), peer.recv(5)]
        assert [msg.arbitration_id for msg in received if msg is not None] == [0x121, 0x12F]
        assert peer.recv(0.02) is None


@pytest.mark.parametrize("program_sends", [False, True])
def test_socket_of_a_killed_participant_is_removed(
    bus: can.BusABC, bus_dir: Path, probe_program: Path, program_sends: bool
) -> None:
    victim = CanProbe(probe_program, "unixbus:bus0")
    name = next(file.name for file in (bus_dir / "bus0").iterdir() if file.name.startswith(f"{victim.process.pid}-"))
    victim.process.kill()
    assert victim.close() == -signal.SIGKILL
    assert (bus_dir / "bus0" / name).exists()

    if program_sends:
        with CanProbe(probe_program, "unixbus:bus0") as probe:
            assert probe.send("123#") == 1
            assert probe.stats()["tx_dropped"] == 0
    else:
        bus.send(standard(0x123))
        assert isinstance(bus, UnixBus)
        assert bus.counters["tx_dropped"] == 0
    assert not (bus_dir / "bus0" / name).exists()


def test_files_of_strangers_are_left_alone(bus: can.BusABC, bus_dir: Path) -> None:
    folder = bus_dir / "bus0"
    names = ["stranger.sock", "1-00c0ffee.new", "1-00c0ffe.sock", "a-00c0ffee.sock"]
    for name in names:
        bare_socket(folder, name).close()
    bus.send(standard(1))
    assert {file.name for file in folder.iterdir()} >= set(names)


def test_stopped_participant_does_not_stall_a_python_sender(
    bus: can.BusABC, peer: UnixBus, probe_program: Path
) -> None:
    with CanProbe(probe_program, "unixbus:bus0") as stopped:
        stopped.process.send_signal(signal.SIGSTOP)
        start = time.monotonic()
        for _ in range(500):
            bus.send(standard(0x123))
        took = time.monotonic() - start
        assert isinstance(bus, UnixBus)
        assert took < 2.0
        for _ in range(500):
            assert peer.recv(5) is not None  # the others have lost nothing
        assert peer.counters["rx_dropped"] == 0
        wait_for(lambda: bus.counters["tx_dropped"] > 450)  # what does not come soon does not come
        dropped = bus.counters["tx_dropped"]
        stopped.process.send_signal(signal.SIGCONT)
        assert all(stopped.receive() == "123#" for _ in range(500 - dropped))
        for _ in range(3):  # each tells of at most 255
            bus.send(standard(0x124))
            assert stopped.receive() == "124#"
        assert stopped.stats()["rx_dropped"] == dropped == bus.counters["tx_dropped"]


def test_participant_that_never_reads_does_not_stall_a_c_sender(
    bus: can.BusABC, bus_dir: Path, probe_program: Path
) -> None:
    with (
        CanProbe(probe_program, "unixbus:bus0") as probe,
        bare_socket(bus_dir / "bus0", "1-00c0ffee.sock") as deaf,
    ):
        start = time.monotonic()
        assert probe.ask("burst 500 123#") == "taken 500 full 0 failed 0"  # taken by `bus`
        assert time.monotonic() - start < 2.0
        time.sleep(0.25)
        deaf.setblocking(False)
        taken = 0
        with pytest.raises(BlockingIOError):
            while deaf.recv(100):
                taken += 1
        assert probe.stats()["tx_dropped"] == 500 - taken
        for _ in range(500):
            assert bus.recv(5) is not None


def test_send_with_a_timeout(bus: can.BusABC, bus_dir: Path) -> None:
    msg = standard(0x123)
    with bare_socket(bus_dir / "bus0", "1-00c0ffee.sock"):
        start = time.monotonic()
        for _ in range(300):
            bus.send(msg, timeout=0)
        never_waited = time.monotonic() - start
        start = time.monotonic()
        with pytest.raises(can.CanTimeoutError):
            bus.send(msg, timeout=0.3)
        assert time.monotonic() - start >= 0.29
        assert never_waited < 5.0


def test_malformed_datagrams_are_counted(bus: can.BusABC, probe_program: Path) -> None:
    good = encode(standard(0x123, b"\x11\x22"))
    changes = [(0, 2), (1, 64), (1, 16), (2, 3), (2, 1), (2, 9), (5, 8)]
    bad = [good[:place] + bytes([value]) + good[place + 1 :] for place, value in changes]
    bad += [good[:size] for size in range(len(good))] + [good + b"\0", bytes(200)]
    with CanProbe(probe_program, "unixbus:bus0") as probe, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        for path in Path(own_address(bus)).parent.iterdir():
            for datagram in [*bad, good]:
                sock.sendto(datagram, str(path))
        msg = bus.recv(5)
        assert msg is not None
        assert msg.arbitration_id == 0x123
        assert bus.recv(0.02) is None
        assert probe.receive() == "123#1122"
        assert probe.receive(20) == "none"
        assert int(probe.ask("malformed")) == len(bad)
    assert isinstance(bus, UnixBus)
    assert bus.counters["malformed"] == len(bad)
    assert all(decode(datagram) is None for datagram in bad)


@pytest.mark.parametrize(
    "msg",
    [
        can.Message(arbitration_id=0x800, is_extended_id=False),
        can.Message(arbitration_id=1, data=9 * [0], is_extended_id=False),
        can.Message(arbitration_id=1, data=9 * [0], is_fd=True),
        can.Message(arbitration_id=1, bitrate_switch=True),
    ],
)
def test_frame_that_no_bus_can_carry_is_refused(bus: can.BusABC, msg: can.Message) -> None:
    with pytest.raises(can.CanOperationError):
        bus.send(msg)


def test_full_queue_loses_the_newest_and_counts(bus: can.BusABC) -> None:
    with UnixBus("bus0", rx_queue_size=10) as peer:
        for i in range(15):
            bus.send(standard(i))
        wait_for(lambda: peer.counters["rx_dropped"] == 5)
        received = [peer.recv(0) for _ in range(10)]
        assert [msg.arbitration_id for msg in received if msg is not None] == list(range(10))


def test_shutdown_removes_the_socket_and_ends_a_waiting_recv(bus_dir: Path) -> None:
    bus = UnixBus("bus0")
    errors: list[can.CanOperationError] = []

    def wait() -> None:
        try:
            bus.recv()
        except can.CanOperationError as error:
            errors.append(error)

    thread = threading.Thread(target=wait)
    thread.start()
    bus.shutdown()
    bus.shutdown()
    thread.join(10)
    assert len(errors) == 1
    assert list((bus_dir / "bus0").iterdir()) == []
    with pytest.raises(can.CanOperationError):
        bus.send(standard(1))


def test_deleted_socket_is_told(bus: can.BusABC) -> None:
    Path(own_address(bus)).unlink()
    with pytest.raises(can.CanOperationError, match="deleted"):
        bus.send(standard(1))


def test_folder_of_a_bus(bus_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert buses_folder() == bus_dir
    with UnixBus(str(bus_dir / "by_path")) as by_path, UnixBus("by_path") as by_name:
        by_path.send(standard(7))
        assert by_name.recv(5) is not None
    assert {"interface": "canopy", "channel": "by_path"} in can.detect_available_configs("canopy")
    monkeypatch.delenv("CANOPY_BUS_DIR")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(bus_dir))
    assert buses_folder() == bus_dir / "canopy"
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(bus_dir / "missing"))
    assert buses_folder() == Path(f"/tmp/canopy-{os.geteuid()}")


@pytest.mark.parametrize("name", ["", ".", "..", "/nowhere/at/all", "x" * 100])
def test_bus_that_cannot_be_is_told(bus_dir: Path, name: str) -> None:
    with pytest.raises(can.CanInitializationError, match="CANOPY_BUS_DIR"):
        UnixBus(name)
    assert list(bus_dir.iterdir()) == []


def test_both_languages_find_the_same_folder(
    bus_dir: Path, probe_program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CANOPY_BUS_DIR")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(bus_dir))
    with UnixBus("bus7") as bus, CanProbe(probe_program, "unixbus:bus7") as probe:
        bus.send(standard(0x77))
        assert probe.receive() == "077#"


def test_can_logger_and_player(bus: can.BusABC, bus_dir: Path) -> None:
    log = bus_dir / "run.log"
    logger = subprocess.Popen(
        [sys.executable, "-m", "can.logger", "-i", "canopy", "-c", "bus0", "-f", str(log)], stdout=subprocess.DEVNULL
    )
    wait_for(lambda: len(list((bus_dir / "bus0").glob("*.sock"))) == 2)
    for i in range(20):
        bus.send(standard(0x100 + i, bytes([i])))
    time.sleep(0.2)
    logger.send_signal(signal.SIGINT)
    logger.wait(20)
    assert re.findall(r"(\w+)#(\w+)", log.read_text()) == [(f"{0x100 + i:03X}", f"{i:02X}") for i in range(20)]

    subprocess.run(
        [sys.executable, "-m", "can.player", "-i", "canopy", "-c", "bus0", str(log)],
        stdout=subprocess.DEVNULL,
        check=True,
        timeout=30,
    )
    played = [bus.recv(5) for _ in range(20)]
    assert [msg.arbitration_id for msg in played if msg is not None] == [0x100 + i for i in range(20)]


def test_can_viewer(bus: can.BusABC, bus_dir: Path) -> None:
    """The viewer needs a terminal: it gets a pseudo-terminal, and its screen must show our frame."""
    terminal, inside = pty.openpty()
    viewer = subprocess.Popen(
        [sys.executable, "-m", "can.viewer", "-i", "canopy", "-c", "bus0"],
        stdin=inside,
        stdout=inside,
        stderr=inside,
        env={**os.environ, "TERM": "xterm", "LINES": "25", "COLUMNS": "100"},
        start_new_session=True,
    )
    os.close(inside)
    screen = bytearray()
    reader = threading.Thread(target=_read_all, args=(terminal, screen))
    reader.start()
    try:
        wait_for(lambda: len(list((bus_dir / "bus0").glob("*.sock"))) == 2)

        def shown() -> bool:
            bus.send(standard(0x5A5, b"\xde\xad"))
            return b"5A5" in screen and b"DE AD" in screen

        wait_for(shown)
        os.write(terminal, b"q")
        assert viewer.wait(10) == 0
    finally:
        viewer.kill()
        viewer.wait()
        reader.join(10)
        os.close(terminal)


def _read_all(descriptor: int, into: bytearray) -> None:
    while True:
        try:
            data = os.read(descriptor, 4096)
        except OSError:  # how Linux says that the other side of a pseudo-terminal is closed
            return
        if not data:
            return
        into += data
