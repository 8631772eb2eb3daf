# SPDX-License-Identifier: MIT
"""`canopy codec` on large DBC files as they are met: no warning, no floating point, no read past a frame."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.bus_reader import read_messages
from integration.codec_harness import BARE_LIBC, ROOT, WARNINGS
from integration.compilers import COMPILERS

FOLDER = Path(__file__).parent / "dbc"
FILES = sorted(FOLDER.glob("*.dbc"))
INCLUDE = f"-I{ROOT / 'runtime' / 'include'}"
SEED = int(os.environ.get("CANOPY_SEED", "20261123"))

# xorshift32: the same frames on each machine. Each buffer has exactly the frame's length, so that the address sanitizer
# sees a byte that is read or written past it.
FUZZ_HEAD = """
#include <stdio.h>
#include <stdlib.h>
static uint32_t state = {seed}u;
static uint32_t next(void)
{{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}}
"""
FUZZ_CASE = """
static unsigned fuzz_{name}(void)
{{
    {name}_t m;
    unsigned taken = 0;

    {name}_init(&m);
    for (unsigned round = 0; round < 3000; round++) {{
        size_t length = round % 4u == 0u ? next() % 72u : {macro}_LENGTH;
        uint8_t *data = malloc(length != 0u ? length : 1u);

        for (size_t place = 0; place < length; place++) {{
            data[place] = (uint8_t)next();
        }}
        taken += {name}_decode(&m, data, length) == CANOPY_CODEC_OK ? 1u : 0u;
        if (length >= {macro}_LENGTH && ({name}_encode(&m, data, length) < 0 ||
                                         {name}_decode(&m, data, {macro}_LENGTH) != CANOPY_CODEC_OK)) {{
            printf("{name}: what was encoded was not taken\\n");
            exit(1);
        }}
        free(data);
    }}
    return taken;
}}
"""


def make_codec(dbc: Path, folder: Path, *options: str) -> Result:
    return CliRunner().invoke(main, ["codec", str(dbc), "-o", str(folder), *options])


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("dbc", FILES, ids=lambda path: path.stem)
def test_it_compiles_without_a_warning(dbc: Path, tmp_path: Path, compiler: str) -> None:
    assert make_codec(dbc, tmp_path).exit_code == 0
    source, target = tmp_path / f"{dbc.stem}_codec.c", tmp_path / "out.o"
    subprocess.run([compiler, *WARNINGS, "-O1", INCLUDE, "-c", source, "-o", target], check=True)


@pytest.mark.parametrize("dbc", FILES, ids=lambda path: path.stem)
def test_on_cortex_m0_it_needs_no_floating_point(dbc: Path, tmp_path: Path) -> None:
    assert make_codec(dbc, tmp_path).exit_code == 0
    source, target = tmp_path / f"{dbc.stem}_codec.c", tmp_path / "out.o"
    arm = ["arm-none-eabi-gcc", "-mcpu=cortex-m0plus", "-mthumb", "-Os", f"-I{BARE_LIBC}"]
    subprocess.run([*arm, *WARNINGS, INCLUDE, "-c", source, "-o", target], check=True)
    needed = subprocess.run(["arm-none-eabi-nm", "-u", target], check=True, capture_output=True, text=True).stdout
    names = [line.split()[-1] for line in needed.splitlines() if line.strip()]
    # Only helpers for switches, shifts and copies; nothing that computes with floats.
    assert all(n.startswith(("__gnu_thumb1_case", "__aeabi_ll", "__aeabi_las", "mem", "__aeabi_mem")) for n in names), (
        names
    )


@pytest.mark.parametrize("dbc", FILES, ids=lambda path: path.stem)
def test_no_frame_makes_it_read_or_write_past_the_end(dbc: Path, tmp_path: Path) -> None:
    assert make_codec(dbc, tmp_path).exit_code == 0
    bus = read_messages(dbc)
    names = [f"{bus.name}_{message.c_name}" for message in bus.messages]
    text = f'#include "{bus.name}_codec.h"' + FUZZ_HEAD.format(seed=SEED or 1)
    text += "".join(FUZZ_CASE.format(name=name, macro=name.upper()) for name in names)
    text += "\nint main(void)\n{\n    unsigned taken = 0;\n" + "".join(f"    taken += fuzz_{n}();\n" for n in names)
    text += '    printf("%u\\n", taken);\n    return 0;\n}\n'
    (tmp_path / "fuzz.c").write_text(text)
    flags = ["-std=c11", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", INCLUDE]
    sources = [tmp_path / "fuzz.c", tmp_path / f"{bus.name}_codec.c"]
    subprocess.run(["gcc", *flags, *sources, "-o", tmp_path / "fuzz"], check=True)
    result = subprocess.run([tmp_path / "fuzz"], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert int(result.stdout) > 0


@pytest.mark.parametrize("dbc", FILES, ids=lambda path: path.stem)
def test_the_same_input_gives_the_same_bytes(dbc: Path, tmp_path: Path) -> None:
    texts = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        assert make_codec(dbc, folder).exit_code == 0
        texts.append({file.name: file.read_bytes() for file in folder.iterdir()})
    assert texts[0] == texts[1]


def test_a_node_gets_what_it_receives_and_sends(tmp_path: Path) -> None:
    dbc = FOLDER / "robot_arm.dbc"
    assert make_codec(dbc, tmp_path, "--node", "Gripper").exit_code == 0
    header = (tmp_path / "robot_arm_codec.h").read_text()
    assert "robot_arm_gripper_parameter_decode" in header and "robot_arm_gripper_parameter_encode" not in header
    assert "joint" not in header


def test_only_the_messages_named(tmp_path: Path) -> None:
    dbc = FOLDER / "chassis.dbc"
    assert make_codec(dbc, tmp_path, "--message", "Clock", "--message", "Wakeup").exit_code == 0
    header = (tmp_path / "chassis_codec.h").read_text()
    assert "chassis_clock_encode" in header and "chassis_wakeup_decode" in header and "wheel" not in header


@pytest.mark.parametrize(
    ("signals", "tail", "texts"),
    [
        ("SG_ A : 0|8@1+ (0,0) [0|0]", "", ["'M.A' has the scale 0"]),
        ("SG_ A : 0|16@1- (1,0) [0|0]", "SIG_VALTYPE_ 1 A : 1;", ["'M.A' is a float of 16 bits"]),
        ("SG_ A : 0|72@1+ (1,0) [0|0]", "", ["'M.A' has 72 bits; at most 64"]),
        ("SG_ A M : 0|8@1- (1,0) [0|0];SG_ C m200 : 8|8@1+ (1,0) [0|0]", "", ["branch 200", "signed", "'M.A'"]),
        ("SG_ A M : 0|2@1+ (1,0) [0|0];SG_ C m4 : 8|8@1+ (1,0) [0|0]", "", ["branch 4", "of 2 bits"]),
        ("SG_ A M : 0|32@1- (1,0) [0|0];SG_ C m4 : 32|8@1+ (1,0) [0|0]", "SIG_VALTYPE_ 1 A : 1;", ["and a float"]),
    ],
)  # fmt: skip
def test_what_cannot_be_compiled_is_named(tmp_path: Path, signals: str, tail: str, texts: list[str]) -> None:
    lines = "".join(f' {line} "" N\n' for line in signals.split(";"))
    (tmp_path / "x.dbc").write_text(f'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: N\n\nBO_ 1 M: 16 N\n{lines}\n{tail}\n')
    result = make_codec(tmp_path / "x.dbc", tmp_path / "out")
    assert result.exit_code == 2, result.output
    assert re.match(rf"{re.escape(str(tmp_path / 'x.dbc'))}(:\d+)?: error: ", result.stderr)
    for text in texts:
        assert text in result.stderr
    assert not (tmp_path / "out").exists()
