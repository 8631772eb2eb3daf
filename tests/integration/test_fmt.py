# SPDX-License-Identifier: MIT
"""`canopy fmt`: nothing is lost, the canonical form is stable, and the tree stays the same tree."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from canopy.cli import main
from canopy.compiler.port_types import ANY_TYPE
from canopy.compiler.table import make_table
from canopy.compiler.tree_reader import read_tree
from canopy.fmt.cli import format_bytes

REPOSITORY = Path(__file__).parents[2]
WILD = REPOSITORY / "tests" / "corpus"  # as other people write them
FILES = [*REPOSITORY.glob("examples/**/*.xml"), *REPOSITORY.glob("tests/**/*.xml")]
TREES = sorted(file for file in FILES if WILD not in file.parents)
CANONICAL_TREES = [file for file in TREES if "courier" not in file.parts]  # the courier's are as an editor leaves them

# As Groot2 saves: four blanks, unknown attributes, a comment, a palette with escaped types, CDATA added by hand.
GROOT = """\
<?xml version="1.0" encoding="UTF-8"?>
<root BTCPP_format='4'
      project_name="Demo">
    <!-- kept -->
    <BehaviorTree ID="Main"   _fullpath="a/b.xml">
        <Sequence name="&lt;go&gt; &amp; &quot;stop&quot;"><Go _uid="3" speed="1&#10;2"/> <!-- behind -->


            <!--  two
   lines --><Wait></Wait>
        </Sequence>
    </BehaviorTree>
    <TreeNodesModel>
        <Action ID="Go"><input_port name="speed" type="std::vector&lt;int&gt;"> in m/s </input_port></Action>
        <Action ID="Wait"><description><![CDATA[a < b]]> and <b>bold</b></description>
        <input_port name="a_long_name_of_a_port" type="std::string"
  default="{a_long_name_of_an_entry}" other="1234567890"/>
        </Action>
    </TreeNodesModel>
</root>
<!-- end -->
"""
CANONICAL = """\
<?xml version="1.0" encoding="UTF-8"?>
<root BTCPP_format="4" project_name="Demo">
  <!-- kept -->
  <BehaviorTree ID="Main" _fullpath="a/b.xml">
    <Sequence name="&lt;go&gt; &amp; &quot;stop&quot;">
      <Go _uid="3" speed="1&#10;2"/> <!-- behind -->

      <!--  two
   lines -->
      <Wait/>
    </Sequence>
  </BehaviorTree>
  <TreeNodesModel>
    <Action ID="Go">
      <input_port name="speed" type="std::vector&lt;int&gt;"> in m/s </input_port>
    </Action>
    <Action ID="Wait">
      <description><![CDATA[a < b]]> and <b>bold</b></description>
      <input_port
          name="a_long_name_of_a_port"
          type="std::string"
          default="{a_long_name_of_an_entry}"
          other="1234567890"/>
    </Action>
  </TreeNodesModel>
</root>
<!-- end -->
"""


def formatted(text: str | bytes) -> str:
    return format_bytes(text if isinstance(text, bytes) else text.encode(), "x.xml").decode()


def meaning(text: str) -> str:
    """Everything but the blanks between elements: elements, attributes, text, comments (C14N 2.0)."""
    return ET.canonicalize(text, with_comments=True, strip_text=True)


def test_a_file_of_an_editor() -> None:
    assert formatted(GROOT) == CANONICAL
    assert formatted(CANONICAL) == CANONICAL
    assert meaning(GROOT) == meaning(CANONICAL)


@pytest.mark.parametrize("file", CANONICAL_TREES, ids=[str(file.relative_to(REPOSITORY)) for file in CANONICAL_TREES])
def test_every_tree_of_this_repository_is_in_canonical_form(file: Path) -> None:
    assert CliRunner().invoke(main, ["fmt", "--check", str(file)]).output == ""


@pytest.mark.parametrize("file", TREES, ids=[str(file.relative_to(REPOSITORY)) for file in TREES])
def test_it_stays_the_same_tree(tmp_path: Path, file: Path) -> None:
    folder = tmp_path / "tree"
    shutil.copytree(file.parent, folder)  # with the files that it includes
    ugly = folder / file.name
    ugly.write_text(file.read_text(encoding="utf-8").replace(">\n", ">").replace("    ", "\t"), encoding="utf-8")
    assert CliRunner().invoke(main, ["fmt", str(ugly)]).exit_code == 0
    if "<BehaviorTree" in file.read_text(encoding="utf-8"):  # else it holds models only
        assert make_table(read_tree(ugly, ANY_TYPE)).hash == make_table(read_tree(file, ANY_TYPE)).hash
    assert meaning(ugly.read_text(encoding="utf-8")) == meaning(file.read_text(encoding="utf-8"))


names = st.sampled_from(["Sequence", "Go", "x:y", "Ω"])
plain = st.text(st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff"), max_size=6)
blanks = st.text(" \n\t", max_size=4)
values = st.text(st.sampled_from("ab\"'<>&\n\t\r é{}"), max_size=5)


def escape(text: str) -> str:
    table = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\t": "&#9;", "\r": "&#13;"}
    return "".join(table.get(character, character) for character in text)


@st.composite
def elements(draw: st.DrawFn, depth: int = 3) -> str:
    tag = draw(names)
    given_names = draw(st.lists(st.sampled_from(["a", "b", "_uid", "x:z"]), unique=True))
    attributes = "".join(f' {name}="{escape(draw(values))}"' for name in given_names)
    parts = [
        blanks,
        plain.map(lambda text: f"<!--{text.replace('-', '')}-->"),
        plain.map(escape),
        plain.map(lambda text: f"<![CDATA[{text.replace(']', '')}]]>"),
        st.just("<?go on?>"),
    ]
    if depth:
        parts.append(elements(depth=depth - 1))
    return f"<{tag}{attributes}>{''.join(draw(st.lists(st.one_of(parts), max_size=4)))}</{tag}>"


@given(elements(), st.sampled_from(["", "<?xml version='1.0'?>"]), blanks, plain)
def test_nothing_is_lost_and_twice_is_once(root: str, declaration: str, blank: str, comment: str) -> None:
    root = root.replace(" ", " xmlns:x='u' ", 1) if root.split(">")[0].count(" ") else root
    text = (
        f"{declaration}{blank if declaration else ''}<!--{comment.replace('-', '')}--><r xmlns:x='u'>{root}</r>{blank}"
    )
    try:
        before = meaning(text)
    except ET.ParseError:
        return  # two attributes of one name
    once = formatted(text)
    assert meaning(once) == before
    assert formatted(once) == once
    assert once.count("<![CDATA[") == text.count("<![CDATA[")


def test_text_is_not_touched_and_blanks_are_kept_where_asked() -> None:
    text = '<r>\n  <a>  x <b/>\n y</a>\n  <c xml:space="preserve"> <d/> </c>\n  <e xml:space="preserve"/>\n</r>\n'
    assert formatted(text) == text


def test_other_encodings_become_utf_8() -> None:
    assert formatted("<?xml version='1.0' encoding='ISO-8859-1'?><r a='é'/>".encode("latin-1")) == (
        '<?xml version="1.0" encoding="UTF-8"?>\n<r a="é"/>\n'
    )
    assert formatted("<r a='é'/>".encode("utf-16")) == '<r a="é"/>\n'


def test_the_command(tmp_path: Path) -> None:
    good, ugly, bad = tmp_path / "good.xml", tmp_path / "ugly.xml", tmp_path / "bad.xml"
    good.write_text("<r/>\n")
    ugly.write_text("<r></r>")
    ugly.chmod(0o640)
    bad.write_text("<!DOCTYPE r><r/>")
    run = CliRunner().invoke
    result = run(main, ["fmt", "--check", str(good), str(ugly)])
    assert (result.exit_code, result.stderr) == (1, f"{ugly}: not in canonical form\n")
    assert ugly.read_text() == "<r></r>"
    result = run(main, ["fmt", str(bad), str(good), str(ugly)])
    assert result.exit_code == 2
    assert f"{bad}:1:12: error: a document type declaration" in result.stderr
    assert result.stdout == f"{ugly}: formatted\n"
    assert ugly.read_text() == "<r/>\n"
    assert ugly.stat().st_mode & 0o777 == 0o640
    assert run(main, ["fmt", "--check", str(good), str(ugly)]).exit_code == 0
    result = run(main, ["fmt", "-"], input="<r  a='1'/>")
    assert (result.exit_code, result.output) == (0, '<r a="1"/>\n')
    assert sorted(file.name for file in tmp_path.iterdir()) == ["bad.xml", "good.xml", "ugly.xml"]


def test_a_deep_file_is_formatted() -> None:
    depth = 5_000
    text = "<a>" * depth + "</a>" * depth
    assert formatted(text).count("\n") == 2 * depth - 1
