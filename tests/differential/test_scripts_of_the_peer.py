# SPDX-License-Identifier: MIT
"""Scripts as in BehaviorTree.CPP 4.10, one row a claim of docs/scripts.md, compiled to C and run.

The release that can be installed and run is 4.8.2. Rows that it computes alike are run there, too; the others are what
4.9 changed (precedence, order of - and /, what may be nested), or a difference that docs/scripts.md names.
"""

from __future__ import annotations

import ctypes
import subprocess
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from click.testing import CliRunner

from canopy.cli import main
from differential.platforms import needs_btcpp

ROOT = Path(__file__).parents[2]
DBC = ROOT / "tests" / "unit" / "language" / "language.dbc"
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Werror"]


@dataclass(frozen=True)
class Row:
    """A script that writes `r`, and what it then is. `since`: the release from which on BehaviorTree.CPP says so."""

    script: str
    value: float | str
    since: str = "4.8"


ROWS = (
    # && binds tighter than ||, and both looser than comparisons
    Row("r := 1 || 0 && 0", 1, "4.9"),
    Row("r := 0 && 0 || 1", 1),
    Row("r := (1 || 0) && 0", 0),
    Row("r := 1 < 2 && 3 < 2", 0),
    Row("r := 1 == 1 || 2 == 3", 1),
    # bits: | and ^ alike, then &; both tighter than comparisons, looser than arithmetic
    Row("r := 6 & 3 + 1", 4, "4.9"),
    Row("r := 1 | 6 & 3", 3),
    Row("r := 1 ^ 3 | 4", 6),
    Row("r := 4 & 6 == 4", 1),
    Row("r := ~5 & 7", 2),
    # arithmetic, from left to right
    Row("r := 10 - 3 - 2", 5, "4.9"),
    Row("r := 24 / 4 / 2", 3, "4.9"),
    Row("r := 2 + 3 * 4", 14),
    Row("r := -2 * 3", -6),
    Row("r := 7 / 2", 3.5),
    Row("r := !0 + 1", 2, "4.9"),
    # comparisons chain
    Row("r := 1 < 2 < 3", 1),
    Row("r := 3 > 2 > 2", 0),
    # texts
    Row("r := 'a' + 'b'", "ab"),
    Row("r := 'a' .. 'b' .. 'c'", "abc"),
    Row("r := 'a' < 'b'", 1),
    Row("r := 'B' < 'a'", 1),
    Row("r := 'b' <= 'ab'", 0),
    Row("t := 'ab'; r := t < 'b'", 1),
    Row("t := 'c'; r := t >= 'b' ? 1 : 0", 1),
    Row("t := 'b'; u := 'a'; r := t > u", 1),
    Row("x := 5; r := x == '5'", 1),
    Row("x := 5; r := '6' > x", 1),
    # ?: is nested on the right, and takes assignments
    Row("r := 0 ? 2 : 0 ? 4 : 5", 5, "4.9"),
    Row("a := 0; b := 0; a ? b := 4 : b; r := b", 0),
    # an assignment has a value
    Row("r := a := 3", 3, "4.9"),
    Row("r := (a := 3) + a", 6),
    Row("a := 1; r := (a += 2) * 2; r := r + a", 9),
    # statements
    Row("a := 1;; r := a + 1;", 2, "4.9"),
    Row("r := 0x1F", 31),
    Row("r := true", 1),
    Row("r := 1.5e1", 15),
)


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> list[float | str]:
    """What each row's script gives here: one tree each, in one program."""
    folder = tmp_path_factory.mktemp("rows")
    scripts = [f"<Script code={quoteattr(row.script)}/>" for row in ROWS]
    trees = "".join(f'<BehaviorTree ID="T{n}">{script}</BehaviorTree>' for n, script in enumerate(scripts))
    calls = "".join(f'<SubTree ID="T{n}" name="t{n}"/>' for n, _ in ROWS_)
    main_tree = f'<BehaviorTree ID="Main"><Sequence>{calls}</Sequence></BehaviorTree>'
    root = f'<root BTCPP_format="4" main_tree_to_execute="Main">{main_tree}{trees}</root>'
    (folder / "rows.xml").write_text(root, encoding="utf-8")
    bus = ["--dbc", str(DBC), "--node", "Controller", "--period-ms", "10", "--allow-floating-point"]
    result = CliRunner().invoke(main, ["compile", str(folder / "rows.xml"), *bus, "-o", str(folder)])
    assert result.exit_code == 0, result.output
    texts = [n for n, row in ROWS_ if isinstance(row.value, str)]
    numbers = "".join(f"case {n}: return (double)rows_entries->t{n}_r;" for n, _ in ROWS_ if n not in texts)
    names = "".join(f"case {n}: return rows_texts[rows_entries->t{n}_r];" for n in texts)
    (folder / "harness.c").write_text(
        '#include "rows_app.h"\n'
        "void run(int script); double number(int row); const char *text(int row);\n"
        "void run(int script) { (void)rows_app.tree->scripts[rows_app.tree->nodes[script + 1].parameter]"
        "(rows_app.memory); }\n"
        f"double number(int row) {{ switch (row) {{ {numbers} default: return 0; }} }}\n"
        f'const char *text(int row) {{ switch (row) {{ {names} default: return ""; }} }}\n'
    )
    sources = [folder / "harness.c", *folder.glob("*_app.c"), *folder.glob("*_bus.c")]
    include = ["-I", str(ROOT / "runtime" / "include"), "-I", str(folder)]
    flags = ["-std=c11", "-O1", "-fPIC", "-shared", *WARNINGS]
    subprocess.run(["gcc", *flags, *include, *map(str, sources), "-o", str(folder / "rows.so")], check=True)
    library = ctypes.CDLL(str(folder / "rows.so"))
    library.number.restype, library.text.restype = ctypes.c_double, ctypes.c_char_p
    for n, _ in ROWS_:
        library.run(n)
    return [library.text(n).decode() if n in texts else library.number(n) for n, _ in ROWS_]


ROWS_ = tuple(enumerate(ROWS))


@pytest.mark.parametrize(("number", "row"), ROWS_, ids=[row.script for row in ROWS])
def test_a_script_gives_what_it_gives_in_4_10(computed: list[float | str], number: int, row: Row) -> None:
    assert computed[number] == row.value


@needs_btcpp
@pytest.mark.parametrize("row", ROWS, ids=[row.script for row in ROWS])
def test_the_installed_release_differs_only_where_4_9_changed_it(row: Row) -> None:
    import behaviortreepy as bt

    board = bt.Blackboard.create()
    text = f'<root BTCPP_format="4"><BehaviorTree ID="T"><Script code={quoteattr(row.script)}/></BehaviorTree></root>'
    found: float | str | None
    try:
        bt.BehaviorTreeFactory().create_tree_from_text(text, board).tick_exactly_once()
        found = board.get_string("r") if isinstance(row.value, str) else board.get_double("r")
    except RuntimeError:
        found = None
    assert (found == row.value) == (row.since == "4.8"), found
