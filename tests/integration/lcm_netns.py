# SPDX-License-Identifier: MIT
"""A network of its own for tests with LCM: nothing they send can reach a real interface, or another test.

Multicast needs a route, and a test must not change the machine's. So a small process holds a network namespace with
nothing but the loopback device in it, and the programs under test are started inside with nsenter. Root is not needed
where the kernel lets users make user namespaces. Where the test already runs in such a network (tests/rig/with-vcan
makes one, and vcan0 is in it), that one is used.

    with LcmNetwork() as network:
        subprocess.Popen(network.command(["canopy", "bridge", ...]))
"""

from __future__ import annotations

import os
import socket
import subprocess
from types import TracebackType

_SET_UP = "ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && echo ready && exec cat"


# Root needs no user namespace, and in a chroot or a container may not make one.
_USER = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]

NO_ROUTE = ["unshare", *_USER, "--net", "--"]
"""Starts a command in a network that has no route at all, so that LCM cannot work."""


def is_isolated() -> bool:
    """True where only loopback and virtual CAN interfaces exist and the multicast route is there."""
    if any(name != "lo" and not name.startswith(("vcan", "vxcan")) for _, name in socket.if_nameindex()):
        return False
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("239.255.76.67", 7667))
        except OSError:
            return False
    return True


class LcmNetwork:
    """A network namespace with a multicast route on loopback, for as long as the context lasts."""

    def __init__(self) -> None:
        self._holder: subprocess.Popen[str] | None = None
        self._enter: list[str] = []

    def command(self, argv: list[str]) -> list[str]:
        """The command line that runs argv inside this network; its exit status, signals and pid are argv's own."""
        return [*self._enter, *argv]

    def __enter__(self) -> LcmNetwork:
        if is_isolated():
            return self
        # The holder reads its stdin: it ends with the test process, however that ends.
        self._holder = subprocess.Popen(
            ["unshare", *_USER, "--net", "sh", "-c", _SET_UP], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._holder.stdout is not None
        if self._holder.stdout.readline() != "ready\n":
            status = self._holder.wait(10)
            raise RuntimeError(f"no network namespace could be made (unshare and ip ended with status {status})")
        target = f"--target={self._holder.pid}"
        self._enter = ["nsenter", target, *(["--user", "--preserve-credentials"] if _USER else []), "--net", "--"]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._holder is not None:
            self._holder.communicate(timeout=10)
            self._holder = None
            self._enter = []
