# SPDX-License-Identifier: MIT
"""docs/convert.md and docs/tools.md as they stand there: their files, their commands, and what those print."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main

REPOSITORY = Path(__file__).parents[2]
PAPERS = REPOSITORY / "examples" / "papers"
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"`([\w.]+\.(?:json|scxml|facts))`")


def blocks(text: str) -> Iterator[tuple[str, str, str]]:
    """(language, content, text since the block before) of each block."""
    end = 0
    for match in FENCE.finditer(text):
        yield match[1], match[2], text[end : match.start()]
        end = match.end()


def run(folder: Path, section: str) -> int:
    """Writes the files of a section, runs its commands, and compares what they print; how many were run."""
    found = list(blocks(section))
    names = list(dict.fromkeys(FILE.findall(section)))
    output, count = "", 0
    for language, content, _ in found:
        if language in ("json", "xml", "facts"):
            (folder / names.pop(0)).write_text(content, encoding="utf-8")
    for language, content, _ in found:
        if language == "sh":
            output = ""
            for line in content.splitlines():
                name, *arguments = shlex.split(line)
                assert name == "canopy"
                result = CliRunner().invoke(main, arguments)
                assert result.exit_code == 0, (line, result.output)
                output += result.output
                count += 1
        elif language == "text":
            for line in content.splitlines():
                assert line in output.splitlines(), (line, output)
    return count


def sections(document: str) -> list[tuple[str, str]]:
    text = (REPOSITORY / "docs" / document).read_text(encoding="utf-8")
    parts = re.split(r"^##+ (.*)$", text, flags=re.MULTILINE)
    return list(zip(parts[1::2], parts[2::2], strict=True))


CONVERT = [part for part in sections("convert.md") if "```sh" in part[1]]


@pytest.mark.parametrize("section", CONVERT, ids=[name for name, _ in CONVERT])
def test_the_page_says_what_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, section: tuple[str, str]) -> None:
    monkeypatch.chdir(tmp_path)
    for file in (PAPERS / "papers.dbc", PAPERS / "trees" / "fig6.xml"):
        shutil.copy(file, tmp_path)
    assert run(tmp_path, section[1]) >= 1


def test_simplify_as_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(PAPERS / "trees" / "fig21.xml", tmp_path)
    (section,) = [text for name, text in sections("tools.md") if name == "Simplify"]
    assert run(tmp_path, section) == 1


@pytest.mark.parametrize("name", ["fig21.xml", "layers.xml", "home.xml", "fetch.xml"])
def test_results_compile_and_pass_the_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Each example's result, through `canopy compile` and `canopy check --strict`."""
    monkeypatch.chdir(tmp_path)
    for file in (PAPERS / "papers.dbc", PAPERS / "trees" / "fig6.xml"):
        shutil.copy(file, tmp_path)
    section = next(text for _, text in CONVERT if f"-o {name}" in text)
    run(tmp_path, section)
    bus = ["--dbc", "papers.dbc", "--node", "Controller"]
    result = CliRunner().invoke(main, ["compile", name, *bus, "--period-ms", "100", "-o", "generated"])
    assert result.exit_code == 0, result.output
    result = CliRunner().invoke(main, ["check", name, *bus, "--strict"])
    assert result.exit_code == 0, result.output
