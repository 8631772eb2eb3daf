# SPDX-License-Identifier: MIT
"""`canopy buses`: the CAN buses of this machine, as every tool takes their names."""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import click

from canopy.can_bus.folder import PARTICIPANTS_MAX, bus_names, buses_folder, participants
from canopy.can_bus.link import interfaces
from canopy.escape.json_text import dumps
from canopy.escape.terminal import CleanCommand, echo


@dataclass(frozen=True)
class FoundBus:
    """One bus."""

    name: str
    """For --can."""
    state: str
    """Of an interface "up" or "down"; of a unixbus "up", or why nothing can be said of it."""
    participants: int | None = None
    """Of a unixbus: how many programs take part, dead ones left out. None where it is not known."""
    processes: tuple[int, ...] = ()
    """Of a unixbus: their process ids, one for each participant."""


def find_buses() -> list[FoundBus]:
    """The named unixbuses and the kernel's CAN interfaces."""
    found = []
    for name in bus_names():
        try:
            sockets = participants(buses_folder() / name)
        except OSError as error:
            found.append(FoundBus(f"unixbus:{name}", error.strerror or str(error)))
        else:
            processes = tuple(int(socket.partition("-")[0]) for socket in sockets)
            found.append(FoundBus(f"unixbus:{name}", "up", len(sockets), processes))
    found += [FoundBus(f"socketcan:{name}", "up" if is_up else "down") for name, is_up in interfaces()]
    return found


@click.command(
    cls=CleanCommand,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy buses
  canopy buses --json
""",
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line.")
def command(as_json: bool) -> None:
    """List the CAN buses of this machine, with the names that --can takes.

    Of a unixbus it shows how many programs take part, and which: sockets whose program has died are removed on the way.
    A unixbus that was given as a path (unixbus:/a/folder) has no name, and is not listed.

    Exit status: 0 there are buses, 1 there are none, 2 wrong command line.
    """
    buses = find_buses()
    for bus in buses:
        if as_json:
            echo(dumps(asdict(bus)))
        elif bus.participants is None:
            echo(f"{bus.name}  {bus.state}")
        else:
            who = f", processes {' '.join(map(str, sorted(bus.processes)))}" if bus.processes else ""
            echo(f"{bus.name}  {bus.participants} of at most {PARTICIPANTS_MAX} participants{who}")
    if not buses:
        where: Path = buses_folder()
        echo(f"canopy buses: {where} holds no unixbus, and the kernel has no CAN interface", err=True)
        sys.exit(1)
