# SPDX-License-Identifier: MIT
"""The tables of docs/xml.md and docs/scripts.md: every construct is named with a test, and the test is there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
_CELL = re.compile(r"(?<!\\)\|")


def rows(document: str) -> Iterator[tuple[str, str]]:
    """(construct, tests) of each row of a table whose last column is called test."""
    in_table = False
    for line in (ROOT / "docs" / document).read_text(encoding="utf-8").splitlines():
        if not line.startswith("|"):
            in_table = False
            continue
        cells = [cell.strip() for cell in _CELL.split(line)[1:-1]]
        if cells[-1] == "test":
            in_table = True
        elif in_table and set(cells[-1]) != {"-"}:
            yield cells[0], cells[-1]


@cache
def all_tests() -> str:
    files = [*(ROOT / "tests" / "integration").glob("*.py"), *(ROOT / "tests" / "unit").glob("**/*.c")]
    return "\n".join(file.read_text(encoding="utf-8") for file in sorted(files))


@pytest.mark.parametrize(("document", "least"), [("xml.md", 50), ("scripts.md", 12)])
def test_every_construct_has_a_test_that_is_there(document: str, least: int) -> None:
    found = list(rows(document))
    assert len(found) >= least
    for construct, tests in found:
        names = re.findall(r"`([^`]+)`", tests)
        assert names or tests == "the same", construct
        for name in names:
            if name.endswith((".py", ".c")):
                assert list((ROOT / "tests").glob(f"**/{name}")), (construct, name)
            else:
                stem = re.escape(name.rstrip("…"))
                assert re.search(rf"^(def |static void ){stem}", all_tests(), re.MULTILINE), (construct, name)
