# SPDX-License-Identifier: MIT
"""`cmake --install`, and a project that knows nothing but the place where Canopy was installed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from integration.test_readme import blocks

ROOT = Path(__file__).parents[2]
TOOLCHAINS = {"host": [], "cortex-m4": [f"-DCMAKE_TOOLCHAIN_FILE={ROOT}/cmake/toolchains/cortex-m4.cmake"]}
PYTHON = f"-DCANOPY_PYTHON={sys.executable}"


def cmake(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs CMake; its exit status is for the caller to look at."""
    return subprocess.run(["cmake", *words], capture_output=True, text=True, check=False)


@pytest.fixture(scope="module", params=TOOLCHAINS)
def installed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The prefix, and the toolchain's name."""
    folder = tmp_path_factory.mktemp("install")
    options = ["-DCANOPY_BUILD_TESTS=OFF", "-DCANOPY_BUILD_EXAMPLES=OFF", "-DCMAKE_BUILD_TYPE=Release", PYTHON]
    steps: tuple[list[str | Path], ...] = (
        ["-S", ROOT, "-B", folder / "build", *options, *TOOLCHAINS[request.param]],
        ["--build", folder / "build", "--parallel", "2"],
        ["--install", folder / "build", "--prefix", folder / "prefix"],
    )
    for words in steps:
        done = cmake(*words)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "warning" not in (done.stdout + done.stderr).lower()
    return folder / "prefix", request.param


def configure(folder: Path, installed: tuple[Path, str]) -> subprocess.CompletedProcess[str]:
    """The README's project, with find_package() in place of the repository; on bare metal without its main.c."""
    prefix, toolchain = installed
    folder.mkdir()
    for name, content in blocks().items():
        (folder / name).write_text(content, encoding="utf-8")
    lists = (folder / "CMakeLists.txt").read_text(encoding="utf-8")
    kept = [line for line in lists.splitlines() if "canopy/cmake" not in line]
    kept[[line.startswith("add_subdirectory(canopy)") for line in kept].index(True)] = (
        "find_package(Canopy 0.1 REQUIRED)"
    )
    if toolchain != "host":
        kept = [line for line in kept if not line.startswith(("add_executable", "target_link_libraries"))]
    (folder / "CMakeLists.txt").write_text("\n".join(kept) + "\n", encoding="utf-8")
    return cmake(
        "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}", PYTHON, "-DCMAKE_C_FLAGS=-Wall -Werror",
        *TOOLCHAINS[toolchain],
    )  # fmt: skip


def test_an_application_builds_from_the_installed_package(installed: tuple[Path, str], tmp_path: Path) -> None:
    configured = configure(tmp_path / "room", installed)
    assert configured.returncode == 0, configured.stderr
    built = cmake("--build", tmp_path / "room" / "build")
    assert built.returncode == 0, built.stdout + built.stderr
    assert "room: 3 nodes, depth 2" in built.stdout
    if installed[1] == "host":
        ran = subprocess.run(
            [tmp_path / "room/build/room", "nothing:here"], capture_output=True, text=True, check=False
        )
        assert ran.returncode == 1
        assert "nothing:here" in ran.stderr


def test_every_header_compiles_by_itself(installed: tuple[Path, str], tmp_path: Path) -> None:
    prefix, toolchain = installed
    compiler: list[str | Path] = ["cc"]
    if toolchain != "host":
        compiler = ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-isystem", ROOT / "tests/firmware/support/libc"]
    include = prefix / "include"
    headers = sorted(header.relative_to(include) for header in include.rglob("*.h"))
    assert {Path("canopy/loop.h"), Path("canopy/can/loopback.h")} <= set(headers)
    for header in headers:
        source = tmp_path / "one.c"
        source.write_text(f'#include "{header}"\n', encoding="utf-8")
        command = [
            *compiler,
            "-std=c11",
            "-ffreestanding",
            "-Wall",
            "-Wextra",
            "-Werror",
            f"-I{include}",
            "-fsyntax-only",
        ]
        subprocess.run([*command, source], check=True)


def test_another_version_of_the_compiler_is_refused(installed: tuple[Path, str], tmp_path: Path) -> None:
    nodes = installed[0] / "include/canopy/nodes.def"
    text = nodes.read_text(encoding="utf-8")
    nodes.write_text(text + "\n", encoding="utf-8")
    try:
        configured = configure(tmp_path / "room", installed)
    finally:
        nodes.write_text(text, encoding="utf-8")
    assert configured.returncode != 0
    assert "knows other node types than the runtime" in " ".join(configured.stderr.split())


def test_a_python_without_the_package_is_named(installed: tuple[Path, str], tmp_path: Path) -> None:
    bare = tmp_path / "python"
    bare.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    bare.chmod(0o755)
    assert configure(tmp_path / "room", installed).returncode == 0
    again = cmake("-S", tmp_path / "room", "-B", tmp_path / "other", f"-DCMAKE_PREFIX_PATH={installed[0]}",
                  f"-DCANOPY_PYTHON={bare}", *TOOLCHAINS[installed[1]])  # fmt: skip
    assert again.returncode != 0
    assert f"{bare} has no package canopy-bt" in " ".join(again.stderr.split())
