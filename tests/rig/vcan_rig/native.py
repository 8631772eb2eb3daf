# SPDX-License-Identifier: MIT
"""Mode native: the running kernel has CAN, and the command gets a network namespace of its own."""

import os
import shutil
import socket
import subprocess
from typing import NoReturn

from vcan_rig.options import Options

SETUP = """
set -e
ip link set lo up multicast on
ip route add 224.0.0.0/4 dev lo
for i in {interfaces}; do ip link add dev "$i" type vcan; ip link set "$i" up; done
"""


def _kernel_has_can() -> bool:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        return False
    return True


def find_namespace() -> list[str] | None:
    """The command that enters a new network namespace in which vcan interfaces can be made; None if none does."""
    if os.geteuid() == 0 and not _kernel_has_can() and shutil.which("modprobe"):
        # Quiet, and its result does not matter: whether there is CAN now is looked at next.
        subprocess.run(["modprobe", "-qa", "can", "can-raw", "vcan"], stderr=subprocess.DEVNULL, check=False)
    if not _kernel_has_can():
        return None
    for namespace in (["unshare", "-n", "--"], ["unshare", "-Urn", "--"]):
        probe = [*namespace, "sh", "-c", SETUP.format(interfaces="probe0")]
        if subprocess.run(probe, stdin=subprocess.DEVNULL, capture_output=True, check=False).returncode == 0:
            return namespace
    return None


def run(namespace: list[str], options: Options) -> NoReturn:
    """Replaces this process by the command, in the namespace."""
    script = SETUP.format(interfaces=" ".join(options.iface)) + 'exec "$@"\n'
    arguments = [*namespace, "sh", "-c", script, "with-vcan"]
    if options.timeout:
        arguments += ["timeout", "-k", str(options.kill_after), str(options.timeout)]
    arguments += options.command
    os.execvp(arguments[0], arguments)
