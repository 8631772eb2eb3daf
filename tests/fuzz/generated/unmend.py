# SPDX-License-Identifier: MIT
"""Takes the mending of known faults out again, to see that the fuzzer finds them."""

from __future__ import annotations

from collections.abc import Callable
from unittest import mock

import canopy.compiler.bus_outputs
import canopy.escape.c_templates
from canopy.escape.c import Code


def _raw(value: object) -> Code:
    return Code(str(value))


def _unlimited(*_: object) -> None:
    return None


UNMEND: dict[str, Callable[[], object]] = {
    # A tree's ID with a line break was C that ran at the program's start.
    "comments": lambda: mock.patch.object(canopy.escape.c_templates, "in_comment", _raw).start(),
    # A cycle time of 65536 periods was a division by zero in the first tick.
    "every": lambda: mock.patch.object(canopy.compiler.bus_outputs, "check_every", _unlimited).start(),
}
"""By the name of the mending."""
