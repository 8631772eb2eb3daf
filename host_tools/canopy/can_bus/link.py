# SPDX-License-Identifier: MIT
"""The kernel's CAN interfaces: which there are, and whether they are up. Asked of the kernel, not of a socket."""

from __future__ import annotations

import fcntl
import socket
import struct
from pathlib import Path

_NET = Path("/sys/class/net")
_ARPHRD_CAN = "280"
_SIOCGIFFLAGS = 0x8913
_IFF_UP = 1
_IFREQ = struct.Struct("16sH14x")


def is_up(interface: str) -> bool | None:
    """Whether an interface is up; None: there is none of this name, or the kernel does not say."""
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as any_socket:
            answer = fcntl.ioctl(any_socket, _SIOCGIFFLAGS, _IFREQ.pack(interface.encode()[:15], 0))
    except OSError:
        return None
    return bool(_IFREQ.unpack(answer)[1] & _IFF_UP)


def interfaces() -> list[tuple[str, bool]]:
    """The CAN interfaces by name, each with whether it is up."""
    found = []
    try:
        names = sorted(entry.name for entry in _NET.iterdir())
    except OSError:
        return []
    for name in names:
        try:
            kind = (_NET / name / "type").read_text(encoding="ascii").strip()
        except OSError:  # it has just gone
            continue
        up = is_up(name)
        if kind == _ARPHRD_CAN and up is not None:
            found.append((name, up))
    return found
