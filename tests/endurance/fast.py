# SPDX-License-Identifier: MIT
"""nao_home with another period, built with what the build folder already has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from endurance.processes import DBC, ROOT


def build_nao_home(build: Path, folder: Path, period_ms: int) -> tuple[Path, Path]:
    """Compiles it into a folder; gives the program and its model file."""
    source = ROOT / "examples" / "nao"
    tree = [str(source / "trees" / "get_home.xml"), "--dbc", str(DBC), "--node", "Controller"]
    options = ["--period-ms", str(period_ms), "--name", "nao_home", "-o", str(folder)]
    subprocess.run([sys.executable, "-m", "canopy", "compile", *tree, *options], check=True, stdout=subprocess.DEVNULL)
    program = folder / "nao_home"
    libraries = [str(path) for path in sorted(build.glob("drivers/*.a"))]
    includes = [f"-I{path}" for path in (folder, ROOT / "runtime" / "include", ROOT / "drivers" / "include")]
    sources = [source / "main.c", source / "home_leaves.c", *sorted(folder.glob("*.c"))]
    group = ["-Wl,--start-group", *libraries, str(build / "runtime" / "libcanopy_runtime.a"), "-Wl,--end-group"]
    options = ["-O2", "-std=c11", "-D_GNU_SOURCE", "-DCANOPY_APP=nao_home_app", "-o", str(program)]
    subprocess.run(["cc", *options, *includes, *map(str, sources), *group, "-lpthread"], check=True)
    return program, folder / "nao_home.model.json"
