# SPDX-License-Identifier: MIT
"""Compiles a changed runtime and runs the unit tests on it, under the address and undefined-behaviour sanitizers.

The tests are linked once, with the runtime as a shared library; a mutant then costs one compiler run and one link.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mutation.sites import Mutant

ARCHIVE = "libcanopy_runtime.a"
SHARED = "libcanopy_mutant.so"
SANITIZERS = {"ASAN_OPTIONS": "detect_leaks=0", "UBSAN_OPTIONS": "halt_on_error=1"}


class BuildError(Exception):
    """The tests cannot be built, or one fails without any change."""


@dataclass
class Test:
    """A unit test."""

    name: str
    program: Path
    seconds: float = 0.0
    """How long it takes on the unchanged runtime."""


@dataclass
class Bench:
    """What all workers share. `build` is a CMake build folder with the sanitizers, `work` a folder for what is made."""

    root: Path
    build: Path
    work: Path
    only_for: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Slow tests: the files whose mutants they are run for, by the beginnings of their names. None: never."""
    tests: list[Test] = field(default_factory=list)
    kills: Counter[tuple[str, str]] = field(default_factory=Counter)
    """How many mutants of a file a test has noticed."""

    @property
    def sources(self) -> Path:
        return self.root / "runtime" / "src"

    def prepare(self) -> None:
        """Links the tests, and sees that they pass.

        Raises:
            BuildError: They do not.
        """
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir(parents=True)
        worker = Worker(self, "base")
        for link in sorted(self.build.glob("tests/*/CMakeFiles/test_*.dir/link.txt")):
            words = shlex.split(link.read_text())
            name = link.parent.name.removesuffix(".dir")
            if not any(word.endswith(ARCHIVE) for word in words) or self.only_for.get(name) == ():
                continue
            program = self.work / name
            words = [str(worker.shared) if word.endswith(ARCHIVE) else word for word in words]
            words[words.index("-o") + 1] = str(program)
            _run(words, link.parents[2])
            self.tests.append(Test(name, program))
        if not self.tests:
            raise BuildError(f"{self.build}: has no tests: cmake --preset asan && cmake --build --preset asan")
        for test in self.tests:
            began = time.monotonic()
            if not worker.passes(test, 60):
                raise BuildError(f"{test.name} fails on the runtime as it is")
            test.seconds = time.monotonic() - began

    def order(self, file: str) -> list[Test]:
        """The tests, those first that notice most of a file's mutants, and the quick ones before the slow ones."""
        tests = [test for test in self.tests if file.startswith(self.only_for.get(test.name, ("",)))]
        return sorted(tests, key=lambda test: (-self.kills[file, test.name], test.seconds))


def _run(words: list[str], folder: Path) -> None:
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BuildError(f"{shlex.join(words)}\n{done.stderr}")


class Worker:
    """One copy of the sources that is changed and put back."""

    def __init__(self, bench: Bench, name: str) -> None:
        self._bench = bench
        self._folder = bench.work / name
        self._folder.mkdir()
        self._sources = self._folder / "src"
        shutil.copytree(bench.sources, self._sources)
        self.shared = self._folder / SHARED
        text = (bench.build / "runtime/CMakeFiles/canopy_runtime.dir/flags.make").read_text()
        flags = shlex.split(" ".join(re.findall(r"^C_(?:DEFINES|INCLUDES|FLAGS) = (.*)$", text, re.M)))
        command = shlex.split(_compiler(text))
        kept = (flag for flag in flags if not flag.startswith("-W") and flag != "-g")
        self._compile = [*command, *kept, "-w", "-fPIC"]
        self._sanitize = [flag for flag in flags if flag.startswith(("-fsanitize", "-fno-sanitize"))]
        self._link = [*command, *self._sanitize, "-shared", f"-Wl,-soname,{SHARED}", "-o", str(self.shared)]
        self._units = sorted(str(path.relative_to(self._sources)) for path in self._sources.glob("*.c"))
        self._users = {unit: self._included(unit) for unit in self._units}
        for unit in self._units:
            _run(self._command(unit), self._sources)
        _run([*self._link, *self._objects()], self._sources)

    def judge(self, mutant: Mutant) -> str:
        """What became of a mutant.

        Returns:
            `stillborn`, `equal` (the same machine code), `alive`, or the name of the test that noticed it.
        """
        path = self._sources / mutant.file
        text = path.read_text(encoding="utf-8")
        units = [unit for unit in self._units if mutant.file in self._users[unit]]
        objects = {unit: (self._folder / f"{unit}.o").read_bytes() for unit in units}
        path.write_text(text[: mutant.start] + mutant.new + text[mutant.end :], encoding="utf-8")
        try:
            for unit in units:
                _run(self._command(unit), self._sources)
            _run([*self._link, *self._objects()], self._sources)
            for test in self._bench.order(mutant.file):
                if not self.passes(test, 20 * test.seconds + 10):
                    self._bench.kills[mutant.file, test.name] += 1
                    return test.name
            changed = {unit: self._machine_code(unit) for unit in units}
            path.write_text(text, encoding="utf-8")
            return "equal" if changed == {unit: self._machine_code(unit) for unit in units} else "alive"
        except BuildError:
            return "stillborn"
        finally:
            path.write_text(text, encoding="utf-8")
            for unit, content in objects.items():
                (self._folder / f"{unit}.o").write_bytes(content)

    def passes(self, test: Test, limit_s: float) -> bool:
        """Runs a test on this worker's library."""
        environment = {**os.environ, **SANITIZERS, "LD_LIBRARY_PATH": str(self._folder)}
        try:
            done = subprocess.run(
                [test.program],
                cwd=self._folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=limit_s,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0

    def _objects(self) -> list[str]:
        return [str(self._folder / f"{unit}.o") for unit in self._units]

    def _command(self, unit: str) -> list[str]:
        return [*self._compile, "-c", unit, "-o", str(self._folder / f"{unit}.o")]

    def _included(self, unit: str) -> set[str]:
        done = subprocess.run(
            [*self._compile, "-MM", unit], cwd=self._sources, capture_output=True, text=True, check=True
        )
        words = done.stdout.replace("\\\n", " ").partition(":")[2].split()
        return {os.path.normpath(word) for word in words}

    def _machine_code(self, unit: str) -> bytes:
        """What the compiler makes of it, optimised and without a sanitizer: two changes that give the same are one."""
        plain = [word for word in self._compile if word not in self._sanitize and not word.startswith(("-O", "-g"))]
        done = subprocess.run(
            [*plain, "-O2", "-S", "-o", "-", unit], cwd=self._sources, capture_output=True, check=True
        )
        return done.stdout


def _compiler(flags: str) -> str:
    match = re.search(r"^# compile C with (.*)$", flags, re.M)
    return match[1] if match else "cc"
