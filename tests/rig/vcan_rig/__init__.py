# SPDX-License-Identifier: MIT
"""The test rig: a command is run where SocketCAN interfaces exist, in a network namespace or in User-Mode Linux."""

import sys

EXIT_TIMEOUT = 124
EXIT_RIG = 125


class RigError(Exception):
    """The rig cannot do what was asked; the text says why, and what to do."""


def log(text: str) -> None:
    """Prints one line about the rig itself to standard error."""
    print(f"with-vcan: {text}", file=sys.stderr, flush=True)
