# SPDX-License-Identifier: MIT
"""Coverage of runtime/ out of clang's counters; fails below 100 % of regions, branches and conditions (MC/DC).

A region is what clang counts for lines: a line, or a part of one that is run or not by itself.

usage: report.py BUILD_FOLDER SOURCE_FOLDER

Needs llvm-profdata and llvm-cov of clang's version (CANOPY_LLVM, default 19: llvm-cov-19). A header's inline function
is compiled into many objects: what one of them has covered is covered. A line that has the comment `not covered: why`
is left out and counted as justified.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

VERSION = os.environ.get("CANOPY_LLVM", "19")
MARK = "not covered:"
CODE_REGION = 0

Place = tuple[str, int, int, int]
"""File, line, column, and which of the outcomes or conditions there."""


def export(build: Path, source: Path) -> Any:
    """Merge the counters of all runs; llvm-cov's account of the files in `source`."""
    merged = build / "coverage.profdata"
    profiles = sorted(map(str, (build / "profiles").glob("*.profraw")))
    if not profiles:
        sys.exit(f"{build}/profiles holds no counters; `make coverage` runs the tests so that they leave some there")
    subprocess.run([f"llvm-profdata-{VERSION}", "merge", "-o", str(merged), *profiles], check=True)
    programs = [path for path in sorted((build / "tests" / "unit").glob("test_*")) if os.access(path, os.X_OK)]
    first, *others = [str(path) for path in programs if path.is_file()]
    objects = [first, *(argument for path in others for argument in ("-object", path))]
    command = [f"llvm-cov-{VERSION}", "export", "-instr-profile", str(merged), *objects, str(source)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def account(data: Any, source: Path) -> dict[str, dict[Place, bool]]:
    """What there is to cover, by kind, and whether some run has."""
    seen: dict[str, dict[Place, bool]] = {"regions": {}, "branches": {}, "MC/DC": {}}

    def note(kind: str, place: Place, covered: bool) -> None:
        seen[kind][place] = seen[kind].get(place, False) or covered

    for function in data["functions"]:
        names = function["filenames"]
        for line, column, end_line, _, count, file, _, kind in function["regions"]:
            if kind == CODE_REGION and Path(names[file]).is_relative_to(source):
                note("regions", (names[file], line, column, end_line), count > 0)
    for file in data["files"]:
        for line, column, _, _, count, false_count, *_ in file["branches"]:
            note("branches", (file["filename"], line, column, 1), count > 0)
            note("branches", (file["filename"], line, column, 0), false_count > 0)
        for line, column, *_, conditions in file["mcdc_records"]:
            for number, covered in enumerate(conditions, 1):
                note("MC/DC", (file["filename"], line, column, number), covered)
    return seen


def explain(kind: str, place: Place, source: Path) -> str:
    """A place that is not covered, for a reader."""
    file, line, column, which = place
    what = {
        "regions": "never run",
        "branches": f"never {'true' if which else 'false'}",
        "MC/DC": f"condition {which} has never decided the outcome by itself",
    }[kind]
    return f"{Path(file).relative_to(source.parent)}:{line}:{column}: {what}"


def main() -> int:
    """Print the table and what is missing."""
    build, source = (Path(argument).resolve() for argument in sys.argv[1:3])
    seen = account(export(build, source)["data"][0], source)
    kinds = list(seen)
    table: dict[str, dict[str, list[int]]] = defaultdict(lambda: {kind: [0, 0] for kind in kinds})
    missing: list[str] = []
    justified = 0
    for kind, places in seen.items():
        for place, covered in sorted(places.items()):
            if not covered and MARK in Path(place[0]).read_text(encoding="utf-8").splitlines()[place[1] - 1]:
                justified += 1
                continue
            for row in (str(Path(place[0]).relative_to(source.parent)), "all"):
                table[row][kind][0] += covered
                table[row][kind][1] += 1
            if not covered:
                missing.append(explain(kind, place, source))
    print(f"{'':44}{''.join(f'{kind:>14}' for kind in kinds)}")
    for row in sorted(table, key=lambda name: (name == "all", name)):
        print(f"{row:44}{''.join(f'{done:>6} of {total:<4}' for done, total in table[row].values())}")
    percent = ", ".join(f"{kind} {100 * done / total:.1f} %" for kind, (done, total) in table["all"].items())
    print(f"{percent}; {justified} left out with a reason in place")
    print("\n".join(missing))
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
