# SPDX-License-Identifier: MIT
"""The programs of a run: a controller with everything that may stand beside it, and what the kernel says of them."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DBC = ROOT / "examples" / "nao" / "nao.dbc"


def nao(build: Path) -> Path:
    """The folder in which the NAO's programs are."""
    return build / "examples" / "nao"


def model(build: Path) -> str:
    """The model file of nao_home."""
    return str(nao(build) / "generated" / "nao_home" / "nao_home.model.json")


def commands(build: Path, bus: str, folder: Path, lcm_url: str) -> dict[str, list[str]]:
    """How each program is started, by a short name."""
    tool = [sys.executable, "-m", "canopy"]
    watch = ["--model", model(build), "--can", bus]
    return {
        "sim": [sys.executable, "-m", "canopy_sim", "--can", bus, "--dbc", str(DBC), "--no-lcm", "--json"],
        "controller": [str(nao(build) / "nao_home"), "--can", bus],
        "monitor": [*tool, "monitor", *watch, "--json", "--period", "10"],
        "record": [*tool, "record", *watch, "-o", str(folder / "run.blf"), "--force", "--json"],
        "bridge": [*tool, "bridge", *watch, "--lcm-url", lcm_url, "--json"],
    }


def start(command: list[str], folder: Path, name: str) -> subprocess.Popen[bytes]:
    """Starts a program; what it writes goes to NAME.out and NAME.err in the folder."""
    with (folder / f"{name}.out").open("ab") as out, (folder / f"{name}.err").open("ab") as err:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=err)


def resident_kb(process: subprocess.Popen[bytes]) -> int:
    """Memory of a program that is in RAM [KiB]."""
    status = Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
    return int(status.partition("VmRSS:")[2].split()[0])


def end(process: subprocess.Popen[bytes]) -> int:
    """Ends a program as Ctrl-C does, and by force after 30 s; gives its exit status."""
    process.send_signal(signal.SIGINT)
    try:
        return process.wait(30)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()
