# SPDX-License-Identifier: MIT
"""Processes that a test starts and that must not outlive it."""

from __future__ import annotations

import subprocess
from typing import TypeVar

Owned = TypeVar("Owned", bound="OwnedProcess")


class OwnedProcess:
    """A process whose output is read; killed, if it still runs, when the context ends."""

    process: subprocess.Popen[str]

    def __enter__(self: Owned) -> Owned:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()
