# SPDX-License-Identifier: MIT
"""A model that is not one is rejected with file, line, leaf, and what to write."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.errors import CompileError
from canopy.verify.run import load, verify

ROOT = Path(__file__).parents[2]
HOME = ROOT / "examples/nao/trees/get_home.xml"
DBC = ROOT / "examples/nao/nao.dbc"
MODEL = HOME.with_suffix(".plant.toml").read_text()

SIT = MODEL[MODEL.index("[leaves.SitToStand]") : MODEL.index('next = { x2 = "x2 + 0.05" }')]

# (old text, new text, what the error says, what it says to write); the line is that of the new text's first line, or
# of the key or table that `at` begins.
WRONG = {
    "not TOML": ("format = 1", "format = ", "not valid TOML", "", "format"),
    "another format": ("format = 1", "format = 2", "format is 2", "write format = 1", "format"),
    "no range": ("range = [0, 0.55]\n", "", "variable 'x2' has no range", "write range = [0, 100]", "[variables.x2]"),
    "range upside down": ("range = [0, 0.55]", "range = [1, 0]", "1 is above 0", "smaller number first", "range = [1"),
    "unknown key": ('signal = "Posture.HeadX"', 'signl = "x"', "variable 'x1' has no key 'signl'", "'signal'", "signl"),
    "overlap": (
        'failure = "x1 > 0 and x2 < 0.48"',
        'failure = "x1 >= 0 and x2 < 0.48"',
        "success and failure of leaf 'WalkHome' overlap, for example at x1 = 0 m",
        "take it out of one of them",
        "[leaves.WalkHome]",
    ),
    "as the paper prints it": (
        'running = "else"\n\n[[leaves.WalkHome',
        'running = "x1 != 0 and x2 >= 0.48"\n\n[[leaves.WalkHome',
        "success and running of leaf 'WalkHome' overlap",
        'running = "else"',
        "[leaves.WalkHome]",
    ),
    "gap": (
        'success = "x2 >= 0.48"\nfailure = "x2 < 0.3"\nrunning = "else"',
        'success = "x2 >= 0.48"\nfailure = "x2 < 0.3"\nrunning = "x2 > 0.3 and x2 < 0.48"',
        "leaf 'SitToStand' returns nothing at x1 = 0.5 m, x2 = 0.3 m",
        'write "else" for one of them',
        "[leaves.SitToStand]",
    ),
    "not linear": (
        'next = { x1 = "x1 - 0.1" }',
        'next = { x1 = "x1 * x2" }',
        "next x1 of leaf 'WalkHome': this is not linear: it multiplies two variables, at 'x2'",
        "sums of numbers times variables",
        "next = { x1",
    ),
    "no such variable": (
        'success = "x1 <= 0"',
        'success = "x3 <= 0"',
        "success of leaf 'WalkHome': no variable 'x3'",
        "x1",
        "success =",
    ),
    "units": ('success = "x1 <= 0"', 'success = "x1 <= 5[s]"', "units do not match: m and s", "brackets", "success ="),
    "a number for a condition": ('success = "x1 <= 0"', 'success = "x1"', "this is a number", "x1 > 0", "success ="),
    "leaves the state space": (
        "range = [0, 0.55]",
        "range = [0, 0.5]",
        "leaf 'SitToStand' leaves the state space: from x1 = 0.5 m",
        "widen the range",
        "[[leaves.SitToStand.modes]]",
    ),
    "no mode": (
        '[[leaves.LieDownToSitUp.modes]]\nnext = { x2 = "x2 + 0.03" }\nwrites = { "PostureCommand.Mode" = "SitUp" }\n',
        "",
        "leaf 'LieDownToSitUp' is RUNNING at",
        "write [[leaves.LieDownToSitUp.modes]]",
        "[leaves.LieDownToSitUp]",
    ),
    "two modes at once": (
        "[leaves.SitToStand]",
        "[[leaves.WalkHome.modes]]\nnext = {}\n\n[leaves.SitToStand]",
        "two modes of leaf 'WalkHome' hold at",
        "let 'when' or 'where' divide them",
        "[[leaves.WalkHome.modes]]\nnext = {}",
    ),
    "a leaf that the tree has not": (
        SIT,
        SIT.replace("SitToStand", "SitToStan"),
        "the tree has no leaf 'SitToStan'",
        "'SitToStand'",
        "[leaves.SitToStan]",
    ),
    "no such signal": (
        '"Posture.HeadX"',
        '"Posture.HeadXX"',
        "the bus has no signal 'Posture.HeadXX'",
        "Posture.HeadX",
        "[variables.x1]",
    ),
    "another unit than the signal": (
        'unit = "m"\nrange = [0, 0.55]',
        'unit = "mm"\nrange = [0, 0.55]',
        "its signal 'Posture.HeadHeight' in 'm'",
        'unit = "m"',
        "[variables.x2]",
    ),
    "beyond the signal": (
        "range = [-0.1, 0.5]",
        "range = [-0.1, 50]",
        "goes beyond the range of its signal",
        "narrow",
        "[variables.x1]",
    ),
    "no such command": (
        '{ "PostureCommand.Mode" = "SitUp" }',
        '{ "PostureCommand.Mode" = "SitUpp" }',
        "no value named 'SitUpp'",
        "SitUp",
        "[[leaves.LieDownToSitUp.modes]]",
    ),
    "unknown kind of claim": (
        'kind = "stays"',
        'kind = "stay"',
        "has kind 'stay'",
        "expected one of",
        '[[claims]]\nname = "Home is home"',
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_model_is_rejected(tmp_path: Path, case: str) -> None:
    old, new, message, help_text, at = WRONG[case]
    assert MODEL.count(old) >= 1
    text = MODEL.replace(old, new, 1)
    model = tmp_path / "wrong.toml"
    model.write_text(text)
    with pytest.raises(CompileError) as error:
        load(HOME, model, DBC, "Controller")
    assert message in str(error.value), str(error.value)
    assert help_text in error.value.help_text
    assert error.value.place.file == str(model)
    assert error.value.place.line == text[: text.index(at)].count("\n") + 1


@pytest.mark.parametrize(
    ("claim", "message"),
    [
        ('kind = "reaches"\nfrm = "x1 > 0"', "has no key 'frm'"),
        ('kind = "avoids"', "needs the key 'avoid'"),
        ('kind = "reaches"\nof = "Walk Hom"', "of: the tree has no node 'Walk Hom'"),
        ('kind = "reaches"\nfrom = "x1 > 3"', "starts from no state"),
        ('kind = "reaches"\nwithin = "5"', "'within' must be a whole number"),
        ('kind = "avoids"\navoid = "x2 <"', "avoid of 'wrong': the expression ends too early"),
        ('kind = "reaches"\narbitrary = { "Walk Home" = -1 }', "no step is shorter than -1"),
        (
            'kind = "reaches"\ndisturbance = { x1 = [-1, 0] }',
            "with this disturbance 'Walk Home' leaves the state space",
        ),
        ('kind = "reaches"\nexpect = "true"', "expects 'true'"),
    ],
)
def test_a_wrong_claim_is_rejected(tmp_path: Path, claim: str, message: str) -> None:
    model = tmp_path / "wrong.toml"
    model.write_text(f'{MODEL}\n[[claims]]\nname = "wrong"\n{claim}\n')
    subject = load(HOME, model)
    with pytest.raises(CompileError) as error:
        verify(subject, subject.plant.claims[-1])
    assert message in str(error.value)
    assert error.value.place.line > MODEL.count("\n")


def test_a_leaf_with_modes_alone_is_named_at_its_modes(tmp_path: Path) -> None:
    model = tmp_path / "m.toml"
    text = MODEL.replace("[leaves.SitToStand]", "[leaves.Another]")
    model.write_text(text)
    with pytest.raises(CompileError) as error:
        load(HOME, model)
    assert error.value.message == "leaf 'SitToStand' has no regions"
    assert error.value.place.line == text[: text.index("[[leaves.SitToStand.modes]]")].count("\n") + 1


def test_a_leaf_without_a_model_is_named_where_the_tree_has_it(tmp_path: Path) -> None:
    model = tmp_path / "m.toml"
    model.write_text(MODEL[: MODEL.index("[leaves.LieDownToSitUp]")] + '[[claims]]\nkind = "reaches"\n')
    result = CliRunner().invoke(main, ["verify", str(HOME), "--model", str(model)])
    assert result.exit_code == 2
    assert "get_home.xml:8:7: error: leaf 'LieDownToSitUp' has no model in" in result.output
    assert "help: write [leaves.LieDownToSitUp]" in result.output


def test_a_node_with_a_memory_is_not_a_function_of_the_state(tmp_path: Path) -> None:
    tree = tmp_path / "memory.xml"
    tree.write_text(HOME.read_text().replace("ReactiveFallback", "Fallback"))
    model = HOME.with_suffix(".plant.toml")
    result = CliRunner().invoke(main, ["verify", str(tree), "--model", str(model)])
    assert result.exit_code == 2
    assert "<Fallback> has a memory" in result.output
    assert "help: use <ReactiveFallback>" in result.output


def test_a_free_leaf_that_may_be_skipped_has_no_model(tmp_path: Path) -> None:
    tree, model = tmp_path / "fig16.xml", tmp_path / "fig16.plant.toml"
    source = ROOT / "examples/papers/trees/fig16.xml"
    declared = "<MetadataFields><Metadata returns='RUNNING SKIPPED'/></MetadataFields></Action>"
    tree.write_text(
        source.read_text().replace('<Action ID="PerformMission"/>', f'<Action ID="PerformMission">{declared}')
    )
    model.write_text(source.with_suffix(".plant.toml").read_text())
    result = CliRunner().invoke(main, ["verify", str(tree), "--claim", "It can chatter, as at the right of Fig. 18"])
    assert result.exit_code == 2
    assert "leaf 'PerformMission' may return SKIPPED" in result.output


def test_rude_files_end_with_an_error(tmp_path: Path) -> None:
    for number, text in enumerate(
        (
            "",
            "\0",
            "format = 1e999999",
            "format = nan",
            "a = [[[[[[" * 1000,
            "format = 1\nvariables = 3",
            "[[variables]]",
        )
    ):
        model = tmp_path / f"{number}.toml"
        model.write_text(text)
        with pytest.raises(CompileError):
            load(HOME, model)
    model = tmp_path / "deep.toml"
    for text in ("(" * 3000 + "x1 > 0" + ")" * 3000, "x1 > 0 or " * 5000 + "x1 > 0", "not " * 900 + "x1 > 0"):
        model.write_text(MODEL.replace('success = "x1 <= 0"', f'success = "{text}"'))
        with pytest.raises(CompileError):
            load(HOME, model)
