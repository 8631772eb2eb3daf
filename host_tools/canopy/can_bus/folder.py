# SPDX-License-Identifier: MIT
"""The folder of a unixbus: where it is, who takes part, and who may (docs/unixbus.md)."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import socket
import stat
from pathlib import Path

PATH_MAX = 107
"""Bytes of a Unix socket's path (sun_path without its final 0)."""

SOCKET_NAME_LENGTH = len("4194304-0badc0de.sock")
SOCKET_NAME = re.compile(r"[0-9]{1,10}-[0-9a-f]{8}\.sock")

PARTICIPANTS_MAX = 320
"""Most participants of a bus; one more is refused when it joins."""


class NoSuchBusError(FileNotFoundError):
    """There is no such bus, and nobody asked to make it; the text names the buses that there are."""


def buses_folder() -> Path:
    """Folder that holds the buses with a name: CANOPY_BUS_DIR, or in XDG_RUNTIME_DIR, or in /tmp (docs/unixbus.md)."""
    if configured := os.environ.get("CANOPY_BUS_DIR"):
        return Path(configured)
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and Path(runtime).is_dir():
        return Path(runtime, "canopy")
    return _shared_folder()


def _shared_folder() -> Path:
    """Where buses lie when nothing says where: in a place where others could have made the folder first."""
    return Path(f"/tmp/canopy-{os.geteuid()}")


def bus_names() -> list[str]:
    """The names of the buses that there are, in order."""
    try:
        return sorted(entry.name for entry in buses_folder().iterdir() if entry.is_dir())
    except OSError:
        return []


def bus_folder(bus: str, create: bool = True) -> Path:
    """Finds the folder of a bus.

    Args:
        bus: a name such as ``bus0``, or the path of a folder if it contains a slash.
        create: whether it is made if it is missing.

    Raises:
        ValueError: the name is empty, ``.`` or ``..``.
        NoSuchBusError: it is missing, and `create` is false.
        OSError: the folder cannot be made; PermissionError: others could have put it into /tmp.
    """
    if bus in ("", ".", ".."):
        raise ValueError(f"{bus!r} is no bus: give a name such as bus0, or a folder's path with a slash")
    base = None if "/" in bus else buses_folder()
    folder = Path(bus) if base is None else base / bus
    if len(os.fsencode(folder)) + 1 + SOCKET_NAME_LENGTH > PATH_MAX:
        raise OSError(errno.ENAMETOOLONG, "a socket's path has at most 107 bytes", str(folder))
    if not create and not folder.is_dir():
        names = bus_names()
        there = f"the buses in {buses_folder()} are: {', '.join(names)}" if names else f"{buses_folder()} holds none"
        raise NoSuchBusError(errno.ENOENT, f"there is no bus {bus!r}; {there}")
    if base is not None:
        if create:
            base.mkdir(mode=0o700, exist_ok=True)
        if base == _shared_folder():
            status = base.lstat()
            if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & 0o022:
                raise PermissionError(errno.EPERM, "not a folder that only you can write", str(base))
    if create:
        folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def participants(folder: Path) -> list[str]:
    """Names of the sockets in the folder that somebody holds; those of the dead are deleted where that is allowed.

    Raises:
        OSError: The folder cannot be read.
    """
    names = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as probe:
        for name in os.listdir(folder):
            if not SOCKET_NAME.fullmatch(name):
                continue
            try:
                probe.connect(str(folder / name))
            except ConnectionRefusedError:
                with contextlib.suppress(OSError):
                    (folder / name).unlink()
                continue
            except FileNotFoundError:
                continue
            except OSError:  # somebody else's, who has not shared the folder: he takes part all the same
                pass
            names.append(name)
    return sorted(names)


def join(sock: socket.socket, own: Path) -> None:
    """Binds a socket to its name in the folder, for all who may write the folder.

    Raises:
        OSError: It cannot be; EUSERS: the bus has as many participants as it can have.
    """
    # bind() makes the file first and the way to the socket after it. A sender that comes between the two would take
    # the socket for a dead one's and unlink it. So the name that senders look for is given when all is done.
    hidden = own.with_suffix(".new")
    try:
        sock.bind(str(hidden))
        status = own.parent.stat()
        with contextlib.suppress(OSError):  # not by everybody to every group
            os.chown(hidden, -1, status.st_gid, follow_symlinks=False)
        with contextlib.suppress(OSError):
            hidden.chmod(status.st_mode & 0o666)
        if len(participants(own.parent)) >= PARTICIPANTS_MAX:
            raise OSError(
                errno.EUSERS,
                f"it has {PARTICIPANTS_MAX} participants, the most that a bus can have: end one (`canopy buses` "
                "lists them)",
            )
        hidden.rename(own)
    except OSError:
        with contextlib.suppress(OSError):
            hidden.unlink()
        raise
