# SPDX-License-Identifier: MIT
"""Physical values in C: fixed point against exact fractions, doubles against fractions and cantools."""

from __future__ import annotations

import random
import subprocess
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.bus.cantools_view import cantools_message
from canopy.cli import main
from canopy.compiler.bus_model import Signal
from canopy.compiler.bus_reader import read_messages
from canopy.compiler.codec import fixed_point, number, value_type
from integration.codec_harness import INCLUDE, WARNINGS

FOLDER = Path(__file__).parent / "dbc"
OWN = """VERSION ""
BU_: A
BO_ 1 M: 8 A
 SG_ speed : 0|16@1+ (0.01,-40) [0|600] "m/s" A
 SG_ speed_physical : 16|8@1- (0.5,0) [0|0] "" A
 SG_ neg : 24|12@1- (-0.5,3.25) [-10|10] "" A
 SG_ third : 36|20@1+ (0.333333,1e-3) [0|0] "" A
BO_ 2 N: 8 A
 SG_ wide : 0|48@1- (0.001,7) [0|0] "" A
BO_ 3 O: 8 A
 SG_ tiny : 0|32@1+ (1E-07,-100) [0|0] "deg" A
 SG_ coarse : 32|16@1- (250,-1000000) [0|0] "" A
BO_ 4 P: 8 A
 SG_ huge : 0|64@1+ (0.1,0) [0|0] "" A
"""
HARNESS = """
#include <inttypes.h>
#include <stdio.h>
#include "{name}_codec.h"
int main(void)
{{
{lines}    return 0;
}}
"""


def raws(rng: random.Random, signal: Signal) -> list[int]:
    low, high = signal.limits
    ends = [low, low + 1, high, high - 1, signal.low, signal.high, 0 if low <= 0 <= high else low]
    return [raw for raw in (*ends, *(rng.randint(low, high) for _ in range(20))) if low <= raw <= high]


def nearest(signal: Signal, physical: Fraction) -> int:
    """Halves away from 0, limited to the range."""
    exact = (physical - Fraction(signal.offset)) / Fraction(signal.scale)
    rounded = int(abs(exact) + Fraction(1, 2)) * (1 if exact >= 0 else -1)
    return max(signal.low, min(signal.high, rounded))


@pytest.mark.parametrize("name", ["own", *(path.stem for path in sorted(FOLDER.glob("*.dbc")))])
def test_physical_values(tmp_path: Path, name: str) -> None:
    path = tmp_path / f"{name}.dbc"
    path.write_text(OWN if name == "own" else (FOLDER / f"{name}.dbc").read_text())
    assert CliRunner().invoke(main, ["codec", str(path), "-o", str(tmp_path)]).exit_code == 0
    bus, rng = read_messages(path), random.Random(20261130)
    lines, wanted = [], []
    for message in bus.messages:
        peer = cantools_message(bus.source.message(message.name))
        for signal in message.signals:
            fixed = fixed_point(signal)
            if fixed is None or signal.is_float:
                continue
            stem = f"{bus.name}_{message.c_name}_{signal.c_name}"
            for raw in raws(rng, signal):
                exact = raw * Fraction(signal.scale) + Fraction(signal.offset)
                whole = exact * fixed.per_unit
                assert whole.denominator == 1
                other = int(whole) + rng.randint(-abs(fixed.step), abs(fixed.step))
                other = max(-(2**31) + 1, min(2**31 - 1, other)) if fixed.c_type == "int32_t" else other
                text = number(raw, value_type(signal))
                lines.append(
                    f'    printf("%" PRId64 " %" PRId64 " %" PRId64 " %.17g\\n", (int64_t){stem}_fixed({text}), '
                    f"(int64_t){stem}_from_fixed({number(int(whole), fixed.c_type)}), "
                    f"(int64_t){stem}_from_fixed({number(other, fixed.c_type)}), {stem.upper()}_PHYSICAL({text}));\n"
                )
                by_cantools = peer.get_signal_by_name(signal.name).conversion.raw_to_scaled(raw, decode_choices=False)
                assert isinstance(by_cantools, (int, float))
                wanted.append(
                    (
                        int(whole),
                        nearest(signal, exact),
                        nearest(signal, Fraction(other, fixed.per_unit)),
                        exact,
                        by_cantools,
                    )
                )
    (tmp_path / "main.c").write_text(HARNESS.format(name=bus.name, lines="".join(lines)))
    command = [
        "gcc",
        "-std=c11",
        *WARNINGS,
        "-fsanitize=undefined",
        "-fno-sanitize-recover=all",
        INCLUDE,
        f"-I{tmp_path}",
    ]
    subprocess.run([*command, tmp_path / "main.c", "-o", tmp_path / "main"], check=True)
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(done) == len(wanted)
    for line, (whole_, raw, other, physical, by_cantools) in zip(done, wanted, strict=True):
        found = line.split()
        assert [int(part) for part in found[:3]] == [whole_, raw, other], line
        assert abs(Fraction(float(found[3])) - physical) <= abs(physical) * Fraction(2, 2**53), (line, float(physical))
        assert float(found[3]) == pytest.approx(float(by_cantools), rel=1e-12, abs=1e-9)


def test_what_no_integer_holds_has_no_fixed_point(tmp_path: Path) -> None:
    (tmp_path / "own.dbc").write_text(OWN)
    signals = {s.name: s for m in read_messages(tmp_path / "own.dbc").messages for s in m.signals}
    assert fixed_point(signals["huge"]) is None
    fixed = fixed_point(signals["tiny"])
    assert fixed is not None and (fixed.per_unit, fixed.step, fixed.offset, fixed.c_type) == (
        10**7,
        1,
        -(10**9),
        "int64_t",
    )
