# SPDX-License-Identifier: MIT
"""One case: the files that its seed and number say, what the compiler makes of them, and leaves for that."""

from __future__ import annotations

import random
import re
import traceback
from dataclasses import dataclass, field
from pathlib import Path

from canopy.compiler import codec
from canopy.compiler.emit import Application, load_application, render
from canopy.compiler.errors import CompileError
from canopy.compiler.leaf_c import prototypes
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.port_types import Options
from fuzz.generated.bus import BusMaker
from fuzz.generated.hostile import Hostile
from fuzz.generated.tree import TreeMaker


@dataclass
class Case:
    """What became of a case. `sources` is empty when the compiler has refused it; `fault` says what is wrong."""

    seed: int
    number: int
    folder: Path
    name: str = ""
    refusal: str = ""
    fault: str = ""
    sources: list[Path] = field(default_factory=list)


def make_case(seed: int, number: int, top: Path) -> Case:
    """Writes the input files of a case into a folder of its own, and compiles them to C there."""
    rng = random.Random(f"{seed}:{number}")
    hostile = Hostile(rng)
    case = Case(seed, number, top / f"case_{number}", f"case_{number}")
    case.folder.mkdir(parents=True, exist_ok=True)
    period_ms = rng.choice([1, 10, 100])
    other = random.Random(f"{seed}:{number}:bit rate")  # of its own: the files stay those of the seed
    if other.random() < 0.05:
        period_ms = 3_600_000
    bitrate = other.choice([1_000, 500_000, 100_000_000])
    bus = BusMaker(rng, hostile, period_ms)
    tree = TreeMaker(rng, hostile, bus.inputs, bus.outputs)
    xml, dbc = tree.xml(), bus.dbc()
    if rng.random() < 0.04:
        xml = hostile.damaged(xml)
    if rng.random() < 0.04:
        dbc = hostile.damaged(dbc)
    # Names of files stand in comments, too; the bus's is also part of a symbol.
    tree_file = case.folder / (_file_name(hostile.text("tree", 0.05)) + ".xml")
    dbc_file = case.folder / (_file_name(hostile.text("bus", 0.05)) + f"_{number}.dbc")
    images = (rng.choice([20, 65534]), rng.choice([1, 8])) if rng.random() < 0.15 else None
    try:
        tree_file.write_text(xml, encoding="utf-8", errors="replace", newline="")
        dbc_file.write_text(dbc, encoding=rng.choice(["cp1252", "utf-8"]), errors="replace", newline="")
        options = Options(floats=tree.floats, unset_ports=True)
        application = load_application(
            case.name, tree_file, dbc_file, "Controller", period_ms, bitrate, None, options, images
        )
        files = render(application)
    except CompileError as error:
        case.refusal = str(error)
        if not error.place.file.startswith((str(case.folder), "--")):
            case.fault = f"an error without a place: {error}"
        return case
    except Exception:
        case.fault = f"the compiler has failed:\n{traceback.format_exc(limit=-6)}"
        return case
    _write(case, application, files, rng)
    return case


def _file_name(text: str) -> str:
    return re.sub(r"[/\0]", "", text)[:60]


def _write(case: Case, application: Application, files: dict[str, bytes], rng: random.Random) -> None:
    out = case.folder / "out"
    out.mkdir(exist_ok=True)
    for name, content in files.items():
        if name.endswith((".c", ".h")):
            (out / name).write_bytes(content)
    (out / "leaves.c").write_text(_leaves(application, rng))
    case.sources = [*sorted(out.glob("case_*.c")), out / "leaves.c"]


def _leaves(application: Application, rng: random.Random) -> str:
    """Leaves that answer anything, write anything to their outputs, and read what they are given."""
    lines = [f'#include "{application.name}_leaves.h"', '#include "harness.h"', ""]
    for use in application.table.users:
        for prototype in prototypes(use.leaf, application.bus):
            lines += [prototype, "{", "    (void)in;"]
            lines += _writes(application, use.leaf) if use.leaf.writes else []
            lines += _reads(use.leaf) if use.leaf.ports else []
            if not prototype.startswith("void"):
                lines += [f"    return (canopy_status_t)(fuzz_next() % {rng.choice([4, 5, 6])}u);"]
            lines += ["}", ""]
    return "\n".join(lines)


def _writes(application: Application, leaf: Leaf) -> list[str]:
    bus = application.bus
    lines = []
    for message in bus.send:
        if message.name in {name.partition(".")[0] for name in leaf.writes}:
            for signal in message.signals:
                kind = codec.parameter_type(bus, message, signal)
                value = f"({kind})fuzz_next()"
                if signal.is_bool:
                    value = "(fuzz_next() & 1u) != 0u"
                lines.append(f"    {bus.name}_set_{message.c_name}_{signal.c_name}(out, {value});")
    return [*lines, "    (void)out;"]


def _reads(leaf: Leaf) -> list[str]:
    lines = ["    (void)ports;"]
    for port in leaf.ports:
        if port.writes:
            kind = leaf.text_type if port.type.kind == "text" else port.type.c
            value = "(fuzz_next() & 1u) != 0u" if kind == "bool" else f"({kind})fuzz_next()"
            lines.append(f"    {leaf.c_name}_set_{port.c_name}(ports, {value});")
        elif port.type.kind == "text":
            lines.append(f"    fuzz_read_text(ports->{port.c_name});")
        else:
            lines.append(f"    fuzz_read(&ports->{port.c_name}, sizeof ports->{port.c_name});")
    return lines
