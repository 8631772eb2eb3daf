# SPDX-License-Identifier: MIT
"""Claims in steps of the DBC and in binary32: rounded borders against rounding, and what differs in the examples."""

from __future__ import annotations

import json
import random
import struct
from fractions import Fraction
from math import floor
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.errors import CompileError
from canopy.verify.arithmetic import BINARY32, SIGNALS, Binary32, Border, Steps, rounded
from canopy.verify.checks import signal_of
from canopy.verify.linear import Formula, State
from canopy.verify.model import Plant
from canopy.verify.run import Subject, in_arithmetic, load, verify

NAO = Path(__file__).parents[2] / "examples" / "nao"
TREES = ("get_home", "power_supply")


def subject_of(name: str) -> Subject:
    return load(NAO / "trees" / f"{name}.xml", NAO / "trees" / f"{name}.plant.toml", NAO / "nao.dbc", "Controller")


def binary32(value: Fraction) -> Fraction:
    """The machine's own rounding, of a number that a double holds exactly."""
    assert Fraction(float(value)) == value
    (nearest,) = struct.unpack("<f", struct.pack("<f", float(value)))
    return Fraction(nearest)


def in_steps(value: Fraction, step: Fraction, offset: Fraction) -> Fraction:
    return floor((value - offset) / step + Fraction(1, 2)) * step + offset


def is_below(border: Border, value: Fraction) -> bool:
    return value < border.bound or (value == border.bound and not border.strict)


def is_above(border: Border, value: Fraction) -> bool:
    return value > border.bound or (value == border.bound and not border.strict)


def test_borders_of_steps_are_where_rounding_changes() -> None:
    chance = random.Random(1)
    for _ in range(2000):
        step, offset = Fraction(chance.randint(1, 40), 20), Fraction(chance.randint(-30, 30), 4)
        constant, value = Fraction(chance.randint(-400, 400), 40), Fraction(chance.randint(-1600, 1600), 160)
        steps, near = Steps(step, offset), in_steps(value, step, offset)
        assert is_below(steps.below(constant, strict=True), value) == (near < constant)
        assert is_below(steps.below(constant, strict=False), value) == (near <= constant)
        assert is_above(steps.above(constant, strict=True), value) == (near > constant)
        assert is_above(steps.above(constant, strict=False), value) == (near >= constant)


def test_borders_of_binary32_are_where_rounding_changes() -> None:
    chance = random.Random(2)
    at_border = 0
    for _ in range(4000):
        constant = Fraction(chance.randint(-1000, 1000), 100)
        near = binary32(Fraction(float(constant)))
        spacing = Fraction(1, 2 ** chance.randint(22, 40))
        value = near + chance.randint(-6, 6) * spacing
        arithmetic, rounded_value = Binary32(Fraction(100)), binary32(value)
        assert is_below(arithmetic.below(constant, strict=True), value) == (rounded_value < near)
        assert is_below(arithmetic.below(constant, strict=False), value) == (rounded_value <= near)
        assert is_above(arithmetic.above(constant, strict=True), value) == (rounded_value > near)
        assert is_above(arithmetic.above(constant, strict=False), value) == (rounded_value >= near)
        at_border += value in (arithmetic.below(constant, strict=s).bound for s in (True, False))
    assert at_border > 50


def rounded_state(subject: Subject, name: str, state: State) -> State:
    result = []
    for variable, value in zip(subject.plant.variables, state, strict=True):
        if name == BINARY32:
            result.append(binary32(value))
            continue
        assert subject.bus is not None
        signal = signal_of(subject.bus, variable.signal)
        assert signal is not None
        result.append(in_steps(value, Fraction(signal.scale), Fraction(signal.offset)))
    return tuple(result)


def formulas(plant: Plant) -> list[Formula]:
    found = [formula for leaf in plant.leaves.values() for formula in leaf.regions.values()]
    return found + [mode.when for leaf in plant.leaves.values() for mode in leaf.modes]


@pytest.mark.parametrize("tree", TREES)
def test_regions_in_steps_are_those_of_the_rounded_state(tree: str) -> None:
    subject = subject_of(tree)
    other = in_arithmetic(subject, SIGNALS)
    chance = random.Random(3)
    inside = 0
    for _ in range(3000):
        state = tuple(
            Fraction(chance.randint(int(one.low * 4000), int(one.high * 4000)), 4000) for one in subject.plant.variables
        )
        near = rounded_state(subject, SIGNALS, state)
        for exact, moved in zip(formulas(subject.plant), formulas(other.plant), strict=True):
            assert moved.holds(state) == exact.holds(near), (state, near)
            inside += moved.holds(state)
    assert inside > 3000


def test_what_example_5_loses_in_binary32() -> None:
    """From a little less than 0.33 m three steps lead to a little less than 0.48 m, which is 0.48 m in binary32."""
    subject = subject_of("get_home")
    other = in_arithmetic(subject, BINARY32)
    claim = next(one for one in subject.plant.claims if one.name.startswith("No chattering"))
    assert verify(subject, claim).verdict == "proven"
    assert verify(in_arithmetic(subject, SIGNALS), claim).verdict == "proven"
    result = verify(other, claim)
    assert result.verdict == "refuted"
    assert [visit.label for visit in result.trace[1:-1]] == ["Sit to Stand"] * 3
    three, top = binary32(Fraction(0.3)), binary32(Fraction(0.48))
    for visit in result.trace[1:-1]:
        assert three <= binary32(Fraction(float(visit.state[1]))) < top


def test_what_example_4_gains_in_steps() -> None:
    subject = subject_of("power_supply")
    other = in_arithmetic(subject, SIGNALS)
    claim = next(one for one in subject.plant.claims if one.name.startswith("The margin of Lemma 10"))
    assert verify(subject, claim).bound == 5
    assert verify(other, claim).bound == Fraction("5.05")  # a level of 20.05 % is the first that is seen as 20.1 %


def test_a_leaf_that_compares_a_sum_is_refused(tmp_path: Path) -> None:
    text = (NAO / "trees" / "get_home.plant.toml").read_text()
    model = tmp_path / "m.plant.toml"
    model.write_text(text.replace('x1 > 0 and x2 < 0.48"', 'x1 > 0 and x2 + 0.0001 * x1 < 0.48"'))
    plant = load(NAO / "trees" / "get_home.xml", model).plant
    with pytest.raises(CompileError, match="compares a sum of variables"):
        rounded(plant, BINARY32, None)


def test_a_variable_without_a_signal_has_no_steps() -> None:
    papers = Path(__file__).parents[2] / "examples" / "papers" / "trees"
    plant = load(papers / "fig16.xml", papers / "fig16.plant.toml").plant
    with pytest.raises(CompileError, match="has no signal, so it has no steps"):
        rounded(plant, SIGNALS, None)


def test_the_command(tmp_path: Path) -> None:
    tree = str(NAO / "trees" / "get_home.xml")
    bus = ["--dbc", str(NAO / "nao.dbc"), "--node", "Controller"]
    both = ["--arithmetic", "signals", "--arithmetic", "binary32"]
    claim = ["--claim", "No chattering: Sit to Stand acts for 4 steps at least"]
    result = CliRunner().invoke(main, ["verify", tree, *bus, *both, *claim])
    assert result.exit_code == 1
    assert "in steps of the DBC: proven, every visit between two others lasts 4 steps or more" in result.output
    assert "in binary32: refuted, 'Sit to Stand' acts for 3 steps only" in result.output
    result = CliRunner().invoke(main, ["verify", tree, *bus, *both, "--claim", "Sit to Stand alone", "--json"])
    assert result.exit_code == 0
    (answer,) = json.loads(result.output)
    assert {name: one["bound"] for name, one in answer["arithmetic"].items()} == {"signals": "4", "binary32": "4"}
    assert "needs --dbc" in CliRunner().invoke(main, ["verify", tree, "--arithmetic", "signals"]).output
