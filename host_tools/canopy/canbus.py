# SPDX-License-Identifier: MIT
"""CAN bus names as all of Canopy's programs take them, opened with python-can.

`socketcan:vcan0` is an interface of the kernel, `unixbus:bus0` or `unixbus:/a/folder` a virtual bus that needs neither
root nor a kernel with CAN (docs/unixbus.md).
"""

from __future__ import annotations

import errno
import logging
from typing import Any

import can

_INTERFACES = {"socketcan": "socketcan", "unixbus": "canopy"}


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
