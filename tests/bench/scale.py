# SPDX-License-Identifier: MIT
"""What large trees cost on the desk: processor time and memory of `canopy compile`, `show` and `fmt`, and gcc's time.

python tests/bench/scale.py [--nodes 10000]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
BUS = [
    "--dbc",
    str(ROOT / "tests" / "corpus" / "bus.dbc"),
    "--node",
    "Controller",
    "--period-ms",
    "50",
    "--name",
    "scale",
]


def sequence(nodes: int, node: Callable[[int], str]) -> str:
    """A Sequence of that many nodes."""
    return f"<Sequence>{''.join(map(node, range(nodes)))}</Sequence>"


TREES: dict[str, Callable[[int], str]] = {
    "structure": lambda nodes: sequence(nodes // 2, lambda _: "<Sequence><AlwaysSuccess/></Sequence>"),
    "scripts of their own entries": lambda nodes: sequence(nodes, lambda i: f'<Script code="x{i} := {i}"/>'),
    "scripts of shared entries": lambda nodes: sequence(nodes, lambda i: f'<Script code="x := {i}; y := x + 1"/>'),
    "the same condition everywhere": lambda nodes: sequence(nodes, lambda _: '<ScriptCondition code="a &gt; 3"/>'),
}
CONDITION = '<Script code="a := 1"/>'


def run(command: list[str]) -> tuple[float, int]:
    """Processor time [s] and peak memory [MB] of a command."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=os.environ)
    _, status, used = os.wait4(child.pid, 0)
    if status != 0:
        raise SystemExit(f"{' '.join(command[:4])} … failed")
    return used.ru_utime + used.ru_stime, used.ru_maxrss // 1024


def main() -> None:
    """Prints a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=10_000)
    nodes = parser.parse_args().nodes
    canopy = [sys.executable, "-m", "canopy"]
    print(f"| {nodes} nodes | command | processor time | memory |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder) / "scale.xml", Path(folder) / "out"

        def show(what: str, name: str, command: list[str]) -> None:
            seconds, megabytes = run(command)
            print(f"| {what} | {name} | {seconds:.2f} s | {megabytes} MB |", flush=True)

        for what, make in TREES.items():
            inner = (
                make(nodes).replace("<Sequence>", f"<Sequence>{CONDITION}", 1) if "condition" in what else make(nodes)
            )
            file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="M">{inner}</BehaviorTree></root>')
            show(what, "`canopy compile`", [*canopy, "compile", str(file), *BUS, "-o", str(out)])
            include = ["-I", str(ROOT / "runtime" / "include"), "-I", str(out)]
            show(
                what,
                "`gcc -O2`",
                ["gcc", "-std=c11", "-O2", "-c", *include, str(out / "scale_app.c"), "-o", os.devnull],
            )
        chain = "<Inverter>" * nodes + "<AlwaysSuccess/>" + "</Inverter>" * nodes
        file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="M">{chain}</BehaviorTree></root>')
        show("a chain", "`canopy show`", [*canopy, "show", str(file)])
        show("a chain", "`canopy show --svg`", [*canopy, "show", str(file), "--svg", str(Path(folder) / "a.svg")])
        show("a chain", "`canopy fmt`", [*canopy, "fmt", str(file)])
        show("a chain", "`canopy compile`", [*canopy, "compile", str(file), *BUS, "-o", str(out)])


if __name__ == "__main__":
    main()
