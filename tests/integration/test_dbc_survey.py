# SPDX-License-Identifier: MIT
"""Every codec that is made is right, and `canopy dbc survey` counts what is made.

CANOPY_BUS_FOLDERS names more folders, separated by colons: docs/dbc.md has what comes of three public collections.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.bus.survey import SUFFIXES, survey_file
from canopy.cli import main
from canopy.compiler.bus_reader import read_messages
from canopy.compiler.errors import CompileError
from integration.codec_compare import compare
from integration.compilers import COMPILERS

HERE = Path(__file__).parent
SEED = int(os.environ.get("CANOPY_SEED", "20261130"))
MORE = os.environ.get("CANOPY_BUS_FOLDERS", "").split(":")
FOLDERS = [HERE / "dbc", HERE / "dbc_met", *(Path(folder) for folder in MORE if folder)]
FILES = sorted(path for folder in FOLDERS for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_codec_that_is_made_is_right(path: Path, tmp_path: Path, compiler: str) -> None:
    try:
        read_messages(path)
    except CompileError as error:
        assert path.parent.parent != HERE, error  # of the own ones each gives a codec
        return
    result = compare(path, tmp_path, SEED, compiler=compiler)
    assert not result.wrong, (SEED, result.wrong[:5])
    assert result.values > 0 or result.messages == 0


def test_what_is_wrong_with_a_makers_file_costs_little() -> None:
    result = survey_file(HERE / "dbc_met" / "maker.dbc", "maker.dbc")
    assert (result.messages, result.compiled, result.dropped) == (10, 8, 1)
    wanted = ["BO_ cannot be read here", "the id 0x40000100 of me"]
    assert [reason[:23] for reason in result.reasons] == wanted
    assert (result.tries, result.applications, result.failed) == (2, 2, [])


def test_the_table_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "bad.kcd").write_text("<x")
    for name in ("maker.dbc",):
        (tmp_path / name).write_bytes((HERE / "dbc_met" / name).read_bytes())
    result = CliRunner().invoke(main, ["dbc", "survey", str(tmp_path), "-o", str(tmp_path / "table.md")])
    assert result.exit_code == 1, result.output
    table = (tmp_path / "table.md").read_text()
    assert f"| {tmp_path.name} | 2 | 1 | 10 |" in table and "| 8 (80.0 %) | 2 of 2 | 20 % |" in table
    assert "| maker.dbc | 10 | 2 | 1 x a line that cannot be read; 1 x id of more than 29 bits |" in table
    assert "| bad.kcd | 0 | 0 | not a KCD file that can be read" in table
    assert CliRunner().invoke(main, ["dbc", "survey", str(tmp_path / "none")]).exit_code == 2
