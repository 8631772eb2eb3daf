# SPDX-License-Identifier: MIT
"""`canopy fmt --to-4` and `--repair`: files of older formats, and raw signs in attributes."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.tree.raw_markup import repaired

NAO = Path(__file__).parents[2] / "examples" / "nao"

OLD = """\
<?xml version="1.0"?>
<!-- patrol -->
<root main_tree_to_execute="Main Tree">
  <BehaviorTree ID="Main Tree">
    <SequenceStar name="go">
      <!-- stays here -->
      <Action ID="Find" goal="${goal}"/>
      <Control ID="SequenceStar"><RetryUntilSuccesful num_attempts="3"><Move to="{goal}"/></RetryUntilSuccesful>
      </Control>
      <SubTree ID="Part" target="goal" __shared_blackboard="true"/>
      <SubTreePlus ID="Part" target="5" __autoremap="1"/>
      <Parallel success_threshold="1" failure_threshold="2"><Find/><Find/></Parallel>
      <BlackboardCheckString value_A="{mode}" value_B="auto" return_on_mismatch="FAILURE">
        <Find/></BlackboardCheckString>
      <BlackboardCheckInt value_A="${n}" value_B="5"><Find/></BlackboardCheckInt>
    </SequenceStar>
  </BehaviorTree>
  <BehaviorTree ID="Part"><Move to="{target}"/></BehaviorTree>
  <TreeNodesModel>
    <Control ID="SequenceStar"/>
    <Action ID="Find"><output_port name="goal" type="int"/></Action>
    <Action ID="Move"><input_port name="to" type="int"/></Action>
    <SubTree ID="Main Tree">
      <input_port name="mode" type="std::string" default="auto"/><input_port name="n" type="int"/>
    </SubTree>
  </TreeNodesModel>
</root>
"""
NEW = """\
<?xml version="1.0" encoding="UTF-8"?>
<!-- patrol -->
<root BTCPP_format="4" main_tree_to_execute="Main_Tree">
  <BehaviorTree ID="Main_Tree">
    <SequenceWithMemory name="go">
      <!-- stays here -->
      <Action ID="Find" goal="{goal}"/>
      <Control ID="SequenceWithMemory">
        <RetryUntilSuccessful num_attempts="3">
          <Move to="{goal}"/>
        </RetryUntilSuccessful>
      </Control>
      <SubTree ID="Part" target="{goal}" _autoremap="true"/>
      <SubTree ID="Part" target="5" _autoremap="1"/>
      <Parallel success_count="1" failure_count="2">
        <Find/>
        <Find/>
      </Parallel>
      <Precondition if="mode == 'auto'" else="FAILURE">
        <Find/>
      </Precondition>
      <Precondition if="n == 5" else="FAILURE">
        <Find/>
      </Precondition>
    </SequenceWithMemory>
  </BehaviorTree>
"""


def run(*arguments: str, text: str | None = None) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, list(arguments), input=text)
    return result.exit_code, result.stdout, result.stderr


def test_a_file_of_format_3_becomes_one_of_format_4(tmp_path: Path) -> None:
    file = tmp_path / "old.xml"
    file.write_text(OLD, encoding="utf-8")
    status, out, said = run("fmt", "--to-4", str(file))
    assert (status, out) == (0, f"{file}: formatted\n")
    assert file.read_text(encoding="utf-8").startswith(NEW)
    for line in (
        "line 4: tree 'Main Tree' is called 'Main_Tree'",
        "line 5: SequenceStar is SequenceWithMemory",
        "line 7: Find: ${goal} is {goal}",
        "line 8: SequenceStar is SequenceWithMemory",
        "line 8: RetryUntilSuccesful is RetryUntilSuccessful",
        "line 8: RetryUntilSuccesful: BehaviorTree.CPP 3 may do several cycles in one tick, Canopy does one",
        'line 10: SubTree: target="goal" is target="{goal}"',
        "line 10: SubTree: __shared_blackboard is _autoremap; it shares the outer tree's names, but for those that",
        "line 11: SubTreePlus is SubTree",
        "line 12: Parallel: success_threshold is success_count",
        "line 13: BlackboardCheckString is Precondition; it is asked when its child is not RUNNING",
    ):
        assert line in said, said
    again = run("fmt", "--to-4", "--check", str(file))
    assert again[0] == 0 and "is of format 4 already" in again[2]


def test_what_was_converted_compiles(tmp_path: Path) -> None:
    file = tmp_path / "old.xml"
    file.write_text(OLD, encoding="utf-8")
    refused = CliRunner().invoke(main, ["compile", str(file), *bus(tmp_path)])
    assert refused.exit_code == 2 and "canopy fmt --to-4 converts it" in refused.stderr
    assert run("fmt", "--to-4", str(file))[0] == 0
    compiled = CliRunner().invoke(main, ["compile", str(file), *bus(tmp_path), "--allow-unset-ports"])
    assert compiled.exit_code == 0, compiled.output


def bus(tmp_path: Path) -> list[str]:
    return ["--dbc", str(NAO / "nao.dbc"), "--node", "Controller", "--period-ms", "50", "-o", str(tmp_path / "out")]


@pytest.mark.parametrize(
    ("node", "said"),
    [
        ("<ConsumeQueue/>", "ConsumeQueue is left as it is: use a Loop node"),
        ("<ManualSelector/>", "ManualSelector is left as it is"),
        ("<Selector><A/></Selector>", "ReactiveFallback asks all again"),
        ('<Go _while="3"/>', "_while was a port, and is a script in format 4"),
    ],
)
def test_what_changes_its_meaning_is_said(node: str, said: str) -> None:
    status, _, error = run("fmt", "--to-4", "-", text=f'<root><BehaviorTree ID="M">{node}</BehaviorTree></root>')
    assert status == 0 and said in error


# Raw & and <

RAW = """\
<root BTCPP_format="4">
  <!-- a && b < c -->
  <BehaviorTree ID="M"><Sequence>
    <Script code="a:=1; b:=2"/>
    <ScriptCondition code='a<2 && b==2 &amp;&amp; a &lt; 3' name="x > y"/>
  </Sequence></BehaviorTree>
</root>
"""


def test_a_raw_sign_in_an_attribute_is_named_with_its_column(tmp_path: Path) -> None:
    file = tmp_path / "raw.xml"
    file.write_text(RAW, encoding="utf-8")
    result = CliRunner().invoke(main, ["compile", str(file), *bus(tmp_path)])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{file}:5:29: error: not well-formed XML: a raw '<'")
    assert "it is written &lt;; canopy fmt --repair" in result.stderr
    assert "a raw '<'" in run("fmt", str(file))[2]
    both = RAW.replace("a<2", "a==2")
    file.write_text(both, encoding="utf-8")
    assert ":5:33: error: not well-formed XML: a raw '&'" in run("fmt", str(file))[2]


def test_raw_signs_are_repaired(tmp_path: Path) -> None:
    file = tmp_path / "raw.xml"
    file.write_text(RAW, encoding="utf-8")
    assert run("fmt", "--repair", str(file))[0] == 0
    text = file.read_text(encoding="utf-8")
    assert 'code="a&lt;2 &amp;&amp; b==2 &amp;&amp; a &lt; 3"' in text
    assert "<!-- a && b < c -->" in text
    assert CliRunner().invoke(main, ["compile", str(file), *bus(tmp_path)]).exit_code == 0


@pytest.mark.parametrize(
    ("raw", "right"),
    [
        (b'<a b="x&y"/>', b'<a b="x&amp;y"/>'),
        (b'<a b="&quot;&#65;&#x41;&apos;"/>', b'<a b="&quot;&#65;&#x41;&apos;"/>'),
        (b'<a b="&unknown;"/>', b'<a b="&amp;unknown;"/>'),
        (b"<a>x & y</a>", b"<a>x &amp; y</a>"),
        (b"<a b='\"<\"' c=\"'&'\"/>", b"<a b='\"&lt;\"' c=\"'&amp;'\"/>"),
        (b"<![CDATA[a && b]]><?p a && b?><!-- & -->", b"<![CDATA[a && b]]><?p a && b?><!-- & -->"),
        (b'<a b="open', b'<a b="open'),
        (b"<<<&", b"<<<&amp;"),
    ],
)
def test_only_what_no_parser_takes_is_written_anew(raw: bytes, right: bytes) -> None:
    assert repaired(raw) == right
    assert repaired(right) == right


@pytest.mark.parametrize("unit", [b"<!--", b"<a b='", b'<a b="', b"<", b"&", b"</", b"<a b = "])
def test_repairing_takes_no_longer_for_what_is_broken(unit: bytes) -> None:
    begin = time.process_time()
    repaired(unit * 100_000)
    assert time.process_time() - begin < 2


def test_a_file_as_deep_as_the_compiler_takes_is_formatted() -> None:
    depth = 60_000
    status, out, _ = run("fmt", "-", text="<a>" * depth + "</a>" * depth)
    assert status == 0
    assert out.count("\n") == 2 * depth - 1
    assert max(map(len, out.splitlines())) < 250
