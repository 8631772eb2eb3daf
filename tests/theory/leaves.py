# SPDX-License-Identifier: MIT
"""The tie between a model and the leaves in C: compiled leaves, called over a grid and at every border of the model."""

from __future__ import annotations

import ctypes
import os
import random
import shlex
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from pathlib import Path

from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.bus_model import Bus, Signal
from canopy.compiler.bus_reader import read_bus
from canopy.verify.checks import nodes_of, physical, signal_of
from canopy.verify.linear import State
from canopy.verify.model import RUNNING, LeafModel, Plant
from canopy.verify.run import Subject, load

ROOT = Path(__file__).parents[2]
NAO = ROOT / "examples" / "nao"
STATUS = {1: "RUNNING", 2: "SUCCESS", 3: "FAILURE"}


@dataclass(frozen=True)
class Application:
    """An application of examples/nao with its model."""

    name: str
    tree: Path
    leaves: Path

    @property
    def model(self) -> Path:
        return self.tree.with_suffix(".plant.toml")

    def subject(self) -> Subject:
        return load(self.tree, self.model, NAO / "nao.dbc", "Controller")

    def bus(self) -> Bus:
        return read_bus(NAO / "nao.dbc", "Controller", 50, self.name)


APPLICATIONS = {
    name: Application(name, NAO / "trees" / tree, NAO / leaves)
    for name, tree, leaves in (
        ("nao_home", "get_home.xml", "home_leaves.c"),
        ("nao_power", "power_supply.xml", "power_leaves.c"),
    )
}


def _member(bus: Bus, name: str) -> str:
    message_name, _, signal_name = name.partition(".")
    message = next(one for one in bus.messages if one.name == message_name)
    return f"{message.c_name}.{next(one for one in message.signals if one.name == signal_name).c_name}"


def signals(plant: Plant, bus: Bus) -> list[Signal]:
    found = [signal_of(bus, variable.signal) for variable in plant.variables]
    assert all(found)
    return [signal for signal in found if signal is not None]


def written(plant: Plant) -> list[str]:
    """The output signals that the model speaks of."""
    names = (name for leaf in plant.leaves.values() for mode in leaf.modes for name, _ in mode.writes)
    return sorted(set(names))


def shim(application: Application, subject: Subject) -> str:
    """C of tie_LEAF(state, out) for each leaf: its first tick in a state of raw values, and what it has written."""
    name, bus, plant = application.name, application.bus(), subject.plant
    lines = [f'#include "{name}_leaves.h"']
    leaves = {node.leaf.id: node.leaf for node in nodes_of(subject.tree.root) if node.leaf is not None}
    for leaf in leaves.values():
        lines += [f"int tie_{leaf.c_name}(const int64_t *state, int64_t *out)", "{"]
        lines += [f"    {name}_input_t in = {{0}};", f"    {name}_output_t commands = {{0}};", "    int status;"]
        for number, (variable, signal) in enumerate(zip(plant.variables, signals(plant, bus), strict=True)):
            lines += [f"    in.{_member(bus, variable.signal)} = ({signal.c_type})state[{number}];"]
        call = f"{leaf.c_name}_on_start" if leaf.kind == "StatefulAction" else f"{leaf.c_name}_tick"
        lines += [f"    status = (int){call}(&in, &commands);"]
        lines += [f"    out[{i}] = commands.{_member(bus, one)};" for i, one in enumerate(written(plant))]
        lines += ["    return status;", "}"]
    return "\n".join(lines) + "\n"


class Build:
    """What does not change between two versions of the leaves: the generated C and the runtime, compiled once."""

    def __init__(self, application: Application, folder: Path) -> None:
        self.application, self.folder = application, folder
        self.subject = application.subject()
        folder.mkdir(exist_ok=True)
        arguments = ["--name", application.name, "--dbc", str(NAO / "nao.dbc"), "--node", "Controller"]
        result = CliRunner().invoke(
            main, ["compile", str(application.tree), *arguments, "--period-ms", "50", "-o", str(folder)]
        )
        assert result.exit_code == 0, result.output
        (folder / "shim.c").write_text(shim(application, self.subject))
        runtime = ROOT / "runtime"
        self._compiler = [*shlex.split(os.environ.get("CC", "cc")), "-std=c11", "-O1", "-fPIC"]
        self._compiler += [f"-I{folder}", f"-I{runtime / 'include'}"]
        sources = [folder / f"{application.name}_bus.c", folder / "shim.c", *sorted((runtime / "src").glob("*.c"))]
        self._objects = []
        for source in sources:
            target = folder / f"{source.stem}.o"
            subprocess.run([*self._compiler, "-c", str(source), "-o", str(target)], check=True)
            self._objects.append(str(target))

    def leaves(self, source: Path, name: str = "leaves") -> Leaves:
        """Compiles leaves and links them."""
        library = self.folder / f"{name}.so"
        subprocess.run([*self._compiler, "-shared", str(source), *self._objects, "-o", str(library)], check=True)
        return Leaves(self.application, ctypes.CDLL(str(library)))


class Leaves:
    """The compiled leaves of an application."""

    def __init__(self, application: Application, library: ctypes.CDLL) -> None:
        self.bus = application.bus()
        self._library = library

    def tick(self, leaf: str, raw: tuple[int, ...], outputs: int) -> tuple[str, tuple[int, ...]]:
        """Status and written values of a leaf (by its name in C) in a state of raw values."""
        state = (ctypes.c_int64 * len(raw))(*raw)
        out = (ctypes.c_int64 * max(1, outputs))()
        status = getattr(self._library, f"tie_{leaf}")(state, out)
        return STATUS.get(status, str(status)), tuple(out[:outputs])


def grid(plant: Plant, bus: Bus, sweep: int = 400) -> Iterator[tuple[int, ...]]:
    """Raw states: each border of the model with its neighbours, all combined; and sweeps along each variable."""
    found = signals(plant, bus)
    ranges, borders = [], []
    formulas = [one for leaf in plant.leaves.values() for one in leaf.regions.values()]
    formulas += [mode.when for leaf in plant.leaves.values() for mode in leaf.modes]
    for index, (variable, signal) in enumerate(zip(plant.variables, found, strict=True)):
        scale, offset = Fraction(signal.scale), Fraction(signal.offset)
        low, high = (-((offset - variable.low) // scale), (variable.high - offset) // scale)
        values = {low, low + 1, high - 1, high}
        for atom in (one for formula in formulas for part in formula.parts for one in part.atoms):
            if atom.direction[index] and not any(d for i, d in enumerate(atom.direction) if i != index):
                raw = (atom.bound / atom.direction[index] - offset) / scale
                values.update(int(raw // 1) + step for step in (-1, 0, 1, 2))
        ranges.append((low, high))
        borders.append(sorted(value for value in values if low <= value <= high))
    yield from product(*borders)
    chance = random.Random(18)
    for index, (low, high) in enumerate(ranges):
        for others in product(*borders[:index], [0], *borders[index + 1 :]):
            step = max(1, (high - low) // sweep)
            for value in range(low + chance.randrange(step), high + 1, step):
                yield (*others[:index], value, *others[index + 1 :])


def expected(plant: Plant, leaf: LeafModel, bus: Bus, state: State) -> tuple[str, dict[str, int]]:
    """What the model says that a leaf returns and writes."""
    status = next(status for status, formula in leaf.regions.items() if formula.holds(state))
    writes: dict[str, int] = {}
    if status == RUNNING:
        mode = next(mode for mode in leaf.modes if mode.when.holds(state))
        for name, value in mode.writes:
            signal = signal_of(bus, name)
            assert signal is not None
            named = {one.text: one.value for one in signal.enumerators}
            writes[name] = named[value] if isinstance(value, str) else value
    return status, writes


def differences(subject: Subject, leaves: Leaves, *, first: bool = False, sweep: int = 400) -> tuple[list[str], int]:
    """Where a leaf in C is not what the model says, and how many states were compared; `first`: stop at the first."""
    plant, bus = subject.plant, leaves.bus
    names = {node.leaf.id: node.leaf.c_name for node in nodes_of(subject.tree.root) if node.leaf is not None}
    outputs, found, compared = written(plant), [], 0
    for raw in grid(plant, bus, sweep):
        state = tuple(physical(signal, value) for signal, value in zip(signals(plant, bus), raw, strict=True))
        for leaf in plant.leaves.values():
            status, writes = expected(plant, leaf, bus, state)
            got = leaves.tick(names[leaf.id], raw, len(outputs))
            wanted = (status, tuple(writes.get(name, 0) for name in outputs))
            compared += 1
            if got != wanted:
                found.append(f"{leaf.id} at {plant.shown(state)}: C {got}, model {wanted}")
                if first:
                    return found, compared
    return found, compared
