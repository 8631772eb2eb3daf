# SPDX-License-Identifier: MIT
"""`canopy convert`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from canopy.compiler.bus_reader import read_messages
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.names import is_c_identifier
from canopy.convert import decision_tree, fsm, fsm_c, fsm_files, funnels, subsumption, to_fsm
from canopy.convert.chart_machine import ChartMachine
from canopy.convert.equivalence import LIMIT, Machine, Verdict, compare
from canopy.convert.machine import TreeMachine, affordable, show_acting, show_calls
from canopy.convert.read_back import read_result, runnable, signal_inputs
from canopy.convert.result import NotEqualError, write_checked
from canopy.convert.scxml import read_scxml
from canopy.convert.writer import merge_leaves, tree_file
from canopy.escape.terminal import echo, echo_lines

NOT_EQUAL = 1
INPUT_ERROR = 2

_Command = TypeVar("_Command", bound=Callable[..., Any])


def _common(command: _Command) -> _Command:
    """The options of every converter."""
    for option in (
        click.option("--seed", default=1, show_default=True, type=click.IntRange(0), help="Seed of the random part."),
        click.option(
            "--limit", default=LIMIT, show_default=True, type=click.IntRange(1),
            help="Cases that are tried; with more, a part of them, and as many at random.",
        ),
        click.option("-o", "--output", default="-", metavar="FILE", help="Where to; standard output if not given."),
    ):  # fmt: skip
        command = option(command)
    return command


def _tree_id(command: _Command) -> _Command:
    return click.option("--id", "tree_id", metavar="ID", help="The tree's ID.")(command)


def _finish(text: str, output: str, check: Callable[[Path], Verdict] | None) -> None:
    verdict = write_checked(text, output, check)
    echo("not checked" if verdict is None else f"equal to the source: {verdict}", err=True)


def _guarded(work: Callable[[], None]) -> None:
    """Runs a command's work, and ends the program with a message when it cannot be done."""
    try:
        work()
    except CompileError as error:
        echo_lines(str(error), err=True)
        sys.exit(INPUT_ERROR)
    except NotEqualError as error:
        echo_lines(f"error: the result is not equal to the source, and was not written:\n{error}", err=True)
        sys.exit(NOT_EQUAL)


def _checked_id(given: str | None, default: str) -> str:
    name = given or default
    if not is_c_identifier(name):
        raise CompileError(Place("--id"), f"'{name}' cannot be the ID of a tree", "a C identifier, for example Main")
    return name


@click.group()
def command() -> None:
    """Convert other architectures into trees, and trees into state machines (docs/convert.md).

    Each result is read back and run against what it was made from; it is written only if they are equal, and the number
    of compared cases is printed.

    Exit status: 0 written and equal, 1 not equal (nothing is written), 2 the input cannot be converted.
    """


@command.command("decision-tree")
@click.argument("file", metavar="JSON", type=click.Path(path_type=Path))
@click.option("--dbc", type=click.Path(path_type=Path), help="The bus whose signals are compared.")
@click.option("--node", help="The controller's name among the DBC's nodes; goes with --dbc.")
@click.option(
    "--shape", default="fallback", show_default=True, type=click.Choice(["fallback", "while"]),
    help="fallback: the paper's Lemma 7, for actions that are always RUNNING. while: WhileDoElse, for any.",
)  # fmt: skip
@_tree_id
@_common
def decision_tree_command(
    file: Path, dbc: Path | None, node: str | None, shape: str, tree_id: str | None, output: str, limit: int, seed: int
) -> None:
    """Convert a decision tree: JSON, or a scikit-learn estimator written by canopy.convert.sklearn_export."""
    if (dbc is None) != (node is None):
        raise click.UsageError("--dbc and --node go together")

    def work() -> None:
        source = decision_tree.read_decision_tree(file)
        bus = read_messages(dbc, node or "") if dbc is not None else None
        known = decision_tree.grids(source, bus, Place(str(file)))
        made = decision_tree.convert(source, known, shape)
        signals = decision_tree.inputs(source, known)

        def check(path: Path) -> Verdict:
            wanted = {name: one.raws for name, one in signals.items()}
            read = runnable(
                read_result(path, dbc, node or ""), signal_inputs(bus, wanted) if bus else {}, per_use=False
            )
            one = decision_tree.DecisionMachine(source, signals, shape)
            return compare(one, TreeMachine(read, show_acting), limit=affordable(limit, read), seed=seed)

        for note in made.notes:
            echo(f"note: {note}", err=True)
        leaves = merge_leaves(made.leaves, Place(str(file)))
        comment = f"The decision tree {file.name}."
        _finish(tree_file(_checked_id(tree_id, "DecisionTree"), made.root, leaves, comment), output, check)

    _guarded(work)


@command.command("subsumption")
@click.argument("layers", metavar="LAYER…", nargs=-1, required=True)
@click.option("--otherwise", metavar="ACTION", help="Has control when no layer wants it; always RUNNING.")
@click.option("--table", is_flag=True, help="Print the paper's Table II for these layers (up to six).")
@_tree_id
@_common
def subsumption_command(
    layers: tuple[str, ...], otherwise: str | None, table: bool, tree_id: str | None, output: str, limit: int, seed: int
) -> None:
    """Convert a subsumption architecture: LAYERs from the highest to the lowest, the IDs of their actions."""

    def work() -> None:
        place = Place("LAYER")
        if len(layers) > subsumption.MAX_LAYERS:
            raise CompileError(place, f"more than {subsumption.MAX_LAYERS} layers")
        if len({*layers, otherwise}) != len(layers) + 1:
            raise CompileError(place, "a layer is there twice", "each layer has an action of its own")
        if table and len(layers) > subsumption.TABLE_LAYERS:
            raise CompileError(Place("--table"), f"{2 ** len(layers)} rows", f"up to {subsumption.TABLE_LAYERS} layers")
        root, models = subsumption.convert(layers, otherwise)
        leaves = merge_leaves(models, place)
        rows = subsumption.table(layers, otherwise) if table else []
        for statuses, who in rows:
            echo(" | ".join((*statuses, who)), err=True)
        if otherwise is None:
            echo(
                "note: when no layer wants control the tree FAILS, and every output takes its safe value; "
                "--otherwise ACTION gives control to an action instead",
                err=True,
            )

        def check(path: Path) -> Verdict:
            tree = runnable(read_result(path), per_use=False)
            one = subsumption.ArbiterMachine(layers, otherwise)
            return compare(one, TreeMachine(tree, show_calls), limit=affordable(limit, tree), seed=seed)

        comment = "A subsumption architecture, the highest layer first: who wants control is RUNNING, else FAILURE."
        _finish(tree_file(_checked_id(tree_id, "Subsumption"), root, leaves, comment), output, check)

    _guarded(work)


@command.command("funnels")
@click.argument("file", metavar="JSON", type=click.Path(path_type=Path))
@_tree_id
@_common
def funnels_command(file: Path, tree_id: str | None, output: str, limit: int, seed: int) -> None:
    """Convert a family of controllers with goals and domains: sequential composition, after Burridge."""

    def work() -> None:
        family = funnels.read_family(file)
        order = funnels.order(family)
        for one in order.unplaced:
            point = ", ".join(f"{name} = {value}" for name, value in one.stuck.items())
            echo(
                f"warning: {one.controller.id} cannot be placed: its goal contains {point}, where none of "
                f"{', '.join(c.id for c in order.placed)} takes over",
                err=True,
            )
        root, models = subsumption.convert([c.id for c in order.placed], None)
        models = funnels.leaves(family, order.placed)

        def check(path: Path) -> Verdict:
            tree = runnable(read_result(path), per_use=False)
            made = TreeMachine(tree, funnels.show, funnels.decide(family))
            one = funnels.BurridgeMachine(family, order.placed)
            return compare(one, made, limit=affordable(limit, tree), seed=seed)

        comment = f"Sequential composition of {file.name}: each controller prepares one before it."
        leaves = merge_leaves(models, Place(str(file)))
        _finish(tree_file(_checked_id(tree_id, "Funnels"), root, leaves, comment), output, check)

    _guarded(work)


@command.command("fsm")
@click.argument("file", metavar="SCXML", type=click.Path(path_type=Path))
@_tree_id
@_common
def fsm_command(file: Path, tree_id: str | None, output: str, limit: int, seed: int) -> None:
    """Convert a state machine in SCXML; what of SCXML cannot be converted is rejected by name and line."""

    def work() -> None:
        chart = read_scxml(file)
        root, models = fsm.convert(chart)

        def check(path: Path) -> Verdict:
            tree = runnable(read_result(path), per_use=False)
            made = TreeMachine(tree, show_calls)
            return compare(ChartMachine(chart), made, limit=affordable(limit, tree), seed=seed)

        comment = f"The state machine {file.name}."
        name = _checked_id(tree_id, chart.name)
        _finish(tree_file(name, root, merge_leaves(models, chart.place), comment), output, check)

    _guarded(work)


def _written(machine: to_fsm.Machine, form: str, path: Path) -> Machine:
    """The machine that a written file is."""
    if form == "c":
        return fsm_c.CompiledMachine(path, machine.name, machine.vertices)
    read = fsm_files.read_scxml_back if form == "scxml" else fsm_files.read_dot_back
    return to_fsm.TableMachine(*read(path, machine.vertices))


@command.command("to-fsm")
@click.argument("tree", metavar="TREE", type=click.Path(path_type=Path))
@click.option(
    "--format", "form", default="scxml", show_default=True, type=click.Choice(["scxml", "dot", "c"]),
    help="c: one C11 header that needs nothing else.",
)  # fmt: skip
@click.option("--unchecked", is_flag=True, help="Write without running the result: for C where there is no compiler.")
@_common
def to_fsm_command(tree: Path, form: str, unchecked: bool, output: str, limit: int, seed: int) -> None:
    """Convert a tree of memoryless nodes into a state machine of its leaves: the paper's Figs. 8 to 11."""

    def work() -> None:
        parsed = read_result(tree)
        machine = to_fsm.to_machine(parsed)
        write = {"scxml": fsm_files.write_scxml, "dot": fsm_files.write_dot, "c": fsm_c.write_c}[form]

        def check(path: Path) -> Verdict:
            source = runnable(parsed, declared=False)
            made = _written(machine, form, path)
            return compare(TreeMachine(source, show_calls), made, limit=affordable(limit, source), seed=seed)

        _finish(write(machine), output, None if unchecked else check)

    _guarded(work)
