# SPDX-License-Identifier: MIT
"""`canopy convert funnels`: the order, what cannot be placed, and what is rejected."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from canopy.compiler.tree_reader import read_tree
from integration.test_convert import bad, convert, good, written

EXAMPLE_5 = {
    "variables": {"x": [0, 500], "z": [0, 550]},
    "controllers": [
        {"name": "WalkHome", "goal": {"x": [0, 0]}, "domain": {"z": [480, 550]}},
        {"name": "LieDownToSitUp", "goal": {"z": [300, 550]}, "domain": {}},
        {"name": "SitToStand", "goal": {"z": [480, 550]}, "domain": {"z": [300, 550]}},
    ],
}


def children(text: str, tmp_path: Path) -> list[str]:
    path = written(tmp_path, text, "result.xml")
    return [child.name for child in read_tree(path).root.children]


def test_funnels_are_ordered_by_who_prepares_whom(tmp_path: Path) -> None:
    text = good("funnels", written(tmp_path, EXAMPLE_5))
    assert children(text, tmp_path) == ["WalkHome", "SitToStand", "LieDownToSitUp"]  # Fig. 29
    assert text.count("RUNNING SUCCESS FAILURE") == 2 and text.count('"RUNNING SUCCESS"') == 1


def test_a_funnel_that_cannot_be_placed_is_named(tmp_path: Path) -> None:
    family = json.loads(json.dumps(EXAMPLE_5))
    family["controllers"][2]["goal"] = {"z": [470, 550]}  # Sit to Stand ends too low
    result = convert("funnels", written(tmp_path, family))
    assert result.exit_code == 0
    # a robot that lies at home has arrived: only away from home is the goal too low
    assert "SitToStand cannot be placed: its goal contains x = 1, z = 470" in result.stderr
    assert "LieDownToSitUp cannot be placed" in result.stderr


def test_a_goal_may_lie_in_two_domains_together(tmp_path: Path) -> None:
    family = {
        "variables": {"x": [0, 9]},
        "controllers": [
            {"name": "A", "goal": {"x": [0, 0]}, "domain": {"x": [0, 4]}},
            {"name": "C", "goal": {"x": [3, 6]}, "domain": {"x": [3, 9]}},
            {"name": "B", "goal": {"x": [2, 4]}, "domain": {"x": [2, 6]}},
        ],
    }
    assert children(good("funnels", written(tmp_path, family)), tmp_path) == ["A", "B", "C"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"variables": {}}, "variables must be an object"),
        ({"variables": {"x": [5, 1], "z": [0, 9]}}, "variables.x: 5 is more than 1"),
        ({"variables": {"x": [0, 1.5], "z": [0, 9]}}, "must be a whole number, not 1.5"),
        ({"controllers": []}, "controllers must be a list"),
        ({"controllers": [{"name": "A", "goal": {"y": [0, 1]}, "domain": {}}]}, "controllers[0].goal: no variable 'y'"),
        ({"controllers": [{"name": "A", "goal": {"x": [600, 700]}, "domain": {}}]}, "the goal of 'A' is empty"),
        ({"controllers": [{"name": "A", "goal": {}, "domain": {}}] * 2}, "two controllers 'A'"),
    ],
)
def test_wrong_funnels_are_named(tmp_path: Path, change: dict[str, object], message: str) -> None:
    assert message in bad("funnels", written(tmp_path, {**EXAMPLE_5, **change}))


def test_funnels_with_too_many_cells_are_refused(tmp_path: Path) -> None:
    variables = {f"x{n}": [0, 99] for n in range(12)}
    goal = [{name: [10 * n, 10 * n + 5] for name in variables} for n in range(8)]
    family = {"variables": variables, "controllers": [{"name": "A", "goal": goal, "domain": {}}]}
    assert "more than 1000000 cells" in bad("funnels", written(tmp_path, family))
