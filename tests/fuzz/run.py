# SPDX-License-Identifier: MIT
"""Runs the fuzz targets, one after the other, and says how many inputs each has taken.

usage: run.py BUILD_FOLDER SECONDS

SECONDS are shared out; fuzz_tree, the largest, gets half. Each target first runs what lies in corpus/TARGET, the
regressions among it; then it searches on. New inputs stay in the build folder. Exit status 1 when something was found:
the input is kept beside, and the line to run it alone is printed. Put it into corpus/TARGET, and mend what it shows.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SHARES = {"fuzz_tree": 4, "fuzz_image": 2, "fuzz_bus": 1, "fuzz_ring": 1}
OPTIONS = ["-timeout=5", "-rss_limit_mb=1024", "-max_len=1024", "-print_final_stats=1"]


def run(program: Path, kept: Path, seconds: int) -> bool:
    """Run one target; True when nothing was found."""
    work = program.parent / "corpus" / program.name
    found = program.parent / "found" / program.name
    for folder in (work, found):
        folder.mkdir(parents=True, exist_ok=True)
    corpora = [str(work), *([str(kept)] if kept.is_dir() else [])]  # a target without regressions has no folder
    command = [str(program), *corpora, *OPTIONS, f"-max_total_time={seconds}", f"-artifact_prefix={found}/"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    executions = re.search(r"number_of_executed_units: (\d+)", result.stderr)
    coverage = re.findall(r"cov: (\d+)", result.stderr)
    count = f"{int(executions[1]):,}" if executions else "no"
    print(
        f"{program.name:10} {seconds:5} s {count:>14} executions, {coverage[-1] if coverage else 0} edges", flush=True
    )
    if result.returncode != 0:
        print(result.stderr[-4000:])
        print(f"Found something. To see it again: {program} {found}/<the file named above>")
    return result.returncode == 0


def main() -> int:
    """Run them all."""
    build, seconds = Path(sys.argv[1]).resolve() / "tests" / "fuzz", int(sys.argv[2])
    kept = Path(__file__).resolve().parent / "corpus"
    shares = sum(SHARES.values())
    results = [run(build / name, kept / name, max(1, seconds * share // shares)) for name, share in SHARES.items()]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
