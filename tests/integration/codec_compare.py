# SPDX-License-Identifier: MIT
"""The codec of any bus description against cantools: random frames and values, in C without undefined behaviour."""

from __future__ import annotations

import logging
import random
import struct
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cantools.database
from cantools.database.can import Message as DbcMessage
from cantools.database.errors import DecodeError
from click.testing import CliRunner

from canopy.bus.cantools_view import cantools_message
from canopy.bus.decode import UndecodableError, raw_values
from canopy.cli import main
from canopy.compiler.bus_model import Bus, Message, Signal, float_value
from canopy.compiler.bus_reader import read_messages
from integration.codec_harness import BYTES_MAX, INCLUDE, WARNINGS, Library, as_int64, codec_harness, start_build


@dataclass
class Comparison:
    """What was compared. `by_cantools`: messages that cantools itself has read from the file."""

    messages: int = 0
    by_cantools: int = 0
    values: int = 0
    wrong: list[str] = field(default_factory=list)


def _peers(path: Path, bus: Bus) -> dict[str, tuple[DbcMessage, bool]]:
    """Each message as cantools has it: read by it where it can read the file, else made from what Canopy has read."""
    logging.getLogger("cantools").setLevel(logging.CRITICAL)
    read: dict[tuple[int, bool, str], DbcMessage] = {}
    try:
        database = cantools.database.load_file(path, strict=False)
        assert isinstance(database, cantools.database.can.Database)
        read = {(m.frame_id, m.is_extended_frame, m.name): m for m in database.messages}
    except Exception:  # cantools lets everything through
        read = {}
    result = {}
    for message in bus.messages:
        written = bus.source.message(message.name)
        found = read.get((written.frame_id, written.is_extended, message.name))
        # One name twice: cantools keeps the last one, whatever the frame says; long names may be no words.
        names = [signal.name for signal in found.signals] if found is not None else []
        if found is None or sorted(names) != sorted(signal.name for signal in message.signals):
            result[message.name] = cantools_message(written), False
        else:
            result[message.name] = found, True
    return result


def _in_range(signal: Signal, value: float) -> bool:
    if signal.is_float:
        low, high = (float_value(bits, signal.length) for bits in (signal.low, signal.high))
        return low <= value <= high
    return any(low <= value <= high for low, high in signal.accepted)


def _bits(signal: Signal, value: float) -> int:
    if not signal.is_float:
        return as_int64(int(value))
    code = "<f" if signal.length == 32 else "<d"
    return as_int64(int.from_bytes(struct.pack(code, value + 0.0), "little"))


def _expected(peer: DbcMessage, message: Message, data: bytes) -> dict[str, int] | None:
    try:
        decoded: Any = peer.decode_simple(data, scaling=False, decode_choices=False)
    except DecodeError as error:
        if "unpacking failed" not in str(error):
            return None
        try:  # cantools cannot take some signals that overlap; the host tools' own decoder can
            decoded = raw_values(message, data)
        except UndecodableError:
            return None
    signals = {signal.name: signal for signal in message.signals}
    if not all(_in_range(signals[name], value) for name, value in decoded.items()):
        return None
    return {name: _bits(signals[name], value) for name, value in decoded.items()}


def _random_values(rng: random.Random, message: Message) -> dict[str, float]:
    values: dict[str, float] = {}
    for signal in message.signals:
        if signal.is_float:
            low, high = (float_value(bits, signal.length) for bits in (signal.low, signal.high))
            value = rng.uniform(max(low, -1e30), min(high, 1e30))
            values[signal.name] = struct.unpack("<f", struct.pack("<f", value))[0] if signal.length == 32 else value
        else:
            low, high = rng.choice(signal.sendable)
            values[signal.name] = rng.choice([low, high, rng.randint(low, high)])
    return values


def compare(path: Path, folder: Path, seed: int, rounds: int = 20, compiler: str = "gcc") -> Comparison:
    """Makes the codec of a file, compiles it with the house's warnings, and compares it."""
    result = Comparison()
    made = CliRunner().invoke(main, ["codec", str(path), "-o", str(folder)])
    assert made.exit_code == 0, made.output
    bus = read_messages(path)
    source = folder / f"{bus.name}_codec.c"
    command = [compiler, *WARNINGS, "-O1", INCLUDE, "-c", str(source), "-o", str(folder / "out.o")]
    subprocess.run(command, check=True)
    (folder / "harness.c").write_text(codec_harness(bus), encoding="utf-8")
    assert start_build(folder, [folder / "harness.c", source], folder / "codec.so").wait() == 0
    library, rng, peers = Library(folder / "codec.so"), random.Random(seed), _peers(path, bus)
    for number, message in enumerate(bus.messages):
        peer, by_cantools = peers[message.name]
        result.messages += 1
        result.by_cantools += by_cantools
        if message.length > BYTES_MAX or len(message.signals) == 0:
            continue
        for _ in range(rounds):
            _compare_decode(result, library, number, message, peer, rng)
            if message.name in bus.sent:
                _compare_encode(result, library, number, message, peer, rng)
    return result


def _compare_decode(
    result: Comparison, library: Library, number: int, message: Message, peer: DbcMessage, rng: random.Random
) -> None:
    data = rng.randbytes(message.length)
    if rng.random() < 0.5:  # random bytes are out of some range nearly always
        try:
            values = _random_values(rng, message)
            data = bytes(peer.encode(dict(values), scaling=False, strict=False)).ljust(message.length, b"\0")
        except Exception:  # an overlap, or a branch that has no value
            data = rng.randbytes(message.length)
    expected = _expected(peer, message, data)
    code, found = library.decode(number, message, data)
    result.values += len(message.signals)
    if code != (0 if expected is not None else -2) or (expected is not None and found != expected):
        result.wrong.append(f"{message.name} {data.hex()}: {expected} and {code} {found}")


def _compare_encode(
    result: Comparison, library: Library, number: int, message: Message, peer: DbcMessage, rng: random.Random
) -> None:
    values = _random_values(rng, message)
    raw = {s.name: _bits(s, values[s.name]) for s in message.signals}
    limited, data = library.encode(number, message, raw)
    expected = bytes(peer.encode(dict(values), scaling=False, strict=False)).ljust(message.length, b"\0")
    result.values += len(message.signals)
    if limited or data != expected:
        result.wrong.append(f"{message.name} {values}: {expected.hex()} and {limited} {data.hex()}")
