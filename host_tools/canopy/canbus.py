# SPDX-License-Identifier: MIT
"""CAN bus names as all of Canopy's programs take them, opened with python-can.

`socketcan:vcan0` is an interface of the kernel, `unixbus:bus0` or `unixbus:/a/folder` a virtual bus that needs neither
root nor a kernel with CAN (docs/unixbus.md).
"""

from __future__ import annotations

import errno
import logging
import socket
import struct
from typing import Any

import can
from can.interfaces.socketcan import SocketcanBus

from canopy.unixbus import UnixBus

_INTERFACES = {"socketcan": "socketcan", "unixbus": "canopy"}
_SO_MEMINFO = 55  # Linux; the socket module has no name for it
_MEMINFO = struct.Struct("9I")  # the last one: SK_MEMINFO_DROPS


class CanBusError(Exception):
    """A CAN bus cannot be opened; the text says which, why, and the way out."""


def split_spec(spec: str) -> tuple[str, str]:
    """Splits `kind:channel`.

    Raises:
        CanBusError: The text is no name of a CAN bus.
    """
    kind, colon, channel = spec.partition(":")
    if not colon or kind not in _INTERFACES or not channel:
        raise CanBusError(f"'{spec}' is no CAN bus: write socketcan:INTERFACE, unixbus:NAME or unixbus:/a/folder")
    return kind, channel


def open_bus(spec: str, **kwargs: Any) -> can.BusABC:
    """Opens a CAN bus.

    Args:
        spec: e.g. `socketcan:vcan0`, `unixbus:bus0`, `unixbus:/a/folder`.
        kwargs: Handed to python-can's `can.Bus`, e.g. receive_own_messages, can_filters.

    Raises:
        CanBusError: No such bus here; the text says the way out.
    """
    kind, channel = split_spec(spec)
    # python-can also logs what it raises; one line is enough.
    logging.getLogger("can").setLevel(logging.CRITICAL)
    try:
        return can.Bus(interface=_INTERFACES[kind], channel=channel, **kwargs)
    except (OSError, can.CanError, ValueError) as error:
        raise CanBusError(f"cannot open {spec}: {error}{_way_out(kind, channel, error)}") from error


def receive_losses(bus: can.BusABC) -> int | None:
    """Frames that came and were lost because nobody fetched them in time; None where that is not to be known."""
    if isinstance(bus, UnixBus):
        return bus.counters["rx_dropped"]
    if isinstance(bus, SocketcanBus):
        try:
            numbers = bus.socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
        except OSError:  # Linux before 4.12
            return None
        return int(_MEMINFO.unpack(numbers)[-1])
    return None


def is_plain_data(message: can.Message) -> bool:
    """True for a data frame: neither a remote request nor an error frame."""
    return not (message.is_remote_frame or message.is_error_frame)


def _way_out(kind: str, channel: str, error: Exception) -> str:
    if kind != "socketcan":
        return ""
    code = error.errno if isinstance(error, OSError) else None
    if code == errno.EAFNOSUPPORT:
        return "; this kernel has no CAN: use unixbus:bus0"
    if code in (errno.ENODEV, errno.ENXIO):
        return (
            f"; for a virtual one: ip link add dev {channel} type vcan && ip link set {channel} up, "
            "or use unixbus:bus0 where the kernel has no CAN"
        )
    return ""
