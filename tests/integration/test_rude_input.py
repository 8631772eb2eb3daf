# SPDX-License-Identifier: MIT
"""Input that is too large, garbage, or meant to hurt: exit status 2 in time, a message with the place, nothing written."""

# ruff: noqa: E501
# In the tables, one line is one case.

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from integration.language import DBC

TREE = '<root BTCPP_format="4"><BehaviorTree ID="Main">{}</BehaviorTree></root>'
HEAD = 'VERSION ""\nBU_: Controller B\n'
MESSAGE = 'BO_ {} {}: {} B\n SG_ X : 0|8@1+ (1,0) [0|1] "" Controller\n\n'

pytestmark = pytest.mark.timeout(60)


def compile_here(folder: Path, *more: str, dbc: Path = DBC) -> Result:
    arguments = ["compile", str(folder / "main.xml"), "--dbc", str(dbc), "--node", "Controller", "--period-ms", "10"]
    return CliRunner().invoke(main, [*arguments, "-o", str(folder / "out"), *more])


def expect(folder: Path, result: Result, place: str, text: str) -> None:
    assert result.exit_code == 2, (result.output, result.exception)
    assert result.stderr.startswith(f"{folder / place}"), result.stderr[:300]
    assert text in result.stderr
    assert not (folder / "out").exists()


def script(code: str) -> str:
    return TREE.format(f'<Script code="{code}"/>')


@pytest.mark.parametrize(
    ("content", "place", "text"),
    [
        pytest.param(b"x" * 100_000_000, "main.xml", "the file has 100000000 bytes", id="100 MB"),
        pytest.param(b"\0" * 50, "main.xml:1:1", "not well-formed XML", id="NUL bytes"),
        pytest.param(TREE.format('<Sleep name="é"/>').encode("latin-1"), "main.xml:1:", "not well-formed", id="not UTF-8"),
        *(
            pytest.param(f'<?xml version="1.0" encoding="{name}"?><root/>'.encode(), "main.xml:1:1", "encoding", id=name)
            for name in ("klingon", "utf-7", "shift_jis")
        ),
        pytest.param(
            b'<!DOCTYPE a [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><root>&b;</root>',
            "main.xml:1:13", "document type", id="entity bomb",
        ),
        pytest.param(TREE.format("<Sequence>" + "<AlwaysSuccess/>" * 70_000 + "</Sequence>").encode(),
                     "main.xml:1:48", "more than 65534 nodes", id="70,000 nodes"),
        pytest.param(TREE.format(f'<include path="{"a" * 5000}"/>').replace('<BehaviorTree ID="Main"><inc', "<inc")
                     .replace("</BehaviorTree>", "").encode(), "main.xml:1:39", "is not there", id="a name too long"),
        pytest.param(script(f"x := {'9' * 5000}").encode(), "main.xml:1:67", "a number that is too long", id="digits"),
        pytest.param(script(f"x := 0x{'f' * 5000}").encode(), "main.xml:1:67", "a number that is too long", id="hex digits"),
        pytest.param(script("x := 1e999999999").encode(), "main.xml:1:67", "a number that is too long", id="exponent"),
        pytest.param(script("x := 1.0e-999999999").encode(), "main.xml:1:67", "a number that is too long", id="small exponent"),
        pytest.param(script("x := " + "1+" * 4_000 + "1").encode(), "main.xml:1:", "more than 200 words", id="a sum"),
        pytest.param(script("x:=1;" * 100_000).encode(), "main.xml:1:", "more than 10000 characters", id="statements"),
    ],
)  # fmt: skip
def test_a_rude_tree_is_refused(tmp_path: Path, content: bytes, place: str, text: str) -> None:
    (tmp_path / "main.xml").write_bytes(content)
    expect(tmp_path, compile_here(tmp_path), place, text)


def test_a_long_sum_within_the_limit_compiles(tmp_path: Path) -> None:
    (tmp_path / "main.xml").write_text(script("x := " + "1+" * 98 + "1; y := x"))
    assert compile_here(tmp_path).exit_code == 0


def test_a_folder_is_no_tree(tmp_path: Path) -> None:
    (tmp_path / "main.xml").mkdir()
    expect(tmp_path, compile_here(tmp_path), "main.xml", "cannot be read: Is a directory")


@pytest.mark.parametrize(
    ("content", "place", "text"),
    [
        pytest.param("", "bus.dbc", "not a DBC that can be read", id="empty"),
        pytest.param("\0" * 100, "bus.dbc", "not a DBC that can be read", id="NUL bytes"),
        pytest.param("VERSION " + "a" * 20_000_000, "bus.dbc", "bytes; at most", id="20 MB"),
    ],
)  # fmt: skip
def test_a_rude_dbc_is_refused(tmp_path: Path, content: str, place: str, text: str) -> None:
    (tmp_path / "main.xml").write_text(TREE.format("<AlwaysSuccess/>"))
    (tmp_path / "bus.dbc").write_text(content)
    expect(tmp_path, compile_here(tmp_path, dbc=tmp_path / "bus.dbc"), place, text)
    codec = CliRunner().invoke(main, ["codec", str(tmp_path / "bus.dbc"), "-o", str(tmp_path / "out")])
    expect(tmp_path, codec, place, text)


@pytest.mark.parametrize("missing", ["output", "depfile", "stubs"])
def test_where_one_file_cannot_be_written_none_is(tmp_path: Path, missing: str) -> None:
    (tmp_path / "main.xml").write_text(TREE.format("<AlwaysSuccess/>"))
    (tmp_path / "file").write_text("")
    places = {name: tmp_path / name for name in ("output", "depfile", "stubs")}
    places[missing] = tmp_path / "file" / "in it"  # not even root can write there
    more = ["--stubs", str(places["stubs"]), "--depfile", str(places["depfile"]), "-o", str(places["output"])]
    result = compile_here(tmp_path, *more)
    assert result.exit_code == 2
    assert f"{tmp_path / 'file'}" in result.stderr and "cannot be written: Not a directory" in result.stderr
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == ["file", "main.xml"]


@pytest.mark.parametrize(
    ("content", "place", "text"),
    [
        pytest.param(b"x" * 100_000_000, "main.xml", "the file has 100000000 bytes", id="100 MB"),
        pytest.param(b'<?xml version="1.0" encoding="klingon"?><root/>', "main.xml:1:1", "unknown encoding", id="encoding"),
        pytest.param(b"<a>" * 70_000 + b"</a>" * 70_000, "main.xml:1:196603", "more than 65534 deep", id="depth"),
    ],
)  # fmt: skip
def test_fmt_refuses_what_it_cannot_write(tmp_path: Path, content: bytes, place: str, text: str) -> None:
    (tmp_path / "main.xml").write_bytes(content)
    expect(tmp_path, CliRunner().invoke(main, ["fmt", str(tmp_path / "main.xml")]), place, text)
    assert (tmp_path / "main.xml").read_bytes() == content
