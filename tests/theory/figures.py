# SPDX-License-Identifier: MIT
"""The paper's phase portraits in docs/figures, as arguments of `canopy plot phase`; `make figures` writes them all."""

from __future__ import annotations

import sys
from pathlib import Path

from click.testing import CliRunner

from canopy.cli import main

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "figures"
DOOR, SHUT = "examples/papers/trees/fig3.xml", "examples/papers/trees/fig14.xml"
UAV = "examples/papers/trees/fig16.xml"
POWER, HOME = "examples/nao/trees/power_supply.xml", "examples/nao/trees/get_home.xml"
FIGURES: dict[str, list[str]] = {
    "fig12": [DOOR, "--run", "place=-4,door=0", "--title", "Fig. 12: Sequence(Open, Pass)"],
    "fig15": [SHUT, "--run", "place=-3,door=20", "--title", "Fig. 15: Fallback(Pass, Open)"],
    "fig17-guard": [UAV, "--of", "Guarantee Altitude > 1000 ft", "--title", "Fig. 17: Guarantee Altitude"],
    "fig17-mission": [UAV, "--of", "Perform Mission", "--title", "Fig. 17: Perform Mission, which is arbitrary"],
    "fig18": [UAV, "--title", "Fig. 18: Sequence(Guarantee Altitude, Perform Mission)"],
    "fig26": [POWER, "--of", "Guarantee Power Supply", "--title", "Fig. 26: Guarantee Power Supply"],
    "fig27": [POWER, "--of", "Do Other Task", "--title", "Fig. 27: Do Other Task"],
    "fig28": [POWER, "--run", "x1=80,x2=50", "--steps", "500",
              "--title", "Fig. 28: Sequence(Guarantee Power Supply, Do Other Task)"],
    "fig30": [HOME, "--of", "Walk Home", "--title", "Fig. 30: Walk Home"],
    "fig31": [HOME, "--of", "Sit to Stand", "--title", "Fig. 31: Sit to Stand"],
    "fig32": [HOME, "--of", "Lie down to Sit up", "--title", "Fig. 32: Lie down to Sit up"],
    "fig33": [HOME, "--run", "x1=0.5,x2=0", "--run", "x1=0.3,x2=0.4",
              "--title", "Fig. 33: Fallback of the three"],
}  # fmt: skip


def draw(name: str, target: Path) -> str:
    """Writes a figure; returns what the command printed."""
    tree, *options = FIGURES[name]
    result = CliRunner().invoke(main, ["plot", "phase", str(ROOT / tree), *options, "-o", str(target)])
    if result.exit_code != 0:
        raise RuntimeError(f"{name}: {result.output}")
    return result.output


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for figure in FIGURES:
        sys.stdout.write(f"{figure}: {draw(figure, FOLDER / f'{figure}.svg')}\n")
