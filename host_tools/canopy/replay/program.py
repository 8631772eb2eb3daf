# SPDX-License-Identifier: MIT
"""Runs the real program on a record: a file of frames in, a file of frames out (canopy/clock/replay_files.h)."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can

from canopy.replay.inputs import Inputs
from canopy.replay.log import Bus, Run
from canopy.replay.ticks import Tick
from canopy.unixbus import HEADER, REMOTE, decode, encode


class ProgramError(Exception):
    """The program cannot be run on a record; the text says which, why, and the way out."""


def write_record(path: Path, bus: Bus, run: Run, inputs: Inputs) -> None:
    """Writes for each tick CanopyInputs, the state of the bus, and the frames that it took, each behind its age.

    The form is that of canopy/clock/replay.h.

    Raises:
        OSError: The file cannot be written.
    """
    begin, arrivals = (_message(bus, kind) for kind in ("CanopyInputs", "CanopyArrivals"))
    conditions = 0
    with path.open("wb") as file:
        for tick, frames, ages in zip(run.ticks, inputs, inputs.ages, strict=False):
            file.write(encode(can.Message(**begin, data=tick.inputs)))
            for frame in frames:
                file.write(encode(can.Message(**arrivals, data=_arrival(tick, ages[frame.message]))))
                file.write(frame.datagram)
            if not frames and tick.conditions != conditions:
                file.write(encode(can.Message(**arrivals, data=_arrival(tick, None))))
            conditions = tick.conditions


def _message(bus: Bus, kind: str) -> dict[str, Any]:
    message = next(bus.sent[number] for number, name in bus.trace.items() if name == kind)
    return {"arbitration_id": message.id, "is_extended_id": message.extended}


def _arrival(tick: Tick, age: int | None) -> bytes:
    """CanopyArrivals with the age of the next frame; None: only with the state of the bus."""
    count = 0 if age is None else 1
    return bytes([tick.conditions | count << 4, *(age or 0).to_bytes(2, "little"), 0, 0, 0, 0, tick.number & 0xFF])


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
