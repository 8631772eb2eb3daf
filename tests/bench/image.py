# SPDX-License-Identifier: MIT
"""Counts what loading a tree image takes on an emulated Cortex-M4: tests/unit/exchange and its images."""

import json
import sys
from pathlib import Path
from typing import Any

from . import build, cortex_m

EXCHANGE = build.REPOSITORY / "tests" / "unit" / "exchange"
IMAGES = ("main", "other")
CANOPY = (sys.executable, "-m", "canopy")


def generate(folder: Path) -> Path:
    """The application in C, its images, and the images' bytes as C in images.c; returns the folder with all that."""
    out = folder / "exchange"
    tree = (EXCHANGE / "main.xml", "--dbc", EXCHANGE / "exchange.dbc", "--node", "Controller", "--period-ms", "10")
    room = ("--image-nodes", "40", "--image-uses", "4")
    build.run(*CANOPY, "compile", *tree, "--name", "exchange", "--include", "state.h", *room, "-o", out)
    arrays = []
    for name in IMAGES:
        image = out / f"{name}.img"
        build.run(
            *CANOPY, "image", "build", EXCHANGE / f"{name}.xml", "--for", out / "exchange.model.json", "-o", image
        )
        data = image.read_bytes()
        arrays.append(f"const unsigned char bench_{name}[{len(data)}] = {{{','.join(map(str, data))}}};\n")
    (out / "images.c").write_text("".join(arrays), encoding="utf-8")
    return out


def program(target: build.Target, generated: Path, folder: Path) -> Path:
    """The whole application for a Cortex-M core, as build.bare_program()."""
    sources = (
        *sorted(generated.glob("*.c")),
        EXCHANGE / "leaves.c",
        *sorted((build.REPOSITORY / "runtime/src").glob("*.c")),
    )
    include = (f"-I{generated}", f"-I{EXCHANGE}")
    return build.link_bare(target, folder / f"image_{target.name.replace(' ', '_')}.elf", *include, *sources)


def measure(target: build.Target, generated: Path, folder: Path) -> dict[str, Any]:
    """Image -> its nodes and bytes, and the instructions that its load takes. Raises RuntimeError if it is refused."""
    elf = program(target, generated, folder)
    results = {}
    for name in IMAGES:
        image = generated / f"{name}.img"
        shown = json.loads(build.run(*CANOPY, "image", "show", "--json", image))
        core = cortex_m.Core(elf)
        symbols = (core.address("exchange_image"), core.address(f"bench_{name}"))
        error, instructions = core.count("canopy_image_load", *symbols, image.stat().st_size, 0)
        if error != 0:
            raise RuntimeError(f"canopy_image_load() refuses {name}.img: {error - 2**32}")
        results[name] = {"nodes": len(shown["nodes"]), "bytes": image.stat().st_size, "instructions": instructions}
    return results
