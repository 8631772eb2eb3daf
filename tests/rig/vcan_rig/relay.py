# SPDX-License-Identifier: MIT
"""While the guest runs: its streams go out, signals go in, and time is watched."""

import os
import selectors
import signal
import time
from dataclasses import dataclass, field

from vcan_rig import EXIT_TIMEOUT, log
from vcan_rig.options import Options

PASSED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
# After the command has ended, the guest has this long to halt [s].
HALT_TIME = 5.0


@dataclass
class Pipes:
    """Pairs of (read end, write end). The guest writes to all but `signals`."""

    out: tuple[int, int] = field(default_factory=os.pipe)
    err: tuple[int, int] = field(default_factory=os.pipe)
    signals: tuple[int, int] = field(default_factory=os.pipe)
    status: tuple[int, int] = field(default_factory=os.pipe)
    messages: tuple[int, int] = field(default_factory=os.pipe)
    guest_ends_open: bool = True

    def guest_ends(self) -> list[int]:
        """What the guest's process inherits."""
        return [self.out[1], self.err[1], self.status[1], self.messages[1], self.signals[0]]

    def close_guest_ends(self) -> None:
        """To be called once the guest has them, so that their end is seen when it is gone."""
        for descriptor in self.guest_ends():
            os.close(descriptor)
        self.guest_ends_open = False

    def close(self) -> None:
        """Closes what is open."""
        if self.guest_ends_open:
            self.close_guest_ends()
        for descriptor in (self.out[0], self.err[0], self.status[0], self.messages[0], self.signals[1]):
            os.close(descriptor)


@dataclass
class Outcome:
    """How a guest's life went. Points in time in seconds since its start."""

    status: int | None = None  # exit status of the command; None: the guest died before it was known
    came_up: bool = False
    messages: bytes = b""  # of the guest's kernel
    up: float = 0.0
    ended: float = 0.0
    halted: float = 0.0

    def times(self) -> str:
        """How long boot, command and halt took, as one line."""
        return (
            f"up {self.up:.2f} s, command {self.ended - self.up:.2f} s, "
            f"halt {self.halted - self.ended:.2f} s, total {self.halted:.2f} s"
        )


def emit(descriptor: int, data: bytes) -> None:
    """Writes all of data; a reader that has gone away is no error."""
    while data:
        try:
            data = data[os.write(descriptor, data) :]
        except BlockingIOError:
            time.sleep(0.005)
        except BrokenPipeError:
            return


class Relay:
    """Serves one guest from its start to its end."""

    def __init__(self, options: Options, pipes: Pipes) -> None:
        self.options = options
        self.pipes = pipes
        self.outcome = Outcome()
        self.start = time.monotonic()
        self.status_text = b""
        self.signals_seen = 0
        self.timed_out = False
        self.term_at: float | None = None
        self.kill_at: float | None = None
        self.give_up_at: float | None = self.start + options.boot_timeout

    def run(self) -> Outcome:
        """Returns when the guest has ended, or has to be killed by the caller."""
        wake_read, wake_write = os.pipe()
        for descriptor in (wake_read, wake_write):
            os.set_blocking(descriptor, False)
        old_wake = signal.set_wakeup_fd(wake_write, warn_on_full_buffer=False)
        old_handlers = {number: signal.signal(number, lambda *_: None) for number in PASSED_ON}
        try:
            self._serve(wake_read)
        finally:
            signal.set_wakeup_fd(old_wake)
            for number, handler in old_handlers.items():
                signal.signal(number, handler)
            os.close(wake_read)
            os.close(wake_write)
        self.outcome.halted = time.monotonic() - self.start
        if self.timed_out:
            self.outcome.status = EXIT_TIMEOUT
        return self.outcome

    def _serve(self, wake: int) -> None:
        selector = selectors.DefaultSelector()
        sinks = {
            self.pipes.out[0]: lambda data: emit(1, data),
            self.pipes.err[0]: lambda data: emit(2, data),
            self.pipes.status[0]: self._on_status,
            self.pipes.messages[0]: self._on_message,
        }
        for descriptor in [*sinks, wake]:
            selector.register(descriptor, selectors.EVENT_READ)
        while sinks and self._watch_time():
            for key, _ in selector.select(0.25):
                data = os.read(key.fd, 65536)
                if key.fd == wake:
                    if not self._on_signals(data):
                        return
                elif data:
                    sinks[key.fd](data)
                else:
                    selector.unregister(key.fd)
                    del sinks[key.fd]

    def _watch_time(self) -> bool:
        """Acts on the points in time that have passed; False when the guest has to be given up."""
        now = time.monotonic()
        if self.term_at is not None and now > self.term_at:
            log(f"the command has run for {self.options.timeout:g} s: SIGTERM")
            self.timed_out, self.term_at, self.kill_at = True, None, now + self.options.kill_after
            self._send(signal.SIGTERM)
        if self.kill_at is not None and now > self.kill_at:
            self.kill_at, self.give_up_at = None, now + self.options.kill_after
            self._send(signal.SIGKILL)
        if self.give_up_at is not None and now > self.give_up_at:
            log("the guest does not stop: it is killed" if self.outcome.came_up else "the guest does not come up")
            return False
        return True

    def _send(self, number: int) -> None:
        os.write(self.pipes.signals[1], signal.Signals(number).name.removeprefix("SIG").encode() + b"\n")

    def _on_signals(self, numbers: bytes) -> bool:
        """Passes signals on to the command; False when the guest shall end now."""
        for number in numbers:
            if number not in PASSED_ON:
                continue
            self.signals_seen += 1
            if self.signals_seen > 2 or not self.outcome.came_up:
                self.outcome.status = 128 + number
                return False
            self._send(number)
            if self.signals_seen == 2:
                self.give_up_at = time.monotonic() + 2 * self.options.kill_after
        return True

    def _on_message(self, data: bytes) -> None:
        self.outcome.messages = (self.outcome.messages + data)[-65536:]
        if self.options.verbose:
            emit(2, data)

    def _on_status(self, data: bytes) -> None:
        *lines, self.status_text = (self.status_text + data).split(b"\n")
        now = time.monotonic()
        for line in lines:
            if line == b"UP":
                self.outcome.came_up, self.outcome.up = True, now - self.start
                self.give_up_at = None
                self.term_at = now + self.options.timeout if self.options.timeout else None
            elif line.startswith(b"RC "):
                self.outcome.status, self.outcome.ended = int(line[3:]), now - self.start
                self.term_at = self.kill_at = None
                self.give_up_at = now + HALT_TIME
            else:
                self.outcome.messages += b"\n[with-vcan's guest: " + line + b"]\n"
