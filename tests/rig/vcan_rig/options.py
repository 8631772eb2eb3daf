# SPDX-License-Identifier: MIT
"""What the command line asked for."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Options:
    """The options of with-vcan, named as on the command line. Times in seconds, memory in bytes."""

    command: list[str]
    iface: list[str]
    mode: str
    timeout: float
    kill_after: float
    verbose: bool
    rw: list[Path]
    ro: list[Path]
    hide: str
    as_caller: bool
    stdin: bool
    memory: int
    cpu: str
    boot_timeout: float
    retries: int
    uml: str
    karg: list[str]
    times: bool
