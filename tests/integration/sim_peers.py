# SPDX-License-Identifier: MIT
"""canopy-sim as a process, and a controller to talk to it: cantools and autosar-e2e, none of the simulator's code."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import can
import cantools
from cantools.database.can import Database
from e2e.p11 import e2e_p11_check, e2e_p11_protect

from canopy.canbus import open_bus
from integration.processes import OwnedProcess

DBC = Path(__file__).resolve().parents[2] / "examples" / "nao" / "nao.dbc"


TICK_ID = 0x600
TICK = bytes([0, 0x20, 0, 0, 0, 0, 0, 1])
"""A CanopyTick."""


class Simulator(OwnedProcess):
    """The process canopy-sim; ends with the context."""

    def __init__(self, bus: str, *options: str, enter: list[str] | None = None, dbc: Path = DBC) -> None:
        """`enter` goes before the command line, e.g. to start it in another network."""
        command = [sys.executable, "-m", "canopy_sim", "--can", bus, "--dbc", str(dbc), "--json", *options]
        self.process = subprocess.Popen(
            [*(enter or []), *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def wait(self, timeout: float = 30) -> dict[str, Any]:
        """Waits for the end, which must be a good one; gives the summary."""
        out, err = self.process.communicate(timeout=timeout)
        assert self.process.returncode == 0, err
        assert out.count("\n") == 1, out
        summary: dict[str, Any] = json.loads(out)
        return summary

    def end(self, number: signal.Signals = signal.SIGTERM) -> dict[str, Any]:
        """Ends it with a signal; gives the summary."""
        self.process.send_signal(number)
        return self.wait()


class Controller:
    """A participant that commands the robot and looks closely at what it sends."""

    def __init__(self, bus: str) -> None:
        self.bus = open_bus(bus)
        database = cantools.database.load_file(DBC)
        assert isinstance(database, Database)
        self.database = database
        self.sensors: dict[str, dict[str, Any]] = {}
        """Last values by message."""
        self._last_counter: dict[str, int] = {}
        self._counter = {"PowerCommand": 0, "PostureCommand": 0}

    def __enter__(self) -> Controller:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bus.shutdown()

    def receive(self, timeout: float = 5) -> tuple[str, can.Message]:
        """The next frame and the name of its message; checked and remembered."""
        frame = self.bus.recv(timeout)
        assert frame is not None, f"nothing came for {timeout} s"
        return self.look_at(frame), frame

    def look_at(self, frame: can.Message) -> str:
        """Checks a frame of the robot and remembers its values; gives its message's name."""
        message = self.database.get_message_by_frame_id(frame.arbitration_id)
        assert len(frame.data) == message.length
        values: dict[str, Any] = dict(message.decode_simple(bytes(frame.data)))
        if message.name in ("Battery", "Posture"):
            assert e2e_p11_check(frame.data, message.frame_id)
            counter = values["E2E_Counter"]
            if message.name in self._last_counter:
                assert counter == (self._last_counter[message.name] + 1) % 15
            self._last_counter[message.name] = counter
        self.sensors[message.name] = values
        return message.name

    def receive_message(self, name: str, timeout: float = 5) -> can.Message:
        """The next frame of one message."""
        end = time.monotonic() + timeout
        while True:
            found, frame = self.receive(max(end - time.monotonic(), 0.01))
            if found == name:
                return frame

    def receive_for(self, seconds: float) -> list[tuple[str, can.Message]]:
        """All frames of a while."""
        end = time.monotonic() + seconds
        frames = []
        while (left := end - time.monotonic()) > 0:
            frame = self.bus.recv(left)
            if frame is not None:
                frames.append((self.look_at(frame), frame))
        return frames

    def command(self, name: str, mode: int, skip: int = 0) -> can.Message:
        """The next frame of a command, its counter `skip` further than it should be."""
        message = self.database.get_message_by_name(name)
        self._counter[name] = (self._counter[name] + skip) % 15
        data = bytearray([0, self._counter[name], mode])
        self._counter[name] = (self._counter[name] + 1) % 15
        e2e_p11_protect(data, message.frame_id, increment_counter=False)
        return can.Message(arbitration_id=message.frame_id, is_extended_id=False, data=data)

    def send(self, *frames: can.Message) -> None:
        """Sends frames as they are."""
        for frame in frames:
            self.bus.send(frame)

    def answer(self, power: int, posture: int) -> None:
        """Both commands and CanopyTick: one tick of a controller."""
        self.send(self.command("PowerCommand", power), self.command("PostureCommand", posture))
        self.send(can.Message(arbitration_id=TICK_ID, is_extended_id=False, data=TICK))
