# SPDX-License-Identifier: MIT
"""The generated codecs against cantools: random messages with every feature of a DBC, both ways, bit for bit.

What is in range is judged by what the random DBC was written from, not by what the compiler read.
"""

from __future__ import annotations

import math
import os
import random
import struct
from dataclasses import dataclass
from pathlib import Path

import cantools.database
import pytest
from cantools.database.can import Message as DbcMessage
from cantools.database.errors import DecodeError
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.bus_model import Bus, Message, float_value
from canopy.compiler.bus_reader import read_bus, read_messages
from integration.codec_harness import Library, as_int64, bus_harness, codec_harness, start_build
from integration.random_dbc import RandomMessage, RandomSignal, random_dbc

SEED = int(os.environ.get("CANOPY_SEED", "20261123"))
SHARDS = 4
MESSAGES = 255  # in each shard
BUS_MESSAGES = 120
FRAMES = 20
TREE = """<root BTCPP_format="4"><BehaviorTree ID="T"><Ready/></BehaviorTree>
<TreeNodesModel><Condition ID="Ready"/></TreeNodesModel></root>"""


@dataclass
class Codec:
    """A compiled codec, what its DBC was written from, and the same DBC in cantools."""

    bus: Bus
    written: dict[str, RandomMessage]
    peer: cantools.database.can.Database
    library: Library


def _open(folder: Path, name: str, bus: Bus, written: list[RandomMessage]) -> Codec:
    peer = cantools.database.load_file(str(folder / f"{name}.dbc"))
    assert isinstance(peer, cantools.database.can.Database)
    return Codec(bus, {m.name: m for m in written}, peer, Library(folder / f"{name}.so"))


@pytest.fixture(scope="module")
def codecs(tmp_path_factory: pytest.TempPathFactory) -> list[Codec]:
    """All messages, by `canopy codec`."""
    print(f"seed {SEED} (set CANOPY_SEED to change it)")
    folder = tmp_path_factory.mktemp("codec")
    parts = []
    for shard in range(SHARDS):
        text, written = random_dbc(random.Random(SEED + shard), MESSAGES)
        name = f"random{shard}"
        (folder / f"{name}.dbc").write_text(text)
        result = CliRunner().invoke(main, ["codec", str(folder / f"{name}.dbc"), "-o", str(folder)])
        assert result.exit_code == 0, result.output
        bus = read_messages(folder / f"{name}.dbc")
        (folder / f"{name}_harness.c").write_text(codec_harness(bus))
        sources = [folder / f"{name}_harness.c", folder / f"{name}_codec.c"]
        parts.append((name, bus, written, start_build(folder, sources, folder / f"{name}.so")))
    assert [process.wait() for *_, process in parts] == [0] * SHARDS
    return [_open(folder, name, bus, written) for name, bus, written, _ in parts]


@pytest.fixture(scope="module")
def bus_codec(tmp_path_factory: pytest.TempPathFactory) -> Codec:
    """The images and setters of an application, by `canopy compile`."""
    folder = tmp_path_factory.mktemp("bus")
    text, written = random_dbc(random.Random(SEED + SHARDS), BUS_MESSAGES)
    # A safe value for all that suits all: those of ranges and multiplexers without 0 are mended in the DBC's own way.
    (folder / "random.dbc").write_text(text)
    plain = read_messages(folder / "random.dbc")
    head = 'BA_DEF_DEF_ "GenMsgCycleTime" 50;\n'
    safe = "".join(
        f'BA_ "GenSigInactiveValue" SG_ {m.id | (0x80000000 if m.extended else 0)} {s.name} '
        f"{float_value(s.safe, s.length) if s.is_float else s.safe};\n"
        for m in plain.send
        for s in m.signals
    )
    text = text.replace("INT -2147483648 2147483647", "FLOAT -1e20 1e20")
    last_default = 'BA_DEF_DEF_ "VFrameFormat" "StandardCAN";\n'
    (folder / "random.dbc").write_text(text.replace(last_default, last_default + safe))
    assert head in text
    (folder / "tree.xml").write_text(TREE)
    arguments = [
        str(folder / "tree.xml"),
        "--dbc",
        str(folder / "random.dbc"),
        "--node",
        "Controller",
        "--period-ms",
        "50",
        "--name",
        "random",
        "--foreign-load",  # so many messages leave little to others
        "0",
        "--bitrate",
        "1000000",
    ]
    result = CliRunner().invoke(main, ["compile", *arguments, "-o", str(folder)])
    assert result.exit_code == 0, result.output
    bus = read_bus(folder / "random.dbc", "Controller", 50)
    (folder / "harness.c").write_text(bus_harness(bus))
    assert start_build(folder, [folder / "harness.c", folder / "random_bus.c"], folder / "random.so").wait() == 0
    return _open(folder, "random", bus, written)


def _bits(signal: RandomSignal, value: float) -> int:
    """A float signal's bits, as cantools' number."""
    code = "<f" if signal.kind == "float" else "<d"
    return int.from_bytes(struct.pack(code, value), "little")


def _in_range(signal: RandomSignal, value: float) -> bool:
    if signal.kind != "int":
        return math.isfinite(value) and signal.low <= value <= signal.high
    return signal.low <= value <= signal.high or value in signal.choices


def _expected(peer: DbcMessage, written: RandomMessage, data: bytes) -> dict[str, int] | None:
    """Raw values (floats as bits) of the signals that are in the frame, or None when it is to be refused."""
    try:
        decoded = peer.decode(data, scaling=False, decode_choices=False)
    except DecodeError:
        return None
    assert isinstance(decoded, dict)
    result = {}
    for name, value in decoded.items():
        signal = written.signals[name]
        assert isinstance(value, int | float)
        if not _in_range(signal, value):
            return None
        result[name] = as_int64(int(value)) if signal.kind == "int" else as_int64(_bits(signal, value))
    return result


def _random_raw(rng: random.Random, signal: RandomSignal) -> float:
    """A value in range, often an end of it."""
    if signal.kind == "int":
        ends = int(signal.low), int(signal.high)
        return rng.choice([*ends, rng.randint(*ends), rng.randint(*ends), *signal.choices])
    low, high = (max(-1e30, signal.low), min(1e30, signal.high))
    value = rng.choice([low, high, 0.0, rng.uniform(low, high)])
    return float(struct.unpack("<f", struct.pack("<f", value))[0]) if signal.kind == "float" else value


def _random_values(rng: random.Random, message: Message, written: RandomMessage) -> dict[str, float]:
    """Values of all signals, those of branches that are not selected included."""
    values = {s.name: _random_raw(rng, written.signals[s.name]) for s in message.signals}
    for signal in message.signals:
        if signal.selects:
            low, high = rng.choice(signal.selects)
            values[signal.name] = rng.randint(low, high)
    return values


def _raw(written: RandomMessage, values: dict[str, float]) -> dict[str, int]:
    kinds = written.signals
    return {n: int(v) if kinds[n].kind == "int" else _bits(kinds[n], v) for n, v in values.items()}


def _frames(rng: random.Random, peer: DbcMessage, message: Message, written: RandomMessage) -> list[bytes]:
    """Good frames with random bits where no signal is, and frames of random bytes."""
    result = [rng.randbytes(message.length) for _ in range(FRAMES // 2)]
    for _ in range(FRAMES // 2):
        values = _random_values(rng, message, written)
        result.append(bytes(peer.encode(dict(values), scaling=False, strict=False)).ljust(message.length, b"\0"))
    return result


def _check_decode(codec: Codec, messages: tuple[Message, ...], rng: random.Random) -> tuple[int, int]:
    """(frames taken, frames refused)."""
    taken = refused = 0
    for number, message in enumerate(messages):
        peer, written = codec.peer.get_message_by_name(message.name), codec.written[message.name]
        for data in _frames(rng, peer, message, written):
            expected = _expected(peer, written, data)
            result, found = codec.library.decode(number, message, data)
            assert result == (0 if expected is not None else -2), (message, data.hex(), found)
            if expected is not None:
                assert found == expected, (message, data.hex())
            taken, refused = taken + (expected is not None), refused + (expected is None)
    return taken, refused


def _check_encode(codec: Codec, messages: tuple[Message, ...], rng: random.Random) -> None:
    for number, message in enumerate(messages):
        peer, written = codec.peer.get_message_by_name(message.name), codec.written[message.name]
        for _ in range(FRAMES):
            values = _random_values(rng, message, written)
            limited, data = codec.library.encode(number, message, _raw(written, values))
            expected = bytes(peer.encode(dict(values), scaling=False, strict=False)).ljust(message.length, b"\0")
            if not any(s.is_enum for s in message.signals):
                assert (limited, data) == (0, expected), (message, values)


def test_the_random_dbc_covers_what_matters(codecs: list[Codec]) -> None:
    messages = [m for codec in codecs for m in codec.bus.messages]
    signals = [s for m in messages for s in m.signals]
    assert len(messages) >= 1000
    for little, signed in [(True, True), (True, False), (False, True), (False, False)]:
        lengths = {s.length for s in signals if s.little_endian == little and s.signed == signed}
        assert len(lengths) >= 12, (little, signed, lengths)
    assert {s.c_type for s in signals if s.is_float and s.little_endian} == {"float", "double"}
    assert {s.c_type for s in signals if s.is_float and not s.little_endian} == {"float", "double"}
    assert {m.length for m in messages if m.fd} >= {8, 12, 16, 20, 24, 32, 48, 64}
    assert sum(m.extended for m in messages) > 100
    assert sum(bool(m.multiplexed) for m in messages) > 100
    assert sum(any(len(s.selectors) > 1 for s in m.signals) for m in messages) > 30
    assert sum(any(len(sel.values) > 1 for s in m.signals for sel in s.selectors) for m in messages) > 10
    assert sum(len([s for s in m.signals if s.selects and not s.selectors]) > 1 for m in messages) > 10
    assert any(m.signals == () for m in messages)


def test_decode_takes_the_bits_that_cantools_takes(codecs: list[Codec]) -> None:
    rng = random.Random(SEED + 100)
    counts = [_check_decode(codec, codec.bus.messages, rng) for codec in codecs]
    assert sum(taken for taken, _ in counts) > 4000 and sum(refused for _, refused in counts) > 500, counts


def test_encode_puts_the_bits_where_cantools_puts_them(codecs: list[Codec]) -> None:
    rng = random.Random(SEED + 200)
    for codec in codecs:
        _check_encode(codec, codec.bus.messages, rng)


def test_the_images_of_an_application_have_the_same_bits(bus_codec: Codec) -> None:
    rng = random.Random(SEED + 300)
    taken, refused = _check_decode(bus_codec, bus_codec.bus.receive, rng)
    assert taken > 100 and refused > 50
    _check_encode(bus_codec, bus_codec.bus.send, rng)


def test_what_is_encoded_is_always_taken_by_decode(codecs: list[Codec]) -> None:
    """Whatever stands in the struct: NaN, infinities, values out of range, unknown branches and names."""
    rng = random.Random(SEED + 400)
    limited_messages = 0
    for codec in codecs:
        for number, message in enumerate(codec.bus.messages):
            for _ in range(4):
                special = [0, 2**63 - 1, -(2**63), -1, 0x7F800000, 0xFF800001, 0x7FF0 << 48, 0x80000000]
                values = {s.name: rng.choice([rng.getrandbits(64), *special]) for s in message.signals}
                limited, data = codec.library.encode(number, message, values)
                result, _ = codec.library.decode(number, message, data)
                assert result == 0, (message, values, data.hex())
                limited_messages += limited > 0
    assert limited_messages > 500


def test_another_length_is_refused(codecs: list[Codec]) -> None:
    for number, message in enumerate(codecs[0].bus.messages):
        for length in {message.length - 1, message.length + 1, 0, 255, 256 + message.length} - {message.length, -1}:
            assert codecs[0].library.decode(number, message, bytes(length))[0] == -1
