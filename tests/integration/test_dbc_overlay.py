# SPDX-License-Identifier: MIT
"""The overlay: what an application adds to the maker's file, read as one with it by everything that reads the file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.bus_reader import read_bus
from canopy.model import ModelError, load_model
from canopy.replay.log import Bus
from canopy.signals import SignalTable
from canopy_sim.messages import load_messages
from integration.codec_harness import ROOT
from integration.test_dbc_met import TREE

NAO = ROOT / "examples" / "nao" / "nao.dbc"
DBC = """\
VERSION ""
BU_: ECU Robot
BO_ 100 Cmd: 3 ECU
 SG_ Speed : 0|8@1+ (0.5,-10) [-10|100] "m/s" Robot
 SG_ Mode : 8|8@1+ (1,0) [0|3] "" Robot
BO_ 101 State: 2 Robot
 SG_ a : 0|8@1+ (1,0) [0|0] "" ECU
BO_ 102 Other: 2 Robot
 SG_ a : 0|8@1+ (1,0) [0|0] "" Vector__XXX
CM_ BO_ 101 "What comes in.
 Twice.";
CM_ SG_ 100 Speed "How fast";
VAL_ 100 Mode 0 "Stop" 1 "Go" ;
BA_DEF_ SG_ "GenSigStartValue" FLOAT 0 1000;
BA_ "GenSigStartValue" SG_ 100 Speed 20;
BA_ "GenSigStartValue" SG_ 100 Mode 0;
"""
FILLED = """
[message.Cmd]
cycle_ms = 50
[message.Cmd.signal.Speed]
safe = -0.5
[message.Cmd.signal.Mode]
safe = "Stop"
[message.State]
timeout_ms = 500
"""


def put(folder: Path, overlay: str | None = FILLED, dbc: str = DBC) -> Path:
    (folder / "car.dbc").write_text(dbc)
    if overlay is not None:
        (folder / "car.overlay.toml").write_text(overlay)
    return folder / "car.dbc"


def compiled(folder: Path, dbc: Path, node: str = "ECU") -> Result:
    (folder / "t.xml").write_text(TREE.format("<AlwaysSuccess/>", ""))
    arguments = ["compile", str(folder / "t.xml"), "--dbc", str(dbc), "--node", node, "--period-ms", "50"]
    return CliRunner().invoke(main, [*arguments, "--trace", "0x600", "--name", "app", "-o", str(folder / "out")])


def overlay(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["dbc", "overlay", *map(str, arguments)])


def test_it_is_written_with_all_that_is_missing(tmp_path: Path) -> None:
    dbc = put(tmp_path, None)
    assert compiled(tmp_path, dbc).exit_code == 2
    result = overlay(dbc, "--node", "ECU", "--receive", "Other")
    assert result.exit_code == 0 and "car.overlay.toml: 5 values to fill in" in result.stdout
    text = (tmp_path / "car.overlay.toml").read_text()
    assert "# 0x64, 3 bytes, sent to Robot\n[message.Cmd]\ncycle_ms = " in text
    assert 'safe = "?" # m/s; -10..100; How fast\n' in text and 'safe = "?" # 0..3; one of "Stop", "Go"\n' in text
    assert "received from Robot: What comes in. Twice.\n[message.State]\ntimeout_ms = " in text
    assert '[message.Other]\nreceivers = ["ECU"]\ntimeout_ms = ' in text
    told = compiled(tmp_path, dbc)
    assert (
        told.exit_code == 2
        and "car.overlay.toml:5: error: message.Cmd.cycle_ms is still to be filled in" in told.stderr
    )
    for answer in ("50", "1.5", '"Go"', "500", "0"):
        text = text.replace('"?"', answer, 1)
    (tmp_path / "car.overlay.toml").write_text(text)
    assert compiled(tmp_path, dbc).exit_code == 0
    bus = read_bus(dbc, "ECU", 50)
    assert [(m.name, m.timeout_us) for m in bus.receive] == [("State", 500_000), ("Other", 0)]
    assert [(s.name, s.safe) for s in bus.send[0].signals] == [("Speed", 23), ("Mode", 1)]
    assert overlay(dbc, "--node", "ECU", "-o", "-").stdout.endswith("# Nothing is missing.\n")


def test_start_values_are_safe_values_on_request(tmp_path: Path) -> None:
    dbc = put(tmp_path, None)
    assert overlay(dbc, "--node", "ECU", "--start-values").exit_code == 0
    text = (tmp_path / "car.overlay.toml").read_text()
    assert re.findall(r"safe = (\S+)", text) == ["0", "0"] and text.count('"?"') == 2  # raw 20 is 0 m/s


def test_a_new_node_takes_messages_of_its_own(tmp_path: Path) -> None:
    dbc = put(tmp_path, None)
    assert "nothing: name its messages" in overlay(dbc, "--node", "Pilot", "-o", "-").stdout
    result = overlay(dbc, "--node", "Pilot", "--receive", "State", "--send", "Cmd")
    assert result.exit_code == 0
    text = (tmp_path / "car.overlay.toml").read_text()
    assert 'senders = ["Pilot"]' in text and 'receivers = ["ECU", "Pilot"]' in text
    for answer in ("50", "0", '"Stop"', "500"):
        text = text.replace('"?"', answer, 1)
    (tmp_path / "car.overlay.toml").write_text(text)
    assert compiled(tmp_path, dbc, "Pilot").exit_code == 0
    assert overlay(dbc, "--node", "Pilot", "--send", "None").exit_code == 2


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    dbc = put(tmp_path)
    result = overlay(dbc, "--node", "ECU")
    assert result.exit_code == 2 and "is there already" in result.stderr
    assert (tmp_path / "car.overlay.toml").read_text() == FILLED


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("[message.Cmd]", "car.dbc:3: error: message 'Cmd' is sent every 0 ms"),
        ("[message.Cmd]", "to fix: write in car.overlay.toml: [message.Cmd] cycle_ms = MS, a multiple of 50"),
        ("[message.Cmd]\ncycle_ms = 50", "to fix: write in car.overlay.toml: [message.Cmd.signal.Speed] safe = VALUE"),
        ("[message.Cmd]\ncycle_ms = 75", "car.overlay.toml:2: error: message 'Cmd' is sent every 75 ms"),
        ("[message.Cmd]\ncycle_ms = -5", "car.overlay.toml:2: error: GenMsgCycleTime of message 'Cmd' is -5"),
        ("[message.Cmd]\ncycle_ms = 'x'", "car.overlay.toml:2: error: message.Cmd.cycle_ms must be a number"),
        ("[message.Cmd]\ncycle = 5", "unknown key 'cycle' in the overlay\n  help: did you mean 'cycle_ms'?"),
        ("[message.Cmds]\ncycle_ms = 5", "no message 'Cmds'\n  help: did you mean 'Cmd'?"),
        ("[message.Cmd.signal.Sped]", "message 'Cmd' has no signal 'Sped'\n  help: did you mean 'Speed'?"),
        ("[message.Cmd.signal.Speed]\nsafe = 0.25", "which 'Cmd.Speed' cannot be\n  help: the nearest are 0 and 0.5"),
        ("[message.Cmd.signal.Mode]\nsafe = 'Gone'", "has no value 'Gone'\n  help: did you mean 'Go'?"),
        (f"{FILLED}range = 5", "unknown key 'range'"),
        ("[message.Cmd.signal.Speed]\nrange = [5, 4]", "the first end must be below the second"),
        ("[message.Cmd.signal.Speed]\nrange = 5", "must be two numbers, or \"any\""),
        ("[message.Cmd]\nleave_out = 1", "message.Cmd.leave_out must be true or false"),
        ("[message.Cmd]\nsenders = 'ECU'", "message.Cmd.senders must be a list of nodes"),
        ("[message]\nCmd = 1", "'message.Cmd' is not a table"),
        ("[message.Cmd]\nlength = 99999", "message.Cmd.length is 99999"),
        ("protocol = 'lin'", "the protocol is 'lin'\n  help: known are can, j1939"),
        ("[message.Cmd\n", "car.overlay.toml:1:13: error: not valid TOML"),
        ("message = 1", "'message' is not a table"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_at_its_line(tmp_path: Path, line: str, text: str) -> None:
    result = compiled(tmp_path, put(tmp_path, line))
    assert result.exit_code == 2 and text in result.stderr, result.output


def test_each_key_does_what_it_says(tmp_path: Path) -> None:
    more = (
        'receivers = ["ECU", "Else"]\nlength = 4\nlonger = true\n[message.State.signal.a]\nsigned = true\n'
        'range = [-5, 7]\n[message.Other]\nsenders = ["Else"]\nreceivers = ["ECU"]\n'
    )
    dbc = put(tmp_path, FILLED + more)
    assert compiled(tmp_path, dbc).exit_code == 0
    state, other = read_bus(dbc, "ECU", 50).receive
    (signal,) = state.signals
    assert (state.length, state.longest, signal.signed, signal.low, signal.high) == (4, 8, True, -5, 7)
    assert other.name == "Other"
    source = (tmp_path / "out" / "app_bus.c").read_text()
    assert ".more = 4u," in source
    left_out = put(tmp_path, "[message.Cmd]\nleave_out = true\n[message.State]\nleave_out = true\n")
    bus = read_bus(left_out, "ECU", 50)
    assert not bus.receive and not bus.send


def test_a_signal_that_is_left_out_is_gone(tmp_path: Path) -> None:
    dbc = put(tmp_path, FILLED.replace('safe = "Stop"', "leave_out = true"))
    assert [s.name for s in read_bus(dbc, "ECU", 50).send[0].signals] == ["Speed"]


def test_the_codec_and_check_read_it_too(tmp_path: Path) -> None:
    dbc = put(tmp_path, FILLED + "[message.State.signal.a]\nrange = [1, 9]\n")
    assert CliRunner().invoke(main, ["codec", str(dbc), "-o", str(tmp_path)]).exit_code == 0
    assert "CAR_CMD_CYCLE_MS 50u" in (tmp_path / "car_codec.h").read_text()
    (tmp_path / "t.xml").write_text(TREE.format("<AlwaysSuccess/>", ""))
    arguments = ["check", str(tmp_path / "t.xml"), "--dbc", str(dbc), "--node", "ECU"]
    assert "[never-stale]" not in CliRunner().invoke(main, arguments).output
    put(tmp_path, FILLED.replace("timeout_ms = 500", "timeout_ms = 0"))
    assert "[never-stale]" in CliRunner().invoke(main, arguments).output


def test_the_tools_read_the_copies_beside_the_model(tmp_path: Path) -> None:
    dbc = put(tmp_path, FILLED + "[message.State.signal.a]\nsigned = true\n")
    assert compiled(tmp_path, dbc).exit_code == 0
    model = load_model(tmp_path / "out" / "app.model.json")
    table = SignalTable(model)
    assert table.feed(101, bytes([0xFF, 0]), 1.0) and table.value("State", "a") == -1
    (reading,) = (r for r in table.readings(1.6) if r.message == "State")
    assert reading.stale
    copy = tmp_path / "out" / "car.overlay.toml"
    copy.write_text(FILLED)
    with pytest.raises(ModelError, match="it, or its overlay, is not what"):
        SignalTable(model)
    # Compiled again without an overlay that matters, the old copy is gone.
    (tmp_path / "car.overlay.toml").unlink()
    dbc.write_text(DBC.replace("BO_ 100 Cmd: 3 ECU", "BO_ 100 Cmd: 3 Robot"))
    assert compiled(tmp_path, dbc).exit_code == 0 and not copy.exists()
    SignalTable(load_model(tmp_path / "out" / "app.model.json"))


def without_attributes(folder: Path) -> Path:
    """The NAO's DBC as a maker would give it: no times, no safe values, no data ids; and all of them in an overlay."""
    text = NAO.read_text()
    kept = [line for line in text.splitlines() if not line.startswith("BA_")]
    (folder / "nao.dbc").write_text("\n".join(kept) + "\n")
    return folder / "nao.dbc"


OVERLAY_OF_NAO = """
[message.Battery]
cycle_ms = 100
[message.Posture]
cycle_ms = 100
[message.SimulationStep]
cycle_ms = 10
[message.PowerCommand]
cycle_ms = 50
e2e_data_id = 1
[message.PowerCommand.signal.Mode]
safe = "Stop"
[message.PostureCommand]
cycle_ms = 50
e2e_data_id = 2
[message.PostureCommand.signal.Mode]
safe = "Stop"
"""


def test_the_simulator_and_the_replay_read_it(tmp_path: Path) -> None:
    dbc = without_attributes(tmp_path)
    with pytest.raises(Exception, match="needs a GenMsgCycleTime"):
        load_messages(dbc)
    (tmp_path / "nao.overlay.toml").write_text(OVERLAY_OF_NAO)
    messages = load_messages(dbc)
    assert (messages.battery.cycle, messages.power_command.safe["Mode"], messages.posture_command.timeout) == (
        0.1,
        0,
        0.25,
    )
    assert compiled(tmp_path, dbc, "Controller").exit_code == 0
    replayed = Bus(load_model(tmp_path / "out" / "app.model.json"))
    assert sorted(replayed.protected.values()) == [1, 2]
