# SPDX-License-Identifier: MIT
"""The program can_probe as an object: a C driver driven by hand (tests/integration/can_probe.c)."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType


class CanProbe:
    """A running can_probe. Frames are written as cansend writes them: ``123#1122``."""

    def __init__(self, program: Path, spec: str, *options: str, environment: Mapping[str, str] | None = None) -> None:
        self.process = subprocess.Popen(
            [program, spec, *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._commands = self.process.stdin
        self._answers = self.process.stdout
        try:
            self._answer()
        except BaseException:
            self.process.kill()
            self.close()
            raise

    def _answer(self) -> str:
        line = self._answers.readline()
        if not line:
            assert self.process.stderr is not None
            raise RuntimeError(f"can_probe ended: {self.process.stderr.read()}")
        return line.strip()

    def ask(self, command: str) -> str:
        """Gives a command and returns its answer."""
        self._commands.write(command + "\n")
        self._commands.flush()
        return self._answer()

    def send(self, frame: str) -> int:
        return int(self.ask(f"send {frame}"))

    def receive(self, timeout_ms: int = 5000) -> str:
        """Returns the next frame, ``none`` after the timeout, or the number of an error."""
        return self.ask(f"receive {timeout_ms}")

    def stats(self) -> dict[str, int]:
        return {name: int(value) for name, value in (pair.split("=") for pair in self.ask("stats").split())}

    def close(self) -> int:
        """Ends the program in good order and returns its exit status."""
        self._commands.close()
        status = self.process.wait()
        self._answers.close()
        if self.process.stderr is not None:
            self.process.stderr.close()
        return status

    def __enter__(self) -> CanProbe:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None and kind is not None:
            self.process.kill()
        status = self.close()
        if kind is None:
            assert status == 0
