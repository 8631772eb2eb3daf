# SPDX-License-Identifier: MIT
"""The command `canopy`. Subcommands are imported when they are called, so that each needs only its own libraries."""

from __future__ import annotations

import importlib
import sys

import click

from canopy import __version__
from canopy.escape.terminal import CleanCommand, echo

# Name -> module that holds the click command `command`, and the line shown in --help.
SUBCOMMANDS = {
    "compile": ("canopy.compiler.cli", "Compile a tree and a DBC to C."),
    "model": ("canopy.tree.model_cli", "Write the declarations that tree files lack, guessed from use."),
    "image": ("canopy.compiler.image_cli", "Compile a tree for a firmware that is there, as bytes to load."),
    "codec": ("canopy.compiler.codec_cli", "Make the C codec of a DBC, without a tree."),
    "dbc": ("canopy.bus.cli", "Write the overlay of a DBC, and see what can be made of it."),
    "check": ("canopy.check.cli", "Find mistakes in a tree before the robot does."),
    "verify": ("canopy.verify.cli", "Prove what a tree guarantees, given a model of its leaves."),
    "plot": ("canopy.plot.cli", "Draw what a tree does to a plant, given a model of its leaves."),
    "show": ("canopy.show.cli", "Draw a tree, in the terminal, as SVG or as DOT."),
    "fmt": ("canopy.fmt.cli", "Write tree files in one canonical form."),
    "convert": ("canopy.convert.cli", "Convert other architectures into trees, and trees into state machines."),
    "buses": ("canopy.can_bus.buses", "List the CAN buses of this machine."),
    "demo": ("canopy.demo", "Run the NAO example in the terminal."),
    "sim": ("canopy.live.robot_command", "Tell the simulated robot something."),
    "monitor": ("canopy.monitor", "Watch a controller's tree and signals live."),
    "record": ("canopy.record", "Record a bus to a log that can be replayed."),
    "replay": ("canopy.replay.cli", "Run the program again on a log, and compare it bit for bit."),
    "bridge": ("canopy.bridge", "Publish a controller's trace on LCM."),
    "spy": ("canopy.spy", "Start lcm-spy with Canopy's message types."),
}

# Python package -> the extra that brings it, where the two have different names.
EXTRAS = {"matplotlib": "plot"}


class _LazyGroup(CleanCommand, click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(SUBCOMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in SUBCOMMANDS:
            return None
        module = SUBCOMMANDS[cmd_name][0]
        try:
            command = importlib.import_module(module).command
        except ModuleNotFoundError as error:
            if error.name is None or error.name.startswith("canopy"):
                raise
            extra = EXTRAS.get(error.name, error.name)
            echo(
                f"canopy {cmd_name} needs the Python package '{error.name}': pip install 'canopy-bt[{extra}]'", err=True
            )
            sys.exit(1)
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in SUBCOMMANDS.items()])


@click.group(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="canopy")
def main() -> None:
    """Behaviour trees as robot firmware: compile them, and watch them run.

    \b
    Examples:
      canopy compile trees/get_home.xml --dbc nao.dbc --node Controller --period-ms 50 -o generated
      canopy check trees/get_home.xml --dbc nao.dbc --node Controller
      canopy monitor --model generated/get_home.model.json --can socketcan:vcan0
    """
