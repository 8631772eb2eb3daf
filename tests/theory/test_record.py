# SPDX-License-Identifier: MIT
"""What refutes a claim, as a record, in the real program: it commands what the model says, tick by tick."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.errors import CompileError
from canopy.replay.program import read_sent, run_program
from canopy.verify.linear import State
from canopy.verify.model import RUNNING
from canopy.verify.record import raw_values, record
from canopy.verify.run import Subject, load, verify
from canopy.verify.unroll import Visit

ROOT = Path(__file__).parents[2]
NAO = ROOT / "examples" / "nao"
DBC = NAO / "nao.dbc"
BUILD = Path(os.environ.get("CANOPY_BUILD_DIR") or ROOT / "build" / "host").resolve()


def subject_of(tree: str) -> Subject:
    return load(NAO / "trees" / f"{tree}.xml", NAO / "trees" / f"{tree}.plant.toml", DBC, "Controller")


def commanded(subject: Subject, state: State, command: str) -> str:
    """What the model says that is commanded: the leaf that is RUNNING writes its mode."""
    for leaf in subject.plant.leaves.values():
        for mode in leaf.modes:
            if mode.when.holds(state) and leaf.regions[RUNNING].holds(state):
                return str(dict(mode.writes)[f"{command}.Mode"])
    raise AssertionError("nobody acts")


@pytest.mark.parametrize(
    ("tree", "program", "claim", "command"),
    [
        ("get_home", "nao_home", "18 steps are not enough", "PostureCommand"),
        ("power_supply", "nao_power", "194 steps are not enough", "PowerCommand"),
    ],
)
def test_the_program_does_what_refutes_a_claim(
    tmp_path: Path, tree: str, program: str, claim: str, command: str
) -> None:
    folder = tmp_path / "records"
    options = ["--dbc", str(DBC), "--node", "Controller", "--period", "50", "--record", str(folder), "--claim", claim]
    result = CliRunner().invoke(main, ["verify", str(NAO / "trees" / f"{tree}.xml"), *options])
    assert result.exit_code == 0, result.output
    (file,) = folder.iterdir()
    assert f"record {file}: " in result.output
    assert "rounded" not in result.output
    run_program(BUILD / "examples" / "nao" / program, (), file, tmp_path / "sent")
    subject = subject_of(tree)
    assert subject.bus is not None
    message = subject.bus.source.database.get_message_by_name(command)
    sent = [one for one in read_sent(tmp_path / "sent") if one.arbitration_id == message.frame_id]
    modes = [str(message.decode(bytes(one.data))["Mode"]) for one in sent]
    found = verify(subject, next(one for one in subject.plant.claims if one.name == claim))
    acting = [visit for visit in found.trace if visit.status == RUNNING]
    assert len(acting) > 18
    assert modes[: len(acting)] == [commanded(subject, visit.state, command) for visit in acting]


def test_states_between_two_steps_are_rounded_and_counted() -> None:
    subject = subject_of("get_home")
    assert subject.bus is not None
    exact, rounded = (Fraction("0.25"), Fraction("0.3")), (Fraction("0.2504"), Fraction("0.3006"))
    assert raw_values(subject.plant, subject.bus, exact)[1]
    values, is_exact = raw_values(subject.plant, subject.bus, rounded)
    assert not is_exact
    assert values == {"Posture.HeadX": 250, "Posture.HeadHeight": 301}
    visits = [Visit(exact, "", RUNNING), Visit(rounded, "", RUNNING)]
    assert record(visits, subject.plant, subject.bus, 50)[1] == 1


def test_a_variable_that_no_frame_tells() -> None:
    papers = ROOT / "examples" / "papers" / "trees"
    subject = load(papers / "fig16.xml", papers / "fig16.plant.toml", DBC, "Controller")
    assert subject.bus is not None
    with pytest.raises(CompileError, match="has no signal that 'Controller' receives"):
        record([], subject.plant, subject.bus, 50)


def test_what_a_record_needs() -> None:
    tree = str(NAO / "trees" / "get_home.xml")
    result = CliRunner().invoke(main, ["verify", tree, "--record", "somewhere"])
    assert result.exit_code == 2
    assert "--record needs --dbc, --node and --period" in result.output
