# SPDX-License-Identifier: MIT
"""Scripts: random expressions, compiled to C and run, against exact arithmetic in Python. Undefined behaviour traps."""

from __future__ import annotations

import ctypes
import operator
import os
import random
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.blackboard import Blackboard, Entry, Use
from canopy.compiler.bus_reader import read_bus
from canopy.compiler.errors import Place
from canopy.compiler.port_types import Options, read_type
from canopy.compiler.script.compile import Compiler, Texts
from canopy.compiler.script.syntax import ScriptError, parse

ROOT = Path(__file__).parents[2]
DBC = ROOT / "tests" / "unit" / "language" / "language.dbc"
SEED = int(os.environ.get("CANOPY_SEED", "20261123"))
SCRIPTS = 250
INPUTS = 40

# Entries by name. Fractions are only made of the narrow ones, so that few expressions need more than 64 bits.
ENTRIES = {"a": "int8_t", "b": "uint16_t", "c": "int32_t", "d": "uint32_t", "e": "int64_t", "f": "bool"}
NARROW = ("a", "b", "c")
FIXED = {"g": "int16_t*0.25", "h": "uint8_t/5", "k": "int32_t*2.5"}  # raw values, as in C
KINDS = ENTRIES | FIXED
STEPS = {"g": Fraction(1, 4), "h": Fraction(1, 5), "k": Fraction(5, 2)}
SIGNAL = "Climate.Temperature"  # 16 bits, signed, 0.5 degC a bit, offset 10

Values = dict[str, int]
Meaning = Callable[[Values], Fraction]

# Random scripts do compare b * d with d * b.
WARNINGS = [
    *("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef", "-Wswitch-enum", "-Wcast-align"),
    *("-Wdouble-promotion", "-Wmissing-prototypes", "-Wvla", "-Werror", "-Wno-tautological-compare"),
]


def _saturated(value: Fraction) -> Fraction:
    if value.denominator != 1:
        return value
    return max(Fraction(-(2**63)), min(Fraction(2**63 - 1), value))


@dataclass(frozen=True)
class Sample:
    """A script's expression, and what it means."""

    text: str
    meaning: Meaning
    constant: bool = False


def _entry(name: str) -> Sample:
    return Sample(name, lambda values: Fraction(values[name]))


def _fixed(name: str) -> Sample:
    return Sample(name, lambda values: values[name] * STEPS[name])


def _signal() -> Sample:
    return Sample(SIGNAL, lambda values: Fraction(values["raw"], 2) + 10)


def _constant(rng: random.Random, *, whole: bool) -> Sample:
    whole_numbers: list[int | float] = [0, 1, 2, 3, 7, 100, 255, 65536, 2147483647, 4294967296]
    value = rng.choice(whole_numbers if whole else [0.5, 0.25, 1.5, 20.25])
    text = hex(value) if isinstance(value, int) and rng.random() < 0.2 else str(value)
    return Sample(text, lambda _: Fraction(value), constant=True)


def _math(left: Sample, sign: str, right: Sample) -> Sample:
    function = {"+": operator.add, "-": operator.sub, "*": operator.mul}[sign]
    constant = left.constant and right.constant  # computed by the compiler, exactly
    return Sample(
        f"({left.text} {sign} {right.text})",
        lambda values: (lambda value: value if constant else _saturated(value))(
            function(left.meaning(values), right.meaning(values))
        ),
        constant,
    )


def _bits(left: Sample, sign: str, right: Sample) -> Sample:
    function = {"&": operator.and_, "|": operator.or_, "^": operator.xor}[sign]
    return Sample(
        f"({left.text} {sign} {right.text})",
        lambda values: Fraction(function(int(left.meaning(values)), int(right.meaning(values)))),
    )


def _whole(rng: random.Random, depth: int) -> Sample:
    """A whole number."""
    kind = rng.random()
    if depth == 0 or kind < 0.2:
        return _constant(rng, whole=True) if rng.random() < 0.3 else _entry(rng.choice(list(ENTRIES)))
    if kind < 0.6:
        return _math(_whole(rng, depth - 1), rng.choice("+-*"), _whole(rng, depth - 1))
    if kind < 0.75:
        return _bits(_whole(rng, depth - 1), rng.choice("&|^"), _whole(rng, depth - 1))
    inner = _whole(rng, depth - 1)
    if kind < 0.82:
        return Sample(f"-{inner.text}", lambda values: _saturated(-inner.meaning(values)), inner.constant)
    if kind < 0.88:
        return Sample(f"~{inner.text}", lambda values: Fraction(~int(inner.meaning(values))))
    condition, other = _truth(rng, depth - 1), _whole(rng, depth - 1)
    return Sample(
        f"({condition.text} ? {inner.text} : {other.text})",
        lambda values: inner.meaning(values) if condition.meaning(values) else other.meaning(values),
    )


def _fraction(rng: random.Random, depth: int) -> Sample:
    """A number with a step of its own."""
    if depth == 0:
        leaf = _signal() if rng.random() < 0.3 else _entry(rng.choice(NARROW))
        leaf = _fixed(rng.choice(list(FIXED))) if rng.random() < 0.4 else leaf
        return _math(leaf, rng.choice("+-*"), _constant(rng, whole=rng.random() < 0.2))
    if rng.random() < 0.2:
        inner = _fraction(rng, depth - 1)
        divisor = rng.choice([2, 3, 5, 10])
        return Sample(f"({inner.text} / {divisor})", lambda values: inner.meaning(values) / divisor)
    return _math(_fraction(rng, depth - 1), rng.choice("+-"), _fraction(rng, depth - 1))


def _truth(rng: random.Random, depth: int) -> Sample:
    """A condition."""
    kind = rng.random()
    if depth > 0 and kind < 0.3:
        left, right = _truth(rng, depth - 1), _truth(rng, depth - 1)
        if rng.random() < 0.5:
            return Sample(
                f"({left.text} && {right.text})", lambda v: Fraction(bool(left.meaning(v) and right.meaning(v)))
            )
        return Sample(f"({left.text} || {right.text})", lambda v: Fraction(bool(left.meaning(v) or right.meaning(v))))
    if depth > 0 and kind < 0.4:
        inner = _truth(rng, depth - 1)
        return Sample(f"!{inner.text}", lambda values: Fraction(not inner.meaning(values)))
    make = _fraction if rng.random() < 0.4 else _whole
    parts = [make(rng, min(depth, 1)) for _ in range(rng.choice([2, 2, 2, 3]))]
    signs = [rng.choice(["<", "<=", ">", ">=", "==", "!="]) for _ in parts[1:]]
    text = parts[0].text + "".join(f" {s} {p.text}" for s, p in zip(signs, parts[1:], strict=True))
    compare = {
        "<": operator.lt,
        "<=": operator.le,
        ">": operator.gt,
        ">=": operator.ge,
        "==": operator.eq,
        "!=": operator.ne,
    }

    def meaning(values: Values) -> Fraction:
        numbers = [part.meaning(values) for part in parts]
        return Fraction(all(compare[s](a, b) for s, (a, b) in zip(signs, pairwise(numbers), strict=True)))

    return Sample(f"({text})", meaning)


def _compiler() -> Compiler:
    board = Blackboard()
    for name, kind in KINDS.items():
        target = board.main.resolve(name, Place("x"))
        assert isinstance(target, Entry)
        target.connect(Use(read_type(kind, "test", Place("x"), Options()), Place("x"), "test", True))
        target.settle_type()
    return Compiler(board.main, Place("x"), read_bus(DBC, "Controller", 10), Texts(), floats=False)


# What random scripts have found.
ONCE_WRONG = [Sample("((7 | a) > 255)", lambda values: Fraction((7 | values["a"]) > 255))]


@pytest.fixture(scope="module")
def samples() -> list[Sample]:
    """Random scripts, without those that are refused: the reasons for that are few, and named."""
    print(f"seed {SEED} (set CANOPY_SEED to change it)")
    rng = random.Random(SEED)
    compiler = _compiler()
    kept = list(ONCE_WRONG)
    refused = 0
    while len(kept) < SCRIPTS:
        sample = _whole(rng, 3) if rng.random() < 0.5 else _truth(rng, 3)
        try:
            compiler.evaluate(parse(sample.text)[0])
        except ScriptError as error:
            assert any(reason in error.message for reason in ("64 bits", "can never be equal", "whole numbers")), (
                sample.text
            )
            refused += 1
            continue
        kept.append(sample)
    assert refused < SCRIPTS
    return kept


TREE = """<root BTCPP_format="4" main_tree_to_execute="T">
<BehaviorTree ID="T"><Sequence>{nodes}</Sequence></BehaviorTree>
<TreeNodesModel><SubTree ID="T">{ports}</SubTree></TreeNodesModel></root>"""

HARNESS = """
#include "scripts_app.h"
void set_inputs(const int64_t *values, int16_t raw);
int64_t run(int script);
void set_inputs(const int64_t *values, int16_t raw)
{{
{setters}
    scripts_input->climate.temperature = raw;
    scripts_input->climate.fresh = true;
}}
int64_t run(int script)
{{
    (void)scripts_app.tree->scripts[scripts_app.tree->nodes[script + 1].parameter](scripts_app.memory);
    return scripts_entries->result;
}}
"""


def _escape(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


@pytest.fixture(scope="module")
def library(samples: list[Sample], tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("scripts")
    nodes = "".join(f'\n<Script code="{_escape(f"result := {sample.text}")}"/>' for sample in samples)
    types = KINDS | {"result": "int64_t"}
    ports = "".join(f'<input_port name="{name}" type="{kind}" default="0"/>' for name, kind in types.items())
    (folder / "scripts.xml").write_text(TREE.format(nodes=nodes, ports=ports))
    arguments = ["compile", str(folder / "scripts.xml"), "--dbc", str(DBC), "--node", "Controller", "--period-ms", "10"]
    result = CliRunner().invoke(main, [*arguments, "-o", str(folder)])
    assert result.exit_code == 0, result.output
    setters = "\n".join(
        f"    scripts_entries->{name} = ({kind.partition('*')[0].partition('/')[0]})values[{index}];"
        for index, (name, kind) in enumerate(KINDS.items())
    )
    (folder / "harness.c").write_text(HARNESS.format(setters=setters))
    flags = [
        "-std=c11",
        "-O1",
        "-fPIC",
        "-shared",
        "-fsanitize=undefined",
        "-fsanitize-undefined-trap-on-error",
        *WARNINGS,
    ]
    sources = [folder / "harness.c", *folder.glob("*_app.c"), *folder.glob("*_bus.c")]
    runtime = ROOT / "runtime"
    library = folder / "scripts.so"
    subprocess.run(
        ["gcc", *flags, "-I", str(runtime / "include"), "-I", str(folder), *map(str, sources), "-o", str(library)],
        check=True,
    )
    loaded = ctypes.CDLL(str(library))
    loaded.run.restype = ctypes.c_int64
    return loaded


def _random_inputs(rng: random.Random) -> Values:
    values = {}
    for name, kind in KINDS.items():
        port_type = read_type(kind, "test", Place("x"), Options())
        low, high = port_type.low, port_type.high
        edges = [low, high, 0, min(1, high), (low + high) // 2]
        values[name] = rng.choice(edges) if rng.random() < 0.5 else rng.randint(low, high)
    values["raw"] = rng.choice([-32768, 32767, 0, 1, 20, rng.randint(-32768, 32767)])
    return values


def test_random_scripts_give_what_exact_arithmetic_gives(samples: list[Sample], library: ctypes.CDLL) -> None:
    rng = random.Random(SEED + 1)
    for _ in range(INPUTS):
        values = _random_inputs(rng)
        numbers = (ctypes.c_int64 * len(KINDS))(*(values[name] for name in KINDS))
        library.set_inputs(numbers, ctypes.c_int16(values["raw"]))
        for index, sample in enumerate(samples):
            assert library.run(index) == _saturated(sample.meaning(values)), (sample.text, values)
