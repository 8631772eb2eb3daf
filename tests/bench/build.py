# SPDX-License-Identifier: MIT
"""Compiles the benchmark's program and the engine, for this machine and for Cortex-M cores."""

import subprocess
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
ENGINE = REPOSITORY / "runtime" / "src" / "tree.c"
VALIDATOR = REPOSITORY / "runtime" / "src" / "tree_validate.c"
HERE = Path(__file__).resolve().parent
# What stands in for a C library on bare metal, here as in the firmware's tests.
LIBC = REPOSITORY / "tests" / "firmware" / "support" / "libc"
COMMON = ["-std=c11", "-D_GNU_SOURCE", f"-I{REPOSITORY / 'runtime' / 'include'}", f"-I{HERE}"]


@dataclass(frozen=True)
class Target:
    """A compiler with its flags."""

    name: str
    command: tuple[str, ...]
    size: str
    nm: str


def _cortex(core: str, level: str) -> Target:
    command = ("arm-none-eabi-gcc", f"-mcpu={core}", "-mthumb", level, "-ffreestanding", "-isystem", str(LIBC))
    return Target(f"{core} {level}", command, "arm-none-eabi-size", "arm-none-eabi-nm")


HOSTS = (Target("gcc", ("gcc", "-O2"), "size", "nm"), Target("clang", ("clang", "-O2"), "size", "nm"))
CORTEX_M4 = (_cortex("cortex-m4", "-O2"), _cortex("cortex-m4", "-Os"))
CORTEX_M0 = (_cortex("cortex-m0plus", "-Os"),)


def run(*command: str | Path) -> str:
    """What a command prints. Raises RuntimeError, with what it said, when it fails or is not there."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise RuntimeError(f"{command[0]} is missing; `make bench` installs what it needs") from error
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit status {done.returncode}\n{done.stderr}")
    return done.stdout


def engine_object(target: Target, folder: Path) -> Path:
    """The engine (runtime/src/tree.c) alone, compiled."""
    path = folder / f"tree_{target.name.replace(' ', '_')}.o"
    run(*target.command, *COMMON, "-ffreestanding", "-c", ENGINE, "-o", path)
    return path


def host_program(target: Target, folder: Path) -> Path:
    """The benchmark's program for this machine."""
    path = folder / f"canopy_bench_{target.name}"
    sources = (HERE / "bench.c", HERE / "workloads.c", VALIDATOR)
    run(*target.command, *COMMON, *sources, engine_object(target, folder), "-o", path)
    return path


def link_bare(target: Target, path: Path, *sources: str | Path) -> Path:
    """A program for a Cortex-M core without start-up code, whose functions are called by name.

    Code at 0, data at 0x20000000. `sources` may hold options too.
    """
    # -fno-…: memset() must not become a call of itself.
    library = (LIBC / "string.c", "-fno-tree-loop-distribute-patterns", "-lgcc")
    link = ("-nostdlib", "-Wl,-e,canopy_tree_tick", "-Wl,-Ttext=0", "-Wl,-Tdata=0x20000000")
    run(*target.command, *COMMON, *link, *sources, *library, "-o", path)
    return path


def bare_program(target: Target, folder: Path) -> Path:
    """The workloads and the engine for a Cortex-M core."""
    engine = engine_object(target, folder)
    sources = (HERE / "workloads.c", HERE / "stack.c", VALIDATOR, engine)
    return link_bare(target, folder / f"workloads_{target.name.replace(' ', '_')}.elf", *sources)


def text_bytes(target: Target, path: Path) -> int:
    """Code and constants of an object [bytes]."""
    return int(run(target.size, "-B", "-d", path).splitlines()[1].split()[0])


def undefined_symbols(target: Target, path: Path) -> list[str]:
    """The functions that an object calls outside itself."""
    return sorted(line.split()[-1] for line in run(target.nm, "--undefined-only", path).splitlines())
