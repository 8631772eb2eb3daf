# SPDX-License-Identifier: MIT
"""`canopy image`: tree images for firmware that is there already."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from canopy.compiler.dbc_file import read_dbc
from canopy.compiler.emit import Application, load_application, model
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.image import SOURCES, Image, ImageError, make_image, read_image
from canopy.compiler.image_model import image_trace, read_firmware
from canopy.compiler.node_types import node_types
from canopy.compiler.output import dependencies, fail, write_or_exit
from canopy.compiler.port_types import Options
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo, echo_lines
from canopy.files import FileError

BITRATE = 500_000  # of no account for an image


def _compile(tree: Path, firmware: Path, data: dict[str, Any]) -> tuple[Application, bytes]:
    bus, types = data["bus"], data["image"]["types"]
    options = Options(types["floating_point"], types["map"], types.get("include"), unset_ports=types["unset_ports"])
    name, period_ms = data["application"], data["period_us"] // 1000
    dbc = firmware.parent / bus["dbc"]
    application = load_application(name, tree, dbc, bus["node"], period_ms, BITRATE, options.include, options)
    return application, make_image(application.table, data["image"], name)


@click.group()
def command() -> None:
    """Tree images: another tree for a firmware that is there already, loaded while it runs.

    \b
    Examples:
      canopy image build other.xml --for build/generated/robot/robot.model.json -o other.img
      canopy image show other.img
    """


@command.command()
@click.argument("tree", type=click.Path(path_type=Path))
@click.option(
    "--for", "firmware", required=True, type=click.Path(path_type=Path), help="The firmware's NAME.model.json."
)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="The image.")
@click.option(
    "--model", "with_model", is_flag=True, help="Write OUTPUT.model.json and the DBC, too, for the host tools."
)
@click.option("--depfile", type=click.Path(path_type=Path), help="Write the files that were read, as make's rule.")
def build(tree: Path, firmware: Path, output: Path, with_model: bool, depfile: Path | None) -> None:
    """Compile TREE to an image for a firmware.

    What the firmware would refuse is refused here, by name: leaves, scripts, entries or room that it does not have.
    Exit status: 0 done, 2 the tree cannot be compiled for this firmware; then nothing is written.
    """
    try:
        data = read_firmware(firmware)
        application, image = _compile(tree, firmware, data)
        dbc = application.bus.path
        files: dict[str, bytes] = {}
        if with_model:
            files[dbc.name] = read_dbc(dbc)
            content = model(application) | {"trace": image_trace(data, application.table)}
            files[f"{output.stem}.model.json"] = (dumps(content, indent=1) + "\n").encode()
        read = [*application.table.tree.files, firmware, dbc]
        first = dependencies(depfile, output, read) if depfile is not None else {}
    except CompileError as error:
        fail(error)
    write_or_exit(output.parent, {**files, output.name: image}, first)
    echo(f"{output}: {len(image)} bytes, {len(application.table.rows)} nodes, hash {application.table.hash}")


def _as_dict(image: Image) -> dict[str, Any]:
    """Hashes as 16 hex digits."""
    types = [node_type.name for node_type in node_types().values()]

    def hashes(values: tuple[int, ...]) -> list[str]:
        return [f"{value:016x}" for value in values]

    return {
        "size": image.size,
        "crc": f"{image.crc:08x}",
        "crc_is_right": image.crc_is_right,
        "hash": f"{image.hash:016x}",
        "engine": f"{image.engine:016x}",
        "words": image.words,
        "nodes": [
            {
                "type": types[node[0]] if node[0] < len(types) else node[0],
                **dict(zip(("asks", "parent", "end", "state", "leaf", "parameter"), node[1:], strict=True)),
            }
            for node in image.nodes
        ],
        "parameters": list(image.parameters),
        "kinds": hashes(image.kinds),
        "scripts": hashes(image.scripts),
        "entries": hashes(image.entries),
        "uses": hashes(image.uses),
        "values": [[SOURCES[s] if s < len(SOURCES) else s, value] for s, value in image.values],
        "texts": image.texts.decode(errors="replace").split("\0")[:-1],
    }


@command.command()
@click.argument("image_file", metavar="IMAGE", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print everything, as JSON.")
def show(image_file: Path, as_json: bool) -> None:
    """Print what an image says of itself. Exit status: 0, 1 its CRC is wrong, 2 it is no image."""
    try:
        image = read_image(image_file)
    except (ImageError, FileError) as error:
        problem = error.problem if isinstance(error, FileError) else str(error)
        fail(CompileError(Place(str(image_file)), problem))
    else:
        if as_json:
            echo_lines(dumps(_as_dict(image), indent=1))
        else:
            echo(f"{image_file}: {image.size} bytes, hash {image.hash:016x}, engine {image.engine:016x}")
            echo(f"  CRC      {image.crc:08x} {'right' if image.crc_is_right else 'WRONG'}")
            for what in ("nodes", "parameters", "kinds", "scripts", "entries", "uses", "values"):
                echo(f"  {what:10s}{len(getattr(image, what)):6d}")
            echo(f"  words     {image.words:6d}")
            echo(f"  texts     {len(image.texts):6d} bytes")
        sys.exit(0 if image.crc_is_right else 1)
