# SPDX-License-Identifier: MIT
"""vcan interfaces with an echo, blocked buses, and what is on the wire and how old it is. In tests/rig/with-vcan."""

from __future__ import annotations

import socket
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

IS_GUEST = "User Mode Linux" in Path("/proc/cpuinfo").read_text()
"""The kernel is ours alone: modules and the wall clock may be changed."""


def run(*command: str) -> None:
    subprocess.run(command, check=True)


def make_vcan0() -> None:
    run("ip", "link", "add", "dev", "vcan0", "type", "vcan")
    run("ip", "link", "set", "vcan0", "up")


def load_vcan(*, echo: bool) -> None:
    """vcan0 anew: with ``echo`` as a controller that tells when a frame is out (IFF_ECHO), else without."""
    release = subprocess.run(["uname", "-r"], check=True, capture_output=True, text=True).stdout.strip()
    run("ip", "link", "del", "vcan0")
    run("rmmod", "vcan")
    module = f"/usr/lib/uml/modules/{release}/kernel/drivers/net/can/vcan.ko"
    run("insmod", module, *(["echo=1"] if echo else []))
    make_vcan0()


@contextmanager
def vxcan_pair() -> Iterator[None]:
    """vxcan0 without an echo, whose wire ends in vxcan1: there a frame is seen when it has left, and not before."""
    run("ip", "link", "add", "dev", "vxcan0", "type", "vxcan", "peer", "name", "vxcan1")
    run("ip", "link", "set", "vxcan0", "up")
    run("ip", "link", "set", "vxcan1", "up")
    try:
        yield
    finally:
        run("ip", "link", "del", "vxcan0")


class Queue:
    """An interface has a queue of so many frames, which can be held up at once."""

    def __init__(self, interface: str, length: int) -> None:
        self._interface = interface
        run("ip", "link", "set", interface, "txqueuelen", str(length))
        run("tc", "qdisc", "add", "dev", interface, "root", "plug", "limit", str(length * 72))
        # One process for all changes: starting one for each takes longer than some blocks last.
        self._tc = subprocess.Popen(["tc", "-batch", "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.release()

    def _change(self, what: str) -> None:
        assert self._tc.stdin is not None
        assert self._tc.stdout is not None
        self._tc.stdin.write(f"qdisc change dev {self._interface} root plug {what}\n")
        self._tc.stdin.write(f"qdisc show dev {self._interface}\n")  # its answer says that the change is done
        self._tc.stdin.flush()
        assert "plug" in self._tc.stdout.readline(), "tc did not change the queue"

    def block(self) -> None:
        self._change("block")

    def release(self) -> None:
        self._change("release_indefinite")

    def __enter__(self) -> Queue:
        return self

    def __exit__(self, *_: object) -> None:
        self._tc.communicate()
        run("tc", "qdisc", "del", "dev", self._interface, "root")


class Wire:
    """Sees every frame of an interface when it is on the wire: (monotonic time, id, data), from now on."""

    def __init__(self, interface: str = "vcan0") -> None:
        self.frames: list[tuple[float, int, bytes]] = []
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self._socket.bind((interface,))
        self._socket.settimeout(0.1)
        self._stopping = False
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        while not self._stopping:
            try:
                raw = self._socket.recv(72)
            except (TimeoutError, OSError):
                continue  # nothing, or the link was down
            number, length = struct.unpack_from("=IB", raw)
            self.frames.append((time.monotonic(), number, raw[8 : 8 + length]))

    def __enter__(self) -> Wire:
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping = True
        self._thread.join()
        self._socket.close()


def age_ms(frame: tuple[float, int, bytes]) -> float:
    """How old a frame of stamped_sender was when it was seen [ms]."""
    stamp = int.from_bytes(frame[2][:4], "little")
    return (int(frame[0] * 1000) - stamp) % (1 << 32)
