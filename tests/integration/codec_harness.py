# SPDX-License-Identifier: MIT
"""Generated codecs as shared libraries, reached through arrays of 64-bit raw values."""

from __future__ import annotations

import ctypes
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

from canopy.compiler.bus_model import Bus, Message, Signal

ROOT = Path(__file__).parents[2]
_FLAGS = """
-std=c11 -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wundef -Wswitch-enum -Wdouble-promotion -Wcast-align
-Wmissing-prototypes -Wvla -Wtype-limits -Werror -Werror=overflow
"""
WARNINGS = _FLAGS.split()
# The Arm compiler comes without a C library: the firmware tests' string.h, for memcpy and its like.
BARE_LIBC = ROOT / "tests" / "firmware" / "support" / "libc"
INCLUDE = f"-I{ROOT / 'runtime' / 'include'}"
VALUES_MAX = 2048
BYTES_MAX = 1785


def as_int64(value: int) -> int:
    """The C int64_t with the same low 64 bits."""
    return (value + 2**63) % 2**64 - 2**63


def _get(signal: Signal, member: str) -> str:
    return f"(int64_t)canopy_float{signal.length}_bits({member})" if signal.is_float else f"(int64_t){member}"


def _set(signal: Signal, value: str) -> str:
    if signal.is_float:
        return f"canopy_float{signal.length}_value((uint{signal.length}_t){value})"
    return f"({signal.c_type}){value}"


def codec_harness(bus: Bus) -> str:
    """decode_N(data, length, values, has) and encode_N(values, data, size) for the N-th message of a codec."""
    lines = [f'#include "{bus.name}_codec.h"']
    for number, message in enumerate(bus.messages):
        name = f"{bus.name}_{message.c_name}"
        lines += [f"int decode_{number}(const uint8_t *data, size_t length, int64_t *values, bool *has)", "{"]
        lines += [f"    static {name}_t m;", f"    int result = {name}_decode(&m, data, length);"]
        lines += ["    (void)values;", "    (void)has;"]
        for place, signal in enumerate(message.signals):
            lines += [f"    values[{place}] = {_get(signal, f'm.{signal.c_name}')};"]
            lines += [f"    has[{place}] = {f'm.{signal.has_name}' if signal.has_name else 'true'};"]
        lines += ["    return result;", "}"]
        if message.name not in bus.sent:
            continue
        lines += [f"int encode_{number}(const int64_t *values, uint8_t *data, size_t size)", "{"]
        lines += [f"    {name}_t m;", f"    {name}_init(&m);", "    (void)values;"]
        for place, signal in enumerate(message.signals):
            lines += [f"    m.{signal.c_name} = {_set(signal, f'values[{place}]')};"]
        lines += [f"    return {name}_encode(&m, data, size);", "}"]
    return "\n".join(lines) + "\n"


def _setter(bus: Bus, message: Message, signal: Signal, value: str) -> str:
    name = f"{message.c_name}_{signal.c_name}"
    kinds = {"float": "float", "double": "double"}
    if signal.is_float:
        argument = f"canopy_float{signal.length}_value((uint{signal.length}_t){value})"
    elif signal.is_enum:
        argument = f"({bus.name}_{name}_t){value}"
    else:
        low, high = signal.limits
        small = low >= -(2**31) and high < 2**31
        argument = (
            f"({kinds.get(signal.c_type, 'int32_t' if small else 'int64_t' if high < 2**63 else 'uint64_t')}){value}"
        )
    return f"    {bus.name}_set_{name}(&out, {argument});"


def bus_harness(bus: Bus) -> str:
    """The same functions for an application's bus: decode_N of bus.receive, encode_N of bus.send."""
    lines = [f'#include "{bus.name}_bus.h"', f"static {bus.name}_input_t in;", f"static {bus.name}_output_t out;"]
    for number, message in enumerate(bus.receive):
        lines += [f"int decode_{number}(const uint8_t *data, size_t length, int64_t *values, bool *has)", "{"]
        lines += [f"    bool good = {bus.name}_bus.rx[{number}].decode(&in, data);", "    (void)length;"]
        lines += ["    (void)values;", "    (void)has;"]
        for place, signal in enumerate(message.signals):
            member = f"in.{message.c_name}"
            lines += [f"    values[{place}] = {_get(signal, f'{member}.{signal.c_name}')};"]
            lines += [f"    has[{place}] = {f'{member}.{signal.has_name}' if signal.has_name else 'true'};"]
        # Stale: the flags of multiplexed signals are false again before the next frame.
        lines += [
            f"    {bus.name}_bus.rx[{number}].set_age(&in, false, CANOPY_AGE_MAX);",
            "    return good ? 0 : -2;",
            "}",
        ]
    for number, message in enumerate(bus.send):
        lines += [f"int encode_{number}(const int64_t *values, uint8_t *data, size_t size)", "{", "    (void)size;"]
        lines += ["    (void)values;", f"    {bus.name}_bus.reset_output(&out);", "    out.saturated = 0;"]
        lines += [_setter(bus, message, signal, f"values[{place}]") for place, signal in enumerate(message.signals)]
        lines += [f"    {bus.name}_bus.tx[{number}].encode(&out, data);", "    return (int)out.saturated;", "}"]
    return "\n".join(lines) + "\n"


def start_build(folder: Path, sources: Sequence[Path], library: Path, *flags: str) -> subprocess.Popen[bytes]:
    """Starts the compiler; undefined behaviour traps in what it makes."""
    options = [*WARNINGS, "-O0", "-shared", "-fPIC", "-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
    folders = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{folder}"]
    command = [os.environ.get("CC", "cc"), *options, "-Wno-missing-prototypes", *folders, *flags]
    return subprocess.Popen([*command, *map(str, sources), "-o", str(library)])


class Library:
    """The functions of a built harness."""

    def __init__(self, path: Path) -> None:
        self._library = ctypes.CDLL(str(path))
        self._values = (ctypes.c_int64 * VALUES_MAX)()
        self._has = (ctypes.c_bool * VALUES_MAX)()
        self._data = (ctypes.c_uint8 * BYTES_MAX)()

    def decode(self, number: int, message: Message, data: bytes) -> tuple[int, dict[str, int]]:
        """(result, raw value of each signal that is there, by its name in the DBC)."""
        result = getattr(self._library, f"decode_{number}")(data, ctypes.c_size_t(len(data)), self._values, self._has)
        present = {s.name: self._values[n] for n, s in enumerate(message.signals) if self._has[n]}
        return result, present

    def encode(self, number: int, message: Message, values: dict[str, int]) -> tuple[int, bytes]:
        """(how many values were limited, the frame). What `values` does not have is 0."""
        for place, signal in enumerate(message.signals):
            self._values[place] = as_int64(values.get(signal.name, 0))
        self._data[:] = [0xA5] * BYTES_MAX
        result = getattr(self._library, f"encode_{number}")(self._values, self._data, ctypes.c_size_t(BYTES_MAX))
        return result, bytes(self._data[: message.length])
