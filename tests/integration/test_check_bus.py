# SPDX-License-Identifier: MIT
"""`canopy check --dbc`: each rule about the bus fires where it should, at its line, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.check.rules import all_rules
from canopy.cli import main

TREE = """\
<root BTCPP_format="4">
  <BehaviorTree ID="Main">
    <AlwaysSuccess/>
  </BehaviorTree>
</root>
"""
DBC = """\
VERSION ""
BU_: Controller B
BO_ 1 Speed: 8 B
 SG_ E2E_CRC : 0|8@1+ (1,0) [0|255] "" Controller
 SG_ E2E_Counter : 8|4@1+ (1,0) [0|14] "" Controller
 SG_ Value : 16|16@1+ (0.1,0) [0|6553.5] "" Controller
 SG_ Wide : 32|32@1+ (1,0) [0|4294967295] "" Controller

BO_ 2 Torque: 8 B
 SG_ E2E_CRC : 0|8@1+ (1,0) [0|255] "" Controller
 SG_ E2E_Counter : 8|4@1+ (1,0) [0|14] "" Controller
 SG_ Torque : 16|8@1- (1,0) [-128|127] "" Controller

BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ BO_ "GenMsgTimeoutTime" INT 0 60000;
BA_DEF_ BO_ "E2EDataId" INT -1 65535;
BA_DEF_DEF_ "GenMsgCycleTime" 100;
BA_DEF_DEF_ "GenMsgTimeoutTime" 0;
BA_DEF_DEF_ "E2EDataId" -1;
BA_ "E2EDataId" BO_ 1 7;
BA_ "E2EDataId" BO_ 2 8;
"""

# rule, what is changed in the DBC, what it says
CASES = [
    ("swapped-range", "(0.1,0) [0|6553.5]", "(0.1,0) [6553.5|0]", "signal 'Speed.Value' has the range [6553.5|0]"),
    ("swapped-range", "[-128|127]", "[5|5]", "signal 'Torque.Torque' has the range [5"),
    ("never-stale", '"GenMsgCycleTime" 100;', '"GenMsgCycleTime" 0;', "input 'Speed' never gets stale"),
    ("short-timeout", "BO_ 2 8;", 'BO_ 2 8;\nBA_ "GenMsgTimeoutTime" BO_ 2 50;', "has a timeout of 50 ms"),
    ("shared-data-id", "BO_ 2 8;", "BO_ 2 7;", "messages 'Speed' and 'Torque' have the same E2EDataId 7"),
    ("narrow-range", "[0|4294967295]", "[0|100]", "signal 'Speed.Wide' takes 101 of the 4294967296 values"),
    ("narrow-range", "[-128|127]", "[0|255]", "its range is one of an unsigned signal"),
]  # fmt: skip


def findings(tmp_path: Path, dbc: str, *more: str) -> str:
    (tmp_path / "t.xml").write_text(TREE)
    (tmp_path / "b.dbc").write_text(dbc)
    arguments = ["check", str(tmp_path / "t.xml"), "--dbc", str(tmp_path / "b.dbc"), "--node", "Controller", *more]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in (0, 1), result.output
    return result.output


@pytest.mark.parametrize(("rule", "old", "new", "text"), CASES)
def test_a_rule_fires_at_its_line_and_nowhere_else(tmp_path: Path, rule: str, old: str, new: str, text: str) -> None:
    assert DBC.count(old) == 1
    assert f"[{rule}]" not in findings(tmp_path, DBC)
    found = [line for line in findings(tmp_path, DBC.replace(old, new)).splitlines() if f"[{rule}]" in line]
    assert found and any(text in line for line in found), found
    assert all(line.startswith(f"{tmp_path / 'b.dbc'}:") for line in found)


def test_a_timeout_is_compared_with_the_period(tmp_path: Path) -> None:
    dbc = DBC.replace('"GenMsgTimeoutTime" 0;', '"GenMsgTimeoutTime" 150;')
    assert "[short-timeout]" not in findings(tmp_path, dbc, "--period-ms", "100")
    assert "the period of the controller is 200 ms" in findings(tmp_path, dbc, "--period-ms", "200")


def test_every_rule_about_the_bus_has_a_case() -> None:
    own = {rule.id for rule in all_rules().values() if rule.run.__module__ == "canopy.check.rules.bus"}
    assert own == {case[0] for case in CASES}
