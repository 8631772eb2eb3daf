# SPDX-License-Identifier: MIT
"""`canopy verify`."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from canopy.certificate.check import check, decoded
from canopy.certificate.formula import RejectedError
from canopy.compiler.cli import read_type_options, type_options
from canopy.compiler.errors import CompileError, Place
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo, echo_lines
from canopy.files import FileError, read_bytes, write_files
from canopy.verify.arithmetic import ARITHMETICS, SIGNALS, TITLES
from canopy.verify.certify import certificate
from canopy.verify.claims import Result
from canopy.verify.logic import cli as logic
from canopy.verify.model import Plant, number
from canopy.verify.record import record
from canopy.verify.run import Subject, chosen, hand_over, in_arithmetic, load, model_path, recheck, verify
from canopy.verify.solvers import SOLVERS

SHOWN = 8
UNEXPECTED = 1
INPUT_ERROR = 2


@dataclass(frozen=True)
class Decided:
    """A claim's result, what solvers say of it, and the results in other arithmetics, by name."""

    result: Result
    checked: dict[str, str]
    rounded: dict[str, Result]

    @property
    def is_good(self) -> bool:
        """Is everything as the model file expects?"""
        results = (self.result, *self.rounded.values())
        return all(one.expected for one in results) and "disagrees" not in self.checked.values()


def _trace(plant: Plant, result: Result, whole: bool) -> list[str]:
    lines = [f"{step:>6}  {plant.shown(visit.state)}  {visit.label}" for step, visit in enumerate(result.trace)]
    if whole or len(lines) <= SHOWN + 1:
        return lines
    return [*lines[: SHOWN // 2], f"     …  {len(lines) - SHOWN} more (--trace shows all)", *lines[-SHOWN // 2 :]]


def _print(plant: Plant, result: Result, checked: dict[str, str], whole: bool) -> None:
    mark = "" if result.expected else f"   NOT AS EXPECTED ({result.claim.options.get('expect', 'proven')})"
    echo(f"{result.verdict:8} {result.claim.name}{mark}")
    solvers = "".join(f", {solver} {answer}" for solver, answer in checked.items() if answer)
    echo(f"         {result.text} ({result.method}, {result.seconds:.2f} s{solvers})")
    if result.trace and (whole or result.verdict == "refuted"):
        for line in _trace(plant, result, whole):
            echo(f"  {line}")


def _print_rounded(plant: Plant, name: str, result: Result, whole: bool) -> None:
    """What becomes of a claim in an arithmetic."""
    mark = "" if result.expected else f"   NOT AS EXPECTED ({result.claim.options.get('expect', 'proven')})"
    echo(f"         {TITLES[name]}: {result.verdict}, {result.text} ({result.method}, {result.seconds:.2f} s){mark}")
    for line in _trace(plant, result, whole) if result.trace and (whole or not result.expected) else ():
        echo(f"  {line}")


def _as_json(subject: Subject, decided: Decided) -> dict[str, Any]:
    result, checked = decided.result, decided.checked
    names = [variable.name for variable in subject.plant.variables]
    return {
        "claim": result.claim.name,
        "kind": result.claim.kind,
        "verdict": result.verdict,
        "expected": result.expected,
        "text": result.text,
        "method": result.method,
        "bound": None if result.bound is None else number(result.bound),
        "seconds": round(result.seconds, 3),
        "solvers": {solver: answer for solver, answer in checked.items() if answer},
        "arithmetic": {
            name: {
                "verdict": one.verdict,
                "text": one.text,
                "bound": None if one.bound is None else number(one.bound),
            }
            for name, one in decided.rounded.items()
        },
        "trace": [
            {
                "state": {name: number(value) for name, value in zip(names, visit.state, strict=True)},
                "does": visit.label,
                "status": visit.status,
            }
            for visit in result.trace
        ],
    }


def _print_handover(subject: Subject) -> None:
    found = hand_over(subject)
    for one in found:
        what = "FALLS BETWEEN: the tree fails" if one.falls else one.target
        shown = subject.plant.shown
        echo(f"hand-over {one.source} -> {what}: for example from {shown(one.before)} to {shown(one.after)}")
    if not any(one.falls for one in found):
        echo("hand-over: no step leads to where the tree fails")


def _certify(folder: Path, subject: Subject, result: Result, tree: Path, timeout: float, *, quiet: bool) -> None:
    """Writes the certificate of a claim, or says why there is none."""
    try:
        text = certificate(result.claim, tree, subject.plant.path, timeout)
    except RejectedError as error:
        line = f"no certificate: {error}"
    else:
        file = folder / f"claim-{result.claim.index + 1:02d}.certificate"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_files({file: text})
        except FileError as error:
            raise CompileError(Place(str(file)), error.problem) from error
        except OSError as error:
            raise CompileError(Place(str(file)), f"cannot be written: {error.strerror}") from error
        line = f"certificate {file}, {len(text)} bytes"
    if not quiet:
        echo(f"         {line}")


def _record(folder: Path, subject: Subject, result: Result, period_ms: int, *, quiet: bool) -> None:
    """Writes what refutes a claim as a record for the program."""
    assert subject.bus is not None
    content, rounded = record(result.trace, subject.plant, subject.bus, period_ms)
    file = folder / f"claim-{result.claim.index + 1:02d}.record"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_files({file: content})
    except FileError as error:
        raise CompileError(Place(str(file)), error.problem) from error
    except OSError as error:
        raise CompileError(Place(str(file)), f"cannot be written: {error.strerror}") from error
    if not quiet:
        note = f", {rounded} of them rounded to the signals' steps" if rounded else ""
        echo(f"         record {file}: {len(result.trace)} ticks{note}")


def _check(folder: Path, tree: Path, model: Path) -> int:
    """Checks every certificate of a folder. Returns the exit status."""
    files = sorted(folder.glob("*.certificate"))
    if not files:
        echo(f"{folder}: error: no certificates", err=True)
        echo(f"  help: write them with --certificate {folder}", err=True)
        return INPUT_ERROR
    rejected = 0
    for file in files:
        try:
            text = read_bytes(file)
            shown = check(text, tree, model)
            echo(f"accepted {file.name}: {decoded(text)['name']}: {shown}")
        except (RejectedError, FileError, OSError) as error:
            rejected += 1
            echo(f"rejected {file.name}: {error}")
    return UNEXPECTED if rejected else 0


def _usage(dbc: Path | None, node: str | None, main_tree: str | None, solver: tuple[str, ...], stored: bool) -> None:
    """Rejects options that do not go together."""
    if (dbc is None) != (node is None):
        raise click.UsageError("--dbc and --node go together")
    if main_tree is not None and stored:
        raise click.UsageError("certificates are about the file's main tree: leave --main-tree out")
    for one in solver:
        if importlib.util.find_spec(one) is None:
            raise click.UsageError(f"--solver {one} needs a Python package: pip install 'canopy-bt[verify]'")


WITH_MODEL = ("model", "names", "arithmetic", "solver", "folder", "records", "checked_folder", "handover")


def _logic_usage(asked: bool, period: int | None) -> None:
    """Rejects options that do not go with questions about the logic alone, or only with them."""
    context = click.get_current_context()
    if period is not None and not asked and context.params["records"] is None:
        raise click.UsageError("--period goes with --never, --always or --record")
    for option in context.command.params if asked else ():
        if option.name in WITH_MODEL and context.params[option.name]:
            raise click.UsageError(f"{option.opts[0]} needs a model: it does not go with --never or --always")


def _finish(subject: Subject, results: list[Decided], json_: bool) -> None:
    """Ends with what the results say."""
    if json_:
        echo_lines(dumps([_as_json(subject, one) for one in results], indent=1))
    elif not results:
        echo("the model is one of this tree; it claims nothing")
    sys.exit(0 if all(one.is_good for one in results) else UNEXPECTED)


@click.command()
@click.argument("tree", metavar="TREE", type=click.Path(path_type=Path))
@click.option("--model", type=click.Path(path_type=Path), help="The model. [default: NAME.plant.toml beside the tree]")
@click.option("--dbc", type=click.Path(path_type=Path), help="The bus: checks the model's signals and units.")
@click.option("--node", help="The controller's name among the DBC's nodes; goes with --dbc.")
@type_options
@click.option("--claim", "names", multiple=True, metavar="NAME", help="Only this claim; may be given several times.")
@click.option("--solver", multiple=True, type=click.Choice(SOLVERS), help="Have a solver check the proofs again.")
@click.option(
    "--arithmetic",
    multiple=True,
    type=click.Choice(ARITHMETICS),
    help="Decide each claim also for leaves that see steps of the DBC's signals, or binary32.",
)
@click.option(
    "--timeout",
    default=60.0,
    show_default=True,
    type=click.FloatRange(0.1, 86_400),
    help="Seconds per claim or question.",
)
@click.option("--certificate", "folder", type=click.Path(path_type=Path), help="Write certificates to this folder.")
@click.option("--record", "records", type=click.Path(path_type=Path), help="Write refutations for PROGRAM --replay.")
@click.option("--check", "checked_folder", type=click.Path(path_type=Path), help="Only check a folder's certificates.")
@click.option("--never", multiple=True, metavar="FORMULA", help="Without a model: does no tick fulfil this?")
@click.option("--always", multiple=True, metavar="FORMULA", help="Without a model: does every tick fulfil this?")
@click.option(
    "--period", type=click.IntRange(1, 3_600_000), help="Of --never, --always, --record: time between ticks [ms]."
)
@click.option("--handover", is_flag=True, help="Also print which leaf hands over to which.")
@click.option("--trace", "whole", is_flag=True, help="Print every trace, and all of it.")
@click.option("--json", "json_", is_flag=True, help="Print JSON.")
def command(
    tree: Path,
    model: Path | None,
    dbc: Path | None,
    node: str | None,
    include: str | None,
    floats: bool,
    unset_ports: bool,
    type_map: tuple[str, ...],
    packages: tuple[str, ...],
    main_tree: str | None,
    names: tuple[str, ...],
    solver: tuple[str, ...],
    arithmetic: tuple[str, ...],
    timeout: float,
    folder: Path | None,
    records: Path | None,
    checked_folder: Path | None,
    never: tuple[str, ...],
    always: tuple[str, ...],
    period: int | None,
    handover: bool,
    whole: bool,
    json_: bool,
) -> None:
    """Decide what a model of its leaves makes of TREE: time bounds, safety, margins, chattering (docs/verify.md).

    The model says for each leaf where it returns what, and what it does to the plant's state. Each claim in it is
    proven, refuted with a state and the steps from there, or unknown. All arithmetic is exact.

    A certificate has the numbers that show a claim of the kinds reaches and avoids. --check judges them again with a
    small program that has no solver, and that reads tree and model by itself.

    --never and --always need no model: they ask about nodes, entries and signals, now and in the past, for any answers
    that the leaves declare and any messages. They need the program berkeley-abc, and --dbc and --node to know signals.

    Exit status: 0 all came out as the model file expects, and all questions are proven, 1 one did not, a solver
    disagrees, or a certificate is rejected, 2 wrong input.

    \b
    Examples:
      canopy verify examples/nao/trees/get_home.xml
      canopy verify examples/nao/trees/power_supply.xml --dbc examples/nao/nao.dbc --node Controller
      canopy verify examples/nao/trees/get_home.xml --solver z3 --solver cvc5 --json
      canopy verify examples/nao/trees/get_home.xml --certificate proofs
      canopy verify examples/nao/trees/get_home.xml --check proofs
      canopy verify TREE --never 'RUNNING(A) and RUNNING("Go home")'
      canopy verify TREE --always 'responds(SUCCESS(Overheated), RUNNING(Fan), 3)'
    """
    questions = [("--never", one) for one in never] + [("--always", one) for one in always]
    _logic_usage(bool(questions), period)
    _usage(dbc, node, main_tree, solver, folder is not None or checked_folder is not None)
    if records is not None and (dbc is None or period is None):
        raise click.UsageError("--record needs --dbc, --node and --period: it writes frames, tick by tick")
    if SIGNALS in arithmetic and dbc is None:
        raise click.UsageError("--arithmetic signals needs --dbc and --node: they have the steps")
    results = []
    if checked_folder is not None:
        sys.exit(_check(checked_folder, tree, model or model_path(tree)))
    try:
        options = read_type_options(include, floats, unset_ports, type_map, packages, main_tree)
        if questions:
            how = logic.How(dbc, node or "", period, timeout, whole, json_)
            sys.exit(logic.run(tree, questions, options, how))
        subject = load(tree, model or model_path(tree), dbc, node or "", options)
        others = {name: in_arithmetic(subject, name) for name in arithmetic}
        for claim in chosen(subject, names):
            result = verify(subject, claim, timeout)
            checked = {one: recheck(result, one) for one in solver}
            rounded = {name: verify(other, claim, timeout) for name, other in others.items()}
            results.append(Decided(result, checked, rounded))
            if not json_:
                _print(subject.plant, result, checked, whole)
            for name, one in rounded.items() if not json_ else ():
                _print_rounded(subject.plant, name, one, whole)
            if folder is not None and result.verdict == "proven":
                _certify(folder, subject, result, tree, timeout, quiet=json_)
            if records is not None and period is not None and result.verdict == "refuted" and result.trace:
                _record(records, subject, result, period, quiet=json_)
        if handover and not json_:
            _print_handover(subject)
    except CompileError as error:
        echo_lines(str(error), err=True)
        sys.exit(INPUT_ERROR)
    _finish(subject, results, json_)
