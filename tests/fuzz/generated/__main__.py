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
from collections.abc import Iterator
from itertools import count, islice
from pathlib import Path

from fuzz.generated.case import Case
from fuzz.generated.isolated import make_isolated
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
    parser.add_argument("--until", metavar="TEXT", help="end after a fault with this text in its report; '' is any")
    parser.add_argument("--without-warnings", action="store_true", help="C that warns is run all the same")
    parser.add_argument("--unmend", choices=UNMEND, help="take a mending out, to see that its fault is found")
    return parser.parse_args()


def _report(case: Case, keep: Path) -> None:
    kept = keep / f"seed_{case.seed}_case_{case.number}"
    shutil.rmtree(kept, ignore_errors=True)
    shutil.copytree(case.folder, kept)
    print(f"FAULT in case {case.number} of seed {case.seed}; its files: {kept}\n{case.fault}", flush=True)
    print(f"again: PYTHONPATH=tests python -m fuzz.generated --seed {case.seed} --case {case.number}\n", flush=True)


class Fuzzer:
    """The run of one seed: batches of cases, each judged by the next of the compilers."""

    def __init__(self, given: argparse.Namespace, work: Path) -> None:
        self._given = given
        self._work = work
        self._keep = given.keep or Path(tempfile.mkdtemp(prefix="canopy-fuzz-found-"))
        self._machines = [Machine(name, work, warnings=not given.without_warnings) for name in given.compilers]
        self.made = self.refused = self.faults = 0

    def run(self, numbers: Iterator[int], end: float) -> None:
        """Until the numbers, or the time, are at their end, or what is looked for has been found."""
        for turn in count():
            batch = self._batch(numbers)
            one = self._given.case is not None
            for machine in self._machines if one else [self._machines[turn % len(self._machines)]]:
                machine.judge([case for case in batch if case.sources and not case.fault], self._given.jobs)
            found = self._account(batch)
            until = self._given.until
            if not batch or time.monotonic() > end or (until is not None and any(until in c.fault for c in found)):
                return

    def _batch(self, numbers: Iterator[int]) -> list[Case]:
        batch: list[Case] = []
        for number in islice(numbers, 4 * BATCH):
            batch.append(make_isolated(self._given.seed, number, self._work))
            if sum(bool(case.sources) for case in batch) == BATCH:
                break
        return batch

    def _account(self, batch: list[Case]) -> list[Case]:
        found = [case for case in batch if case.fault]
        self.made += len(batch)
        self.refused += sum(bool(case.refusal) for case in batch)
        self.faults += len(found)
        for case in found:
            _report(case, self._keep)
        for case in batch:
            shutil.rmtree(case.folder)
        return found


def main() -> int:
    """Run the cases."""
    given = _arguments()
    end = time.monotonic() + given.seconds if given.cases is None and given.case is None else float("inf")
    if given.unmend is not None:
        UNMEND[given.unmend]()
    numbers = count() if given.cases is None else iter(range(given.cases))
    print(f"fuzz.generated: seed {given.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="canopy-fuzz-") as folder:
        fuzzer = Fuzzer(given, Path(folder))
        fuzzer.run(numbers if given.case is None else iter([given.case]), end)
    run = fuzzer.made - fuzzer.refused
    print(f"{fuzzer.made} cases, {fuzzer.refused} refused, {run} compiled and run, {fuzzer.faults} faults", flush=True)
    return 1 if fuzzer.faults else 0


if __name__ == "__main__":
    sys.exit(main())
