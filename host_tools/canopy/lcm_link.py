# SPDX-License-Identifier: MIT
"""The way to LCM: one function that opens it, or says in one line why not and what mends it.

LCM is how Canopy is watched, never how it works: every tool goes on without it.
"""

from __future__ import annotations

import socket
import time
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from canopy.escape.terminal import echo

if TYPE_CHECKING:
    import lcm

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
"""LCM's own group and port; ttl=0: messages never leave this machine."""

CHANNEL_TREE = "CANOPY_TREE"
CHANNEL_TREE_STRUCTURE = "CANOPY_TREE_STRUCTURE"
CHANNEL_ROBOT = "CANOPY_ROBOT"
CHANNEL_ROBOT_COMMAND = "CANOPY_ROBOT_COMMAND"
CHANNEL_ROBOT_EVENT = "CANOPY_ROBOT_EVENT"
CHANNEL_ROBOT_HEALTH = "CANOPY_ROBOT_HEALTH"

_MEND_ROUTE = "ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo"
_NO_PACKAGE = "the Python package lcm is not installed; mend with: pip install lcm"
_MEND_GLIB = "apt-get install libglib2.0-0"
_MEND_TYPES = "cmake --build build/host --target lcm_types (and build/host/lcm/python on PYTHONPATH)"


def utime_now() -> int:
    """Now, as LCM messages carry it [µs since 1970]."""
    return time.time_ns() // 1000


def open_lcm(url: str, what: str) -> lcm.LCM | None:
    """Opens LCM for publishing and subscribing.

    Args:
        url: LCM's provider URL, e.g. DEFAULT_URL.
        what: Name of the program, the first word of the line that is printed.

    Returns:
        The link, or None when LCM cannot work here: then one line on stderr says why, and which command mends it.
    """
    trouble = _missing_package() or _missing_types() or _missing_route(url)
    if trouble is None:
        import lcm

        try:
            return lcm.LCM(url)
        except RuntimeError as error:
            trouble = f"{error} with the URL {url}; check the URL"
    echo(f"{what}: going on without LCM: {trouble}", err=True)
    return None


def _missing_package() -> str | None:
    try:
        import lcm
    except ImportError as error:
        if error.name == "lcm":
            return _NO_PACKAGE
        # The wheel looks for its library in two places: what was wrong with the first one is what counts.
        cause = error.__context__ if isinstance(error.__context__, ImportError) else error
        return f"{cause}; mend with: {_MEND_GLIB if 'libglib' in str(cause) else 'pip install --force-reinstall lcm'}"
    # Any folder lcm/ on Python's path, such as the one with the .lcm files, can be imported, and is no package.
    return _NO_PACKAGE if getattr(lcm, "__file__", None) is None else None


def _missing_types() -> str | None:
    try:
        import canopy_msgs  # noqa: F401
    except ImportError:
        return f"the message types canopy_msgs are not there; mend with: {_MEND_TYPES}"
    return None


def _missing_route(url: str) -> str | None:
    """Asks the kernel for a route to the multicast group, which liblcm would answer with three lines of its own."""
    if not url.startswith("udpm:"):
        return None
    try:
        parts = urlsplit(url)
        group, port = parts.hostname or "239.255.76.67", parts.port or 7667
    except ValueError as error:
        return f"{url} is no LCM URL: {error}"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((group, port))
        except OSError as error:
            return f"no route to the multicast group {group} ({error.strerror}); mend with: {_MEND_ROUTE}"
    return None
