# SPDX-License-Identifier: MIT
"""`canopy check`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from canopy.check.output import as_json, as_sarif, print_text
from canopy.check.registry import Rule, Severity
from canopy.check.rules import all_rules, table
from canopy.check.run import BusOptions, Report, check
from canopy.compiler.cli import in_range, read_type_options, type_options
from canopy.compiler.errors import CompileError, nearest
from canopy.compiler.limits import PERIOD_MS
from canopy.compiler.output import print_note
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo_lines

FOUND = 1
INPUT_ERROR = 2


def _print_rules(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value:
        echo_lines(table())
        context.exit()


def _wanted(disable: tuple[str, ...], least: Severity) -> list[Rule]:
    rules = all_rules()
    for name in disable:
        if name not in rules:
            raise click.BadParameter(f"no rule '{name}'; {nearest(name, rules)}", param_hint="--disable")
    return [rule for rule in rules.values() if rule.id not in disable and rule.severity >= least]


@click.command()
@click.argument("trees", metavar="TREE…", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--dbc", type=click.Path(path_type=Path), help="The bus: names of signals are checked, too.")
@click.option("--node", help="The controller's name among the DBC's nodes; goes with --dbc.")
@click.option("--period-ms", default=1, type=in_range(PERIOD_MS), help="Also check the cycle times against it.")
@type_options
@click.option(
    "--severity",
    type=click.Choice([severity.label for severity in Severity]),
    default="note",
    show_default=True,
    help="Least severity that is looked for.",
)
@click.option("--disable", multiple=True, metavar="RULE", help="Leave a rule out; may be given several times.")
@click.option("--strict", is_flag=True, help="Exit with status 1 for warnings, too.")
@click.option("--json", "json_", is_flag=True, help="Print JSON.")
@click.option("--sarif", is_flag=True, help="Print SARIF 2.1.0, for code hosts and editors.")
@click.option("-q", "--quiet", is_flag=True, help="Without the help lines.")
@click.option("--rules", is_flag=True, is_eager=True, expose_value=False, callback=_print_rules, help="List the rules.")
def command(
    trees: tuple[Path, ...],
    dbc: Path | None,
    node: str | None,
    period_ms: int,
    include: str | None,
    floats: bool,
    unset_ports: bool,
    type_map: tuple[str, ...],
    packages: tuple[str, ...],
    main_tree: str | None,
    severity: str,
    disable: tuple[str, ...],
    strict: bool,
    json_: bool,
    sarif: bool,
    quiet: bool,
) -> None:
    """Find mistakes in each TREE that a compiler accepts and a robot regrets (docs/lint.md).

    A node allows a rule with a marker in its _description: "canopy:allow hidden-failure: waving is only polite".

    Exit status: 0 nothing serious, 1 errors found (with --strict: or warnings), 2 a file cannot be read or compiled.

    \b
    Examples:
      canopy check trees/get_home.xml --dbc nao.dbc --node Controller
      canopy check trees/*.xml --strict --disable root-can-fail
      canopy check trees/*.xml --sarif > canopy.sarif
    """
    if (dbc is None) != (node is None):
        raise click.UsageError("--dbc and --node go together")
    if json_ and sarif:
        raise click.UsageError("--json or --sarif, not both")
    rules = _wanted(disable, Severity[severity.upper()])
    bus = BusOptions(dbc, node, period_ms) if dbc is not None and node is not None else None
    try:
        types = read_type_options(include, floats, unset_ports, type_map, packages, main_tree)
    except CompileError as error:
        echo_lines(str(error), err=True)
        sys.exit(INPUT_ERROR)
    report = Report()
    unreadable = False
    for tree in trees:
        try:
            one = check(tree, rules, bus, types)
        except CompileError as error:
            echo_lines(str(error), err=True)
            unreadable = True
            continue
        print_note(one.note)
        # What is wrong with the bus is said once, not for each tree.
        report.findings += [finding for finding in one.findings if finding not in report.findings]
        report.allowed += one.allowed
    if json_:
        echo_lines(dumps(as_json(report), indent=1))
    elif sarif:
        echo_lines(dumps(as_sarif(report, rules), indent=1))
    elif report.findings or not unreadable:
        print_text(report, quiet=quiet)
    if unreadable:
        sys.exit(INPUT_ERROR)
    worst = max((finding.rule.severity for finding in report.findings), default=Severity.NOTE)
    sys.exit(FOUND if worst >= (Severity.WARNING if strict else Severity.ERROR) else 0)
