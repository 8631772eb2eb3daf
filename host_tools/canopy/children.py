# SPDX-License-Identifier: MIT
"""Programs that run beside this one, and never longer: each is ended by its own process id, whatever happens."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path
from types import TracebackType

_END_S = 5.0


class ChildError(Exception):
    """A program could not be started or has ended by itself; the text holds its last words."""


class Children:
    """A context: what is started in it has ended after it. Output goes to files in `folder`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._running: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> Children:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for name in reversed(list(self._running)):
            self.end(name)

    def start(self, name: str, argv: list[str]) -> None:
        """Starts a program.

        Raises:
            ChildError: It cannot be started.
        """
        with self._file(name, "out").open("wb") as out, self._file(name, "err").open("wb") as err:
            try:
                # A session of its own: Ctrl-C reaches this program alone, which then ends the others in their order.
                self._running[name] = subprocess.Popen(
                    argv, stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True
                )
            except OSError as error:
                raise ChildError(f"{name}: cannot start {argv[0]}: {error.strerror}") from error

    def check(self) -> None:
        """Looks after all that run.

        Raises:
            ChildError: One has ended by itself.
        """
        for name, process in self._running.items():
            if process.poll() is not None:
                raise ChildError(f"{name} ended by itself, with status {process.returncode}: {self.last_words(name)}")

    def end(self, name: str) -> str:
        """Ends a program with SIGINT, and with SIGKILL if that does not help; returns what it wrote to stdout."""
        process = self._running.pop(name)
        process.send_signal(signal.SIGINT)  # does nothing once the process has been waited for
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        return self._file(name, "out").read_text(encoding="utf-8", errors="replace")

    def last_words(self, name: str) -> str:
        """The last line the program wrote, to stderr if it wrote any there."""
        for stream in ("err", "out"):
            lines = self._file(name, stream).read_text(encoding="utf-8", errors="replace").split("\n")
            if words := [line.strip() for line in lines if line.strip()]:
                return words[-1]
        return "it said nothing"

    def _file(self, name: str, stream: str) -> Path:
        return self._folder / f"{name}.{stream}"
