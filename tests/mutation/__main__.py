# SPDX-License-Identifier: MIT
"""The run: all mutants of the runtime, or a sample."""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

from mutation.build import Bench, BuildError, Worker
from mutation.known import Known, KnownError, read_known
from mutation.sites import Mutant, find_mutants

ROOT = Path(__file__).resolve().parents[2]
_TREES = ("tree", "nodes/", "state.h")
_BUS = ("bus", "can_state", "loop", "trace", "tx")
SLOW: dict[str, tuple[str, ...]] = {
    "test_conformance": _TREES,
    "test_tx_interleavings": ("tx",),
    "test_tx_threads": ("tx",),
    "test_ring_threads": ("ring",),
    "test_unixbus_readers": (),
    **dict.fromkeys(("test_double_blocked", "test_double_controller", "test_double_fan", "test_double_states"), _BUS),
    **dict.fromkeys(("test_double_load_six", "test_double_load_nao_home", "test_double_load_nao_power"), ()),
    **dict.fromkeys(("test_power_supply", "test_plant", "test_unixbus", "test_posix_clock"), ()),
}
"""Tests that take long, and the files that they look at; () where it is an application, a plant or a driver."""


def choose(arguments: argparse.Namespace, known: Known) -> list[Mutant]:
    """The mutants to try: of the files asked for; in a sample only of files of which everything is known."""
    mutants = find_mutants(ROOT / "runtime" / "src")
    if arguments.files:
        mutants = [mutant for mutant in mutants if mutant.file in arguments.files]
    if arguments.sample:
        mutants = [mutant for mutant in mutants if mutant.file in known.judged]
        chance = random.Random(arguments.seed)
        mutants = chance.sample(mutants, min(arguments.sample, len(mutants)))
    return mutants


def run(bench: Bench, mutants: list[Mutant], jobs: int, log: Path) -> dict[Mutant, str]:
    """Tries the mutants; writes each result to the log at once."""
    workers: Queue[Worker] = Queue()
    for number in range(jobs):
        workers.put(Worker(bench, f"worker{number}"))
    began = time.monotonic()
    results: dict[Mutant, str] = {}

    def judge(mutant: Mutant) -> tuple[Mutant, str]:
        worker = workers.get()
        try:
            return mutant, worker.judge(mutant)
        finally:
            workers.put(worker)

    with log.open("w", encoding="utf-8") as file, ThreadPoolExecutor(jobs) as pool:
        for mutant, result in pool.map(judge, mutants):
            results[mutant] = result
            file.write(json.dumps([mutant.file, mutant.line, mutant.before, mutant.after, result]) + "\n")
            file.flush()
            if len(results) % 100 == 0:
                print(f"{len(results)} of {len(mutants)} in {time.monotonic() - began:.0f} s", file=sys.stderr)
    return results


def report(results: dict[Mutant, str], known: Known) -> int:
    """Prints the score, and what is not known; returns the exit status."""
    counts = Counter(result if result in ("stillborn", "equal", "alive") else "killed" for result in results.values())
    living = [mutant for mutant, result in results.items() if result == "alive"]
    explained = [mutant for mutant in living if mutant.name in known.equivalent]
    listed = [mutant for mutant in living if mutant.name in known.alive]
    new = [mutant for mutant in living if mutant.name not in known.equivalent and mutant.name not in known.alive]
    tried = counts["killed"] + counts["alive"]
    different = tried - len(explained)
    score = 100 * counts["killed"] / different if different else 100.0
    print(
        f"{len(results)} mutants: {counts['stillborn']} do not compile, {counts['equal']} give the same machine code; "
        f"of {tried} others {counts['killed']} killed, {len(explained)} listed as equivalent, "
        f"{len(listed) + len(new)} alive: {score:.1f} % killed"
    )
    for mutant in new:
        print(f"{mutant.file}:{mutant.line}")
        print(f"alive {'  |  '.join(mutant.name)}")
    wrong = [mutant for mutant, result in results.items() if result != "alive" and mutant.name in known.equivalent]
    for mutant in wrong:
        if results[mutant] not in ("stillborn", "equal"):
            print(f"is listed as equivalent, but {results[mutant]} notices it: {mutant.name}")
    if new:
        print("give each a test that notices it, or a line in tests/mutation/known.txt: equivalent …  |  REASON")
    return 1 if new else 0


def main() -> int:
    """Reads the command line."""
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__)
    parser.add_argument("build", type=Path, help="build folder with the address sanitizer, e.g. build/asan")
    parser.add_argument("--sample", type=int, default=0, help="so many, chosen by --seed, of files that are judged")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--files", nargs="*", help="only these, e.g. tree.c nodes/repeat.h")
    parser.add_argument("--log", type=Path, help="one JSON array a mutant: file, line, before, after, result")
    arguments = parser.parse_args()
    bench = Bench(ROOT, arguments.build.resolve(), (arguments.build / "mutation").resolve(), SLOW)
    try:
        known = read_known()
        mutants = choose(arguments, known)
        bench.prepare()
        log = arguments.log or bench.work / "results.jsonl"
        return report(run(bench, mutants, arguments.jobs, log), known)
    except (BuildError, KnownError) as error:
        print(f"mutation: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
