# SPDX-License-Identifier: MIT
"""The generated codec against cantools: random messages of every byte order, sign and length, bit for bit."""

from __future__ import annotations

import ctypes
import os
import random
import subprocess
from dataclasses import dataclass
from pathlib import Path

import cantools.database
import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.bus_reader import Bus, Message, read_bus
from canopy.compiler.codec import value_type

ROOT = Path(__file__).parents[2]
SEED = int(os.environ.get("CANOPY_SEED", "20261123"))
MESSAGES = 120
FRAMES = 20

HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: Controller Robot\n\n'
ATTRIBUTES = """
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ SG_ "GenSigInactiveValue" INT -2147483648 2147483647;
BA_DEF_DEF_ "GenMsgCycleTime" 50;
BA_DEF_DEF_ "GenSigInactiveValue" 0;
"""
TREE = """<root BTCPP_format="4"><BehaviorTree ID="T"><Ready/></BehaviorTree>
<TreeNodesModel><Condition ID="Ready"/></TreeNodesModel></root>"""


def _random_signals(rng: random.Random, length: int) -> list[str]:
    """Signal lines that fill a message of `length` bytes with no overlap. A Motorola signal starts at its top bit."""
    free = set(range(8 * length))
    lines: list[str] = []
    wanted = rng.randint(1, 6)
    for number in range(20):
        if len(lines) == wanted:
            break
        bits = min(rng.choice([1, 2, 3, 5, 8, 9, 12, 16, 17, 24, 31, 32, 33, 40, 63, 64]), 8 * length)
        order = rng.choice([0, 1])
        start = rng.randrange(8 * length)
        if order == 1:
            places = list(range(start, start + bits))
        else:
            top = 8 * (start // 8) + 7 - start % 8
            places = [8 * (p // 8) + 7 - p % 8 for p in range(top, top + bits)]
        if not set(places) <= free:
            continue
        free -= set(places)
        sign = rng.choice("+-") if bits > 1 else "+"
        lines.append(f' SG_ Signal{number} : {start}|{bits}@{order}{sign} (0.5,10) [0|0] "" PEER\n')
    return lines


@pytest.fixture(scope="module")
def dbc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rng = random.Random(SEED)
    print(f"seed {SEED} (set CANOPY_SEED to change it)")
    text = HEAD
    for number in range(MESSAGES):
        sender, peer = ("Robot", "Controller") if number % 2 else ("Controller", "Robot")
        length = rng.randint(1, 8)
        signals = _random_signals(rng, length)
        frame_id = (0x80000000 | rng.randrange(0x800, 2**29)) if rng.random() < 0.3 else 0x100 + number
        text += f"BO_ {frame_id} Message{number}: {length} {sender}\n" + "".join(signals).replace("PEER", peer) + "\n"
    path = tmp_path_factory.mktemp("codec") / "random.dbc"
    path.write_text(text + ATTRIBUTES)
    return path


def _harness(bus: Bus) -> str:
    """C functions that reach the codec through arrays of 64-bit raw values."""
    lines = ['#include "random_bus.h"', f"static {bus.name}_input_t in;", f"static {bus.name}_output_t out;"]
    for index, message in enumerate(bus.receive):
        lines += [f"int decode_{message.name}(const uint8_t *data, int64_t *values)", "{"]
        lines += [f"    if (!{bus.name}_bus.rx[{index}].decode(&in, data)) return 0;"]
        lines += [f"    values[{n}] = (int64_t)in.{message.c_name}.{s.c_name};" for n, s in enumerate(message.signals)]
        lines += ["    return 1;", "}"]
    for index, message in enumerate(bus.send):
        lines += [f"void encode_{message.name}(const int64_t *values, uint8_t *data)", "{"]
        lines += [f"    {bus.name}_bus.reset_output(&out);"]
        lines += [
            f"    {bus.name}_set_{message.c_name}_{s.c_name}(&out, ({value_type(s)})values[{n}]);"
            for n, s in enumerate(message.signals)
        ]
        lines += [f"    {bus.name}_bus.tx[{index}].encode(&out, data);", "}"]
    return "\n".join(lines) + "\n"


@dataclass
class Codec:
    """The compiled codec, and the same DBC in cantools."""

    bus: Bus
    database: cantools.database.can.Database
    library: ctypes.CDLL


@pytest.fixture(scope="module")
def codec(dbc: Path) -> Codec:
    folder = dbc.parent
    (folder / "tree.xml").write_text(TREE)
    arguments = [str(folder / "tree.xml"), "--dbc", str(dbc), "--node", "Controller", "--period-ms", "50"]
    result = CliRunner().invoke(main, ["compile", *arguments, "-o", str(folder / "out")])
    assert result.exit_code == 0, result.output
    bus = read_bus(dbc, "Controller", 50)
    (folder / "harness.c").write_text(_harness(bus))
    library = folder / "codec.so"
    flags = [
        "-std=c11",
        "-O1",
        "-g",
        "-shared",
        "-fPIC",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wconversion",
        "-Wsign-conversion",
    ]
    undefined = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
    includes = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{folder / 'out'}"]
    sources = [str(folder / "harness.c"), str(folder / "out" / "random_bus.c")]
    subprocess.run([os.environ.get("CC", "cc"), *flags, *undefined, *includes, *sources, "-o", str(library)], check=True)
    database = cantools.database.load_file(str(dbc))
    assert isinstance(database, cantools.database.can.Database)
    return Codec(bus, database, ctypes.CDLL(str(library)))


def _wrap(value: int) -> int:
    """As a C int64_t."""
    return (value + 2**63) % 2**64 - 2**63


def test_the_random_dbc_covers_what_matters(codec: Codec) -> None:
    signals = [s for m in codec.bus.receive + codec.bus.send for s in m.signals]
    for little, signed in [(True, True), (True, False), (False, True), (False, False)]:
        lengths = {s.length for s in signals if s.little_endian == little and s.signed == signed}
        assert len(lengths) >= 6, (little, signed, lengths)
    assert any(m.extended for m in codec.bus.receive)


def test_decode_takes_the_bits_that_cantools_takes(codec: Codec) -> None:
    rng = random.Random(SEED + 1)
    for message in codec.bus.receive:
        peer = codec.database.get_message_by_name(message.name)
        decode = getattr(codec.library, f"decode_{message.name}")
        for _ in range(FRAMES):
            data = rng.randbytes(message.length)
            values = (ctypes.c_int64 * 8)()
            assert decode(data, values) == 1
            expected = peer.decode(data, scaling=False)
            assert isinstance(expected, dict)
            found = {s.name: values[n] for n, s in enumerate(message.signals)}
            assert found == {name: _wrap(int(str(value))) for name, value in expected.items()}, message


def _random_values(rng: random.Random, message: Message) -> dict[str, int]:
    return {s.name: rng.choice([s.low, s.high, rng.randint(s.low, s.high)]) for s in message.signals}


def test_encode_puts_the_bits_where_cantools_puts_them(codec: Codec) -> None:
    rng = random.Random(SEED + 2)
    for message in codec.bus.send:
        peer = codec.database.get_message_by_name(message.name)
        encode = getattr(codec.library, f"encode_{message.name}")
        for _ in range(FRAMES):
            values = _random_values(rng, message)
            data = (ctypes.c_uint8 * 8)(*[0xFF] * 8)
            encode((ctypes.c_int64 * 8)(*[_wrap(v) for v in values.values()]), data)
            assert bytes(data[: message.length]) == peer.encode(dict(values), scaling=False), (message, values)
