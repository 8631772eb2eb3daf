# SPDX-License-Identifier: MIT
"""From generated C to the machine: cases compiled with all warnings and the sanitizers, linked together, and run."""

from __future__ import annotations

import os
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from fuzz.generated.case import Case
from fuzz.generated.hostile import MARKER
from integration.codec_harness import ROOT, WARNINGS

HERE = Path(__file__).parent
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
TIMEOUT_S = 60


class Machine:
    """One C compiler, with the runtime and the harness built by it. `warnings=False` lets bad C through to the run."""

    def __init__(self, compiler: str, folder: Path, *, warnings: bool = True) -> None:
        self.compiler = compiler
        self._warnings = WARNINGS if warnings else ["-std=c11", "-w"]
        self._folder = folder / compiler
        self._folder.mkdir(parents=True, exist_ok=True)
        sources = [*sorted((ROOT / "runtime" / "src").glob("*.c")), HERE / "harness.c"]
        built = self._compile(sources, self._folder, "-O1")
        if built.returncode:
            raise RuntimeError(f"{compiler} cannot build the runtime:\n{built.stderr}")
        self._objects = [str(self._folder / f"{source.stem}.o") for source in sources]

    def _compile(self, sources: list[Path], folder: Path, optimize: str) -> subprocess.CompletedProcess[str]:
        folders = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{HERE}"]
        command = [self.compiler, *self._warnings, optimize, *SANITIZERS, *folders, "-c", *map(str, sources)]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", check=False)

    def judge(self, cases: list[Case], jobs: int) -> None:
        """Compiles, links and runs the cases; what is wrong with one is its `fault`."""
        with ThreadPoolExecutor(jobs) as pool:
            results = list(pool.map(lambda case: self._compile(case.sources, case.sources[0].parent, "-O0"), cases))
        for case, result in zip(cases, results, strict=True):
            if result.returncode:
                case.fault = f"the C does not compile ({self.compiler}):\n{result.stderr[:3000]}"
        left = [case for case in cases if not case.fault]
        while left:  # one that aborts hides those behind it
            guilty = self._run(left)
            if guilty is None:
                return
            left = [case for case in left if case is not guilty and not case.fault]

    def _run(self, cases: list[Case]) -> Case | None:
        """Runs the cases as one program. Gives the one that has a fault; None: none has."""
        program = self._folder / "program"
        main = self._folder / "main.c"
        calls = "".join(
            f'    fprintf(stderr, "case {case.number}\\n");\n    fuzz_run(&{case.name}_app, {case.number + 1}u);\n'
            for case in cases
        )
        declared = "".join(f"extern const canopy_app_t {case.name}_app;\n" for case in cases)
        main.write_text(
            f'#include <stdio.h>\n#include "harness.h"\n{declared}int main(void)\n{{\n{calls}    return 0;\n}}\n'
        )
        self._compile([main], self._folder, "-O0")
        objects = [str(source.with_suffix(".o")) for case in cases for source in case.sources]
        command = [
            self.compiler,
            *SANITIZERS,
            str(main.with_suffix(".o")),
            *objects,
            *self._objects,
            "-o",
            str(program),
        ]
        linked = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        if linked.returncode:
            return self._not_linked(cases, linked.stderr)
        environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0", "UBSAN_OPTIONS": "print_stacktrace=1"}
        try:
            result = subprocess.run(
                [str(program)], env=environment, capture_output=True, text=True, errors="replace", timeout=TIMEOUT_S,
                check=False,
            )  # fmt: skip
            output, code = result.stdout + result.stderr, result.returncode
        except subprocess.TimeoutExpired as error:
            output, code = f"still running after {TIMEOUT_S} s\n{error.stderr!r}", -1
        if code == 0:
            return None
        if MARKER in output and len(cases) > 1:  # before main(): each alone tells which
            return next(filter(None, (self._run([case]) for case in cases)), None) or cases[0]
        numbers = re.findall(r"case (\d+)", output)
        guilty = next((case for case in cases if numbers and case.number == int(numbers[-1])), cases[0])
        guilty.fault = f"the program ends with {code} ({self.compiler}):\n{output[-3000:]}"
        return guilty

    def _not_linked(self, cases: list[Case], errors: str) -> Case:
        named = re.findall(r"case_(\d+)", errors)
        guilty = next((case for case in cases if named and case.number == int(named[0])), cases[0])
        guilty.fault = f"the program does not link ({self.compiler}):\n{errors[:3000]}"
        return guilty
