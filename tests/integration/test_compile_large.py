# SPDX-License-Identifier: MIT
"""A tree of 10,000 nodes, half of them scripts: compiled in time, and to the same bytes every time."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

from integration.language import DBC, tree

# docs/xml.md says less than 2 s, on a desk that does nothing else: there it takes 1.4 s. Here there are others.
SECONDS_MAX = 4.0


def large() -> str:
    parts = [
        f"<Sequence><Script code='x{i % 500} := {i}; y := x{i % 500} + {i % 7}'/>"
        f"<ScriptCondition code='y &gt; {i} &amp;&amp; Climate.Temperature &lt; {i % 50}.5'/>"
        f"<Go speed='{i % 100}'/></Sequence>"
        for i in range(2500)
    ]
    return tree("<Sequence>" + "\n".join(parts) + "</Sequence>")


def compile_once(file: Path, output: Path, seed: str) -> tuple[dict[str, bytes], float]:
    """The files, and the processor time that it took."""
    command = [sys.executable, "-m", "canopy", "compile", str(file), "--dbc", str(DBC), "--node", "Controller"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(
        [*command, "--period-ms", "10", "-o", str(output)],
        env=os.environ | {"PYTHONHASHSEED": seed},
        check=True,
        capture_output=True,
    )
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    return {path.name: path.read_bytes() for path in output.iterdir()}, seconds


def test_ten_thousand_nodes_take_seconds_and_give_the_same_bytes(tmp_path: Path) -> None:
    file = tmp_path / "main.xml"
    file.write_text(large())
    first, seconds = compile_once(file, tmp_path / "first", "1")
    second, _ = compile_once(file, tmp_path / "second", "2")
    assert b"MAIN_NODES 10001u" in first["main_app.h"]
    assert first == second
    print(f"{seconds:.2f} s of processor time")
    assert seconds < SECONDS_MAX
