# SPDX-License-Identifier: MIT
"""A case in a process of its own, with bounds on time and memory: one that hangs is a fault, not the fuzzer's end."""

from __future__ import annotations

import multiprocessing
import resource
from multiprocessing.connection import Connection
from pathlib import Path

from fuzz.generated.case import Case, make_case

CPU_S = 20
MEMORY = 4 * 1024**3
_FORK = multiprocessing.get_context("fork")  # what was imported, and unmended, stays so


def _work(seed: int, number: int, top: Path, answer: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    answer.send(make_case(seed, number, top))


def make_isolated(seed: int, number: int, top: Path) -> Case:
    """make_case(), bounded."""
    reader, writer = _FORK.Pipe(duplex=False)
    process = _FORK.Process(target=_work, args=(seed, number, top, writer))
    process.start()
    writer.close()
    try:
        case: Case = reader.recv()
    except EOFError:
        process.join()
        case = Case(seed, number, top / f"case_{number}")
        case.folder.mkdir(exist_ok=True)
        case.fault = f"the compiler has ended with {process.exitcode}: it has {CPU_S} s and {MEMORY >> 30} GiB"
    process.join()
    reader.close()
    return case
