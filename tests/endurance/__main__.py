# SPDX-License-Identifier: MIT
"""The command line of the long runs."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from endurance import killing, long_run


def main() -> int:
    """Reads the command line."""
    parser = argparse.ArgumentParser(prog="endurance", description="Runs that take long.")
    parser.add_argument("what", choices=("long", "kill"))
    parser.add_argument("--build", type=Path, default=Path("build/host"), help="build folder  [build/host]")
    parser.add_argument("--seconds", type=float, default=3600.0, help="long: how long it lasts  [3600]")
    parser.add_argument("--times", type=int, default=50, help="kill: how many processes are killed  [50]")
    parser.add_argument("--seed", type=int, default=1, help="kill: which ones, and when")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="canopy-", dir="/tmp") as folder:
        if arguments.what == "long":
            return long_run.run(arguments.build.resolve(), Path(folder), arguments.seconds)
        return killing.run(arguments.build.resolve(), Path(folder), arguments.times, arguments.seed)


if __name__ == "__main__":
    sys.exit(main())
