# SPDX-License-Identifier: MIT
"""Logs of a controller's bus, made without a bus: the same in every run, and on every machine.

The real program is fed a record, and what it sends is put between what it took.
"""

from __future__ import annotations

import random
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import can
import cantools
from cantools.database.can import Database
from e2e.p11 import e2e_p11_protect

from canopy.unixbus import HEADER, decode, encode
from integration.sim_peers import DBC

TICK_ID = 0x600
PERIOD_US = 50_000
BUS_STATES = [0] * 12 + [1, 2, 3, 0x08, 0x14, 0x15, 0x10]
"""CanState, Overload, Returning, as in CanopyInputs' byte 5."""
BEGIN = b"CANOPY RECORD 2\n"


@dataclass
class Step:
    """What one tick is given."""

    now: int
    """Its time [us]."""
    frames: list[can.Message]
    ages: dict[int, int] = field(default_factory=dict)
    """Of the frames with an id [ms]; 0 where none is given."""
    conditions: int = 0
    """One of BUS_STATES."""


def frame(identifier: int, data: bytes = b"", **more: bool) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False, channel="can0", **more)


class Robot:
    """Sensor frames of a robot that does what chance says, but with the right counters and CRCs."""

    def __init__(self, seed: int) -> None:
        database = cantools.database.load_file(DBC)
        assert isinstance(database, Database)
        self.random = random.Random(seed)
        self._database = database
        self._counters = {"Battery": 0, "Posture": 0}

    def sensor(self, name: str) -> can.Message:
        """The next frame of a message."""
        rnd = self.random
        values: dict[str, float] = (
            {"Charging": rnd.randint(0, 1), "Level": rnd.randint(0, 1000) / 10, "ChargerDistance": rnd.randint(0, 90)}
            if name == "Battery"
            else {"HeadX": rnd.randint(-100, 500) / 1000, "HeadHeight": rnd.randint(0, 550) / 1000}
        )
        message = self._database.get_message_by_name(name)
        data = bytearray(message.encode({"E2E_CRC": 0, "E2E_Counter": self._counters[name], **values}))
        e2e_p11_protect(data, message.frame_id, increment_counter=False)
        self._counters[name] = (self._counters[name] + 1) % 15
        return frame(message.frame_id, bytes(data))

    def frames_of_a_tick(self, tick: int) -> list[can.Message]:
        """Now and then none for longer than the timeout, a burst, or a frame that is refused."""
        if 60 <= tick % 100 < 75:
            return []
        if tick % 50 == 30:
            return [self.sensor(name) for _ in range(12) for name in ("Battery", "Posture")]
        if tick % 40 == 20:
            return [frame(0x100, b"\x01\x02"), frame(0x110, bytes(8)), frame(0x100, is_remote_frame=True)]
        return [self.sensor(name) for name in ("Battery", "Posture") if self.random.random() < 0.9]


def read_frames(path: Path) -> list[can.Message]:
    """A file of frames, as the program writes and reads them."""
    data, frames = path.read_bytes(), []
    while data:
        size = HEADER.size + (0 if data[1] & 2 else data[2])
        message = decode(data[:size])
        assert message is not None
        frames.append(message)
        data = data[size:]
    return frames


def write_record(path: Path, steps: Sequence[Step]) -> None:
    """A record, as drivers/include/canopy/clock/replay_files.h describes it."""
    record = bytearray(BEGIN)
    for step in steps:
        flags = (step.conditions >> 3 & 1) | (step.conditions >> 4 & 1) << 1
        record += b"T" + step.now.to_bytes(8, "little") + bytes([step.conditions & 7, flags])
        for message in step.frames:
            age = step.ages.get(message.arbitration_id, 0)
            record += b"F" + age.to_bytes(2, "little") + encode(message)
    path.write_bytes(record)


def run_program(program: Path, steps: Sequence[Step], folder: Path) -> list[list[can.Message]]:
    """Gives a program frames, tick by tick; what it sends in each, and behind the last one at its end."""
    record, sent = folder / "made.record", folder / "made.sent"
    write_record(record, steps)
    command = [str(program), "--replay", str(record), "--sent", str(sent)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{len(steps)} ticks replayed" in done.stdout
    result: list[list[can.Message]] = []
    for message in read_frames(sent):
        # PowerCommand is the first frame of a tick.
        if message.arbitration_id == 0x200:
            result.append([])
        result[-1].append(message)
    assert len(result) == len(steps) + 1
    return result


def make_log(
    build_dir: Path, name: str, ticks: int, folder: Path, seed: int = 1, before: int = 50
) -> list[can.Message]:
    """A run of an example, with sensors that were sending long before it began.

    Frames that came late for a tick are in the log before or behind its answer, as chance says.
    """
    robot = Robot(seed)
    log = [robot.sensor(name) for _ in range(before) for name in ("Battery", "Posture")]
    steps: list[Step] = []
    now = 123_456_789_012
    for tick in range(ticks):
        step = Step(now, robot.frames_of_a_tick(tick), conditions=robot.random.choice(BUS_STATES))
        step.ages = {number: robot.random.choice((0, 1, 3, 17, 49, 120, 499, 500, 65535)) for number in (0x100, 0x110)}
        steps.append(step)
        now += PERIOD_US + robot.random.choice((0, 0, 0, 17, 999, 40_000, 3 * PERIOD_US))
    sent = run_program(build_dir / "examples" / "nao" / name, steps, folder)
    late: list[can.Message] = []
    for step, answer in zip(steps, sent, strict=False):
        early = robot.random.randint(0, 1)
        log += late + step.frames[: len(step.frames) - early] + answer
        late = step.frames[len(step.frames) - early :]
    log += late + sent[-1]
    return stamped(log)


def stamped(log: list[can.Message]) -> list[can.Message]:
    """The same log with times and a channel."""
    for number, message in enumerate(log):
        message.timestamp = 1000.0 + number / 1000
        message.channel = "can0"
    return log


def write_log(path: Path, messages: list[can.Message]) -> Path:
    with can.Logger(path) as writer:
        for message in messages:
            writer.on_message_received(message)
    return path
