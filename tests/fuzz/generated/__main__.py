# SPDX-License-Identifier: MIT
"""Hostile trees, DBCs and scripts through the compiler, the C compilers and the machine.

    PYTHONPATH=tests python -m fuzz.generated --seconds 60
    PYTHONPATH=tests python -m fuzz.generated --seed 7 --case 123    # one case again; its files are kept

A case is refused with its place, or its C compiles without a warning and runs 200 ticks under ASan and UBSan. Anything
else is a fault: a traceback, an error without a place, C that does not compile, a report of a sanitizer, or a text of
the files that has become code. Exit status: 0 none, 1 faults; the seed and the number of each are printed.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from itertools import count, islice
from pathlib import Path

from fuzz.generated.case import Case, make_case
from fuzz.generated.machine import Machine
from fuzz.generated.unmend import UNMEND

BATCH = 12


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="fuzz.generated", description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=60, help="how long [60]")
    parser.add_argument("--cases", type=int, help="how many, instead of how long")
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**32, help="[from the clock]")
    parser.add_argument("--case", type=int, help="only this one of the seed's cases")
    parser.add_argument("--compilers", nargs="+", default=["gcc", "clang-19"], help="taken in turn [gcc clang-19]")
    parser.add_argument("--jobs", type=int, default=1, help="C files compiled at a time [1]")
    parser.add_argument("--keep", type=Path, help="where the files of faults go [a new folder in the temporary one]")
    parser.add_argument("--first-fault", action="store_true", help="end after the first fault")
    parser.add_argument("--without-warnings", action="store_true", help="C that warns is run all the same")
    parser.add_argument("--unmend", choices=UNMEND, help="take a mending out, to see that its fault is found")
    return parser.parse_args()


def _report(case: Case, keep: Path) -> None:
    kept = keep / f"seed_{case.seed}_case_{case.number}"
    shutil.rmtree(kept, ignore_errors=True)
    shutil.copytree(case.folder, kept)
    print(f"FAULT in case {case.number} of seed {case.seed}; its files: {kept}\n{case.fault}", flush=True)
    print(f"again: PYTHONPATH=tests python -m fuzz.generated --seed {case.seed} --case {case.number}\n", flush=True)


def main() -> int:
    """Run the cases."""
    given = _arguments()
    end = time.monotonic() + given.seconds
    if given.unmend is not None:
        UNMEND[given.unmend]()
    keep = given.keep or Path(tempfile.mkdtemp(prefix="canopy-fuzz-found-"))
    one = given.case is not None
    numbers = iter([given.case]) if one else count() if given.cases is None else iter(range(given.cases))
    made = refused = faults = 0
    print(f"fuzz.generated: seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="canopy-fuzz-") as folder:
        work = Path(folder)
        machines = [Machine(name, work, warnings=not given.without_warnings) for name in given.compilers]
        for turn in count():
            batch = []
            for number in islice(numbers, 4 * BATCH):
                made += 1
                case = make_case(given.seed, number, work)
                batch.append(case)
                if sum(bool(c.sources) for c in batch) == BATCH:
                    break
            for machine in machines if one else [machines[turn % len(machines)]]:
                machine.judge([case for case in batch if case.sources and not case.fault], given.jobs)
            refused += sum(bool(case.refusal) for case in batch)
            found = [case for case in batch if case.fault]
            faults += len(found)
            for case in found:
                _report(case, keep)
            for case in batch:
                shutil.rmtree(case.folder)
            if not batch or one or (found and given.first_fault) or (given.cases is None and time.monotonic() > end):
                break
    print(f"{made} cases, {refused} refused, {made - refused} compiled and run, {faults} faults; seed {given.seed}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
