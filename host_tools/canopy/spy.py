# SPDX-License-Identifier: MIT
"""`canopy spy`: lcm-spy, with the jar it needs to decode Canopy's messages."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import click

from canopy.escape.terminal import echo
from canopy.lcm_link import DEFAULT_URL


class SpyError(Exception):
    """lcm-spy cannot be started; the text says what is missing and how to get it."""


def find_jar() -> Path | None:
    """The jar of the LCM types that the build made beside the Python ones, if it is there."""
    spec = find_spec("canopy_msgs")
    if spec is None or spec.origin is None:
        return None
    jar = Path(spec.origin).parents[2] / "canopy_msgs.jar"
    return jar if jar.is_file() else None


def find_lcm_spy() -> Path | None:
    """The program of LCM's Python package, or one on PATH."""
    spec = find_spec("lcm")
    if spec is not None and spec.origin is not None:
        program = Path(spec.origin).parents[1] / "bin" / "lcm-spy"
        if program.is_file():
            return program
    program_on_path = shutil.which("lcm-spy")
    return Path(program_on_path) if program_on_path else None


def command_line(jar: Path | None, lcm_url: str) -> tuple[list[str], dict[str, str]]:
    """The command and the environment that start lcm-spy.

    Raises:
        SpyError: Something it needs is missing.
    """
    program = find_lcm_spy()
    if program is None:
        raise SpyError("lcm-spy is not installed; mend with: pip install lcm")
    java = shutil.which("java")
    if java is None:
        raise SpyError("lcm-spy needs Java; mend with: apt-get install default-jre")
    jar = jar or find_jar()
    if jar is None:
        raise SpyError(
            "canopy_msgs.jar is not built; mend with: apt-get install default-jdk-headless && "
            "cmake --build build/host --target lcm_types, or give --jar"
        )
    if not os.environ.get("DISPLAY"):
        raise SpyError("lcm-spy needs a display, and DISPLAY is not set; from afar: ssh -X, or run it under xvfb-run")
    if not _has_windows(java):
        raise SpyError("this Java has no windows (headless); mend with: apt-get install default-jre")
    environment = dict(os.environ, LCM_DEFAULT_URL=lcm_url)
    before = environment.get("CLASSPATH")
    environment["CLASSPATH"] = f"{jar.resolve()}{os.pathsep}{before}" if before else str(jar.resolve())
    return [str(program)], environment


def _has_windows(java: str) -> bool:
    """Looks for AWT's native part, which Debian's headless packages leave out."""
    settings = subprocess.run([java, "-XshowSettings:properties", "-version"], capture_output=True, text=True)
    for line in settings.stderr.splitlines():
        name, _, value = line.partition("=")
        if name.strip() == "java.home":
            library = Path(value.strip(), "lib")
            return any(library.rglob("libawt_xawt.so")) or not any(library.rglob("libawt.so"))
    return True


@click.command(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy spy
  canopy spy --jar build/host/lcm/canopy_msgs.jar
""",
)
@click.option(
    "--jar", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="canopy_msgs.jar of the build"
)
@click.option("--lcm-url", default=DEFAULT_URL, show_default=True, help="Where the messages come from.")
def command(jar: Path | None, lcm_url: str) -> None:
    """Start lcm-spy with Canopy's message types.

    Exit status: lcm-spy's own, or 1 when something it needs is missing.
    """
    try:
        arguments, environment = command_line(jar, lcm_url)
    except SpyError as error:
        echo(f"canopy spy: {error}", err=True)
        sys.exit(1)
    # In place of this process, so that signals and the exit status are lcm-spy's own.
    os.execve(arguments[0], arguments, environment)
