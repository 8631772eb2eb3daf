# SPDX-License-Identifier: MIT
"""What scripts can say since BehaviorTree.CPP 4.10: modelled, or named as not modelled; never proven wrongly."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main

pytestmark = pytest.mark.logic
MODEL = (
    '<TreeNodesModel><Action ID="A"/><Action ID="B"/>'
    '<Enum ID="Color"><value name="RED"/><value name="GREEN"/></Enum></TreeNodesModel>'
)
SWITCH = '<Switch2 variable="{t}" case_1="5.0" case_2="x"><A/><AlwaysSuccess/><AlwaysFailure/></Switch2>'


@pytest.mark.parametrize(
    ("nodes", "formula", "word"),
    [
        ('<Script code="c := RED"/><A _skipIf="c == GREEN"/>', "SKIPPED(A)", "proven"),
        ('<Script code="c := RED"/><A _skipIf="c == RED"/>', "SKIPPED(A)", "refuted"),
        ('<Script code="a := 1; b := 0"/><A _skipIf="a == 1 || b == 1 &amp;&amp; b == 0"/>', "SKIPPED(A)", "refuted"),
        ("<Script code=\"t := 'b'\"/><A _skipIf=\"t &lt; 'a'\"/>", "SKIPPED(A)", "unknown"),
        (f"<Script code=\"t := '5'\"/>{SWITCH}", "TICKED(A)", "unknown"),
        ('<Script code="a := b := 1"/><A/>', "SKIPPED(A)", "proven"),
    ],
)
def test_the_answer_is_right_or_none(tmp_path: Path, nodes: str, formula: str, word: str) -> None:
    file = tmp_path / "t.xml"
    tree = f'<BehaviorTree ID="M"><Sequence>{nodes}</Sequence></BehaviorTree>'
    file.write_text(f'<root BTCPP_format="4">{tree}{MODEL}</root>', encoding="utf-8")
    result = CliRunner().invoke(main, ["verify", str(file), "--never", formula])
    assert word in result.stdout + result.stderr, result.output
