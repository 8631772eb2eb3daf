# SPDX-License-Identifier: MIT
"""Runs the real program on a record: a file of frames in, a file of frames out (canopy/clock/replay_files.h)."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import can

from canopy.replay.inputs import Inputs
from canopy.replay.log import Run
from canopy.unixbus import HEADER, REMOTE, decode

BEGIN = b"CANOPY RECORD 2\n"
"""CANOPY_REPLAY_BEGIN."""


class ProgramError(Exception):
    """The program cannot be run on a record; the text says which, why, and the way out."""


def write_record(path: Path, run: Run, inputs: Inputs) -> None:
    """Writes for each tick its time and the state of its bus, and the frames that it took, each with its age.

    The form is that of canopy/clock/replay_files.h; it has nothing to do with the frames of the trace.

    Raises:
        OSError: The file cannot be written.
    """
    with path.open("wb") as file:
        file.write(BEGIN)
        for tick, frames, ages in zip(run.ticks, inputs, inputs.ages, strict=False):
            file.write(tick_item(tick.now, tick.can_state, tick.overload, tick.returning))
            for frame in frames:
                file.write(frame_item(ages[frame.message], frame.datagram))


def tick_item(now: int, can_state: int = 0, overload: bool = False, returning: bool = False) -> bytes:
    """What begins a tick in a record; `now` [us]."""
    return b"T" + now.to_bytes(8, "little") + bytes([can_state, overload | returning << 1])


def frame_item(age: int, datagram: bytes) -> bytes:
    """A frame in a record, of a certain age [ms]."""
    return b"F" + age.to_bytes(2, "little") + datagram


def run_program(program: Path, arguments: tuple[str, ...], record: Path, sent: Path) -> None:
    """Runs `PROGRAM ARGUMENTS --replay RECORD --sent SENT` to its end.

    Raises:
        ProgramError: It cannot be started, or fails.
    """
    command = [str(program.absolute()), *arguments, "--replay", str(record), "--sent", str(sent)]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    except OSError as error:
        raise ProgramError(
            f"{program}: cannot be run: {error.strerror}; build it, or give another --program"
        ) from error
    if done.returncode != 0:
        words = [line for line in done.stderr.decode(errors="replace").splitlines() if line.strip()]
        status = f"status {done.returncode}" if done.returncode > 0 else f"signal {-done.returncode}"
        raise ProgramError(
            f"{program}: ended with {status} on the record: {words[-1] if words else 'it said nothing'}; --keep keeps "
            "the record, to run it by hand"
        )
    if not sent.is_file():
        raise ProgramError(f"{program}: has written no {sent.name}; it must know --replay and --sent (docs/replay.md)")


def read_sent(path: Path) -> Iterator[can.Message]:
    """The frames that the program has sent.

    Raises:
        ProgramError: The file does not hold frames alone.
    """
    data = path.read_bytes()
    place = 0
    while place < len(data):
        header = data[place : place + HEADER.size]
        size = HEADER.size + (0 if len(header) < 3 or header[1] & REMOTE else header[2])
        message = decode(data[place : place + size])
        if message is None:
            raise ProgramError(f"{path}: is damaged from byte {place} on; was the program built with this Canopy?")
        yield message
        place += size
