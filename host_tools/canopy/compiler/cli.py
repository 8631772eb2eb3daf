# SPDX-License-Identifier: MIT
"""`canopy compile`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import click

from canopy.compiler.bounds import BURST, LATENCY_US, LOAD_PERCENT, Bounds, Others, refusal
from canopy.compiler.budget import Budget
from canopy.compiler.dbc_file import bus_paths, remove_old_overlay
from canopy.compiler.emit import load_application, render
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.image_room import DEFAULT_USES, IMAGE_NODES, IMAGE_USES
from canopy.compiler.limits import BITRATE, PERIOD_MS, TRACE_TICKS, Limits
from canopy.compiler.names import is_c_identifier
from canopy.compiler.output import INPUT_ERROR, dependencies, fail, print_note, write_or_exit
from canopy.compiler.port_types import Options, is_fixed_point, is_queue
from canopy.compiler.stubs import stubs
from canopy.compiler.trace import TICKS_DEFAULT, Entries, Trace, TraceOptions
from canopy.escape import c
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo, echo_lines

_Command = TypeVar("_Command", bound=Callable[..., object])


def _print_costs(budget: Budget) -> None:
    width = max(len(cost.kind) for cost in budget.kinds)
    echo(f"  {'kind of node':{max(width, 12)}}  nodes  RAM each  flash each")
    for cost in budget.kinds:
        echo(f"  {cost.kind:{max(width, 12)}} {cost.nodes:6d} {cost.ram_each:9d} {cost.flash_each:11d}")


def _print_trace(budget: Budget, trace: Trace) -> None:
    idle, worst = budget.trace_load_percent or (0.0, 0.0)
    values = f", {len(trace.values)} values" if trace.values else ""
    load = f"{idle:6.2f} % of the bus while nothing changes, {worst:.2f} % at most"
    echo(f"  trace  {load}; {budget.trace_ram_bytes} bytes of RAM, room for {trace.ticks} ticks without a bus")
    echo(f"         {trace.nodes} nodes{values}, all known within {trace.known_within_ms} ms")


def _print_budget(name: str, budget: Budget, trace: Trace | None, max_ram: int | None, max_flash: int | None) -> None:
    def limit(value: int | None) -> str:
        return f" of {value}" if value is not None else ""

    echo(f"{name}: {budget.nodes} nodes, depth {budget.max_depth}")
    echo(f"  RAM    {budget.ram_bytes:6d}{limit(max_ram)} bytes, all of it static (32-bit target)")
    echo(f"  flash  {budget.flash_bytes:6d}{limit(max_flash)} bytes of constant tables")
    echo(f"  leaves {budget.worst_tick_leaf_calls:6d} calls in the worst tick")
    what = "every cyclic message of the DBC" + (" and the trace" if trace is not None else "")
    echo(f"  CAN    {budget.can_load_percent:6.2f} % of {budget.bitrate} bit/s, {what}")
    if trace is not None:
        _print_trace(budget, trace)
    _print_bounds(budget.bounds)


def _ms(value_us: int | None) -> str:
    return f"{-(-value_us // 100) / 10:g} ms" if value_us is not None else "-"


def _print_bounds(bounds: Bounds) -> None:
    others = bounds.others
    frames = f"{bounds.frames_per_tick} frames, {len(bounds.outputs)} of them commands"
    echo(f"  sends  {frames}, in the worst tick; with fewer transmit buffers the controller needs its interrupt")
    echo(f"  with {others.load_percent} % load by others, in bursts of {others.burst} frames:")
    if bounds.inputs:
        width = max(len(bound.name) for bound in bounds.inputs)
        for bound in bounds.inputs:
            stale = f"stale {_ms(bound.stale_us)} after its last frame" if bound.stale_us else "never stale"
            echo(f"    {bound.name:{width}}  at most {_ms(bound.age_us)} old at a decision, {stale}")
    if bounds.outputs:
        width = max(len(output.name) for output in bounds.outputs)
        for output in bounds.outputs:
            safe = f", safe value {_ms(output.safe_us)} after an input is cut" if output.safe_us else ""
            wait, reaction = _ms(output.wait_us), _ms(output.reaction_us)
            echo(f"    {output.name:{width}}  out {wait} after its tick, reaction {reaction}{safe}")
        limit = bounds.load_limit_percent
        echo(f"    kept up to {limit} % load by others" if limit is not None else "    not kept at any load")


package_option = click.option(
    "--ros-package", "packages", multiple=True, metavar="NAME=DIR", help="Folder of an <include ros_pkg>."
)


main_tree_option = click.option(
    "--main-tree", metavar="ID", help="The tree to take, where the file has several and no main_tree_to_execute."
)


def _keep(context: click.Context, parameter: click.Parameter, value: tuple[str, ...]) -> None:
    """Keeps an option that all commands over trees have, and that only read_type_options() asks for."""
    context.meta[f"canopy.{parameter.name}"] = value


def _kept(name: str) -> tuple[str, ...]:
    context = click.get_current_context(silent=True)
    return context.meta.get(f"canopy.{name}", ()) if context is not None else ()


foreign_option = click.option(
    "--foreign",
    multiple=True,
    metavar="NAME",
    expose_value=False,
    callback=_keep,
    help="An attribute or metadata key of another tool that looks like a misspelt one of Canopy's.",
)


search_option = click.option(
    "--search",
    multiple=True,
    metavar="PATH",
    expose_value=False,
    callback=_keep,
    help="A folder, a Groot2 project or a file with trees and models that TREE does not include.",
)


def type_options(command: _Command) -> _Command:
    """The options about types and includes, of the commands that look into ports and scripts."""
    for option in (
        main_tree_option,
        package_option,
        search_option,
        foreign_option,
        click.option("--type-map", multiple=True, metavar="CXX=C", help="A C++ type of the tree, and your C type."),
        click.option(
            "--allow-unset-ports",
            "unset_ports",
            is_flag=True,
            help="Let input ports have neither a value nor a default: they are 0, false or NULL.",
        ),
        click.option(
            "--allow-floating-point", "floats", is_flag=True, help="Let ports and scripts use float and double."
        ),
        click.option(
            "--include", help="Header of yours with the state types of leaves, included by the generated files."
        ),
    ):
        command = option(command)
    return command


class HexNumber(click.ParamType[int]):
    """A number that may be written with 0x."""

    name = "number"

    def __init__(self, low: int, high: int) -> None:
        self._low = low
        self._high = high

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Raises click.BadParameter when it is none, or out of range."""
        try:
            number = int(str(value), 0)
        except ValueError:
            self.fail(f"'{value}' is no number; for example 0x600", param, ctx)
        if not self._low <= number <= self._high:
            self.fail(f"{value} is not between 0x{self._low:X} and 0x{self._high:X}", param, ctx)
        return number


def _trace(base: int | None, guard: int | None, entries: Entries, ticks: int) -> TraceOptions | None:
    if base is None:
        if guard is not None or entries != "all":
            raise CompileError(
                Place("--trace-guard" if guard is not None else "--trace-entries"),
                "needs --trace",
                "for example --trace 0x600",
            )
        return None
    return TraceOptions(base, guard, entries, ticks)


def in_range(limits: Limits) -> click.IntRange:
    """The type of an option whose value becomes a C integer."""
    return click.IntRange(limits.low, limits.high)


def read_packages(packages: tuple[str, ...]) -> dict[str, Path]:
    """What `package_option` was given.

    Raises:
        CompileError: one is malformed.
    """
    folders = {}
    for pair in packages:
        name, found, folder = pair.partition("=")
        if not found or not name or not folder:
            raise CompileError(Place("--ros-package"), f"'{pair}' is not NAME=DIR", "for example my_trees=src/my_trees")
        folders[name] = Path(folder)
    return folders


def read_search() -> tuple[Path, ...]:
    """What `search_option` was given.

    Raises:
        CompileError: there is nothing at a path.
    """
    places = tuple(Path(place) for place in _kept("search"))
    for place in places:
        if not place.exists():
            raise CompileError(Place(f"--search {place}"), "is not there", "a folder, a .btproj, or a tree file")
    return places


def read_type_options(
    include: str | None,
    floats: bool,
    unset_ports: bool,
    type_map: tuple[str, ...],
    packages: tuple[str, ...],
    main_tree: str | None,
) -> Options:
    """What `type_options` were given.

    Raises:
        CompileError: a --type-map or --ros-package is malformed.
    """
    result = {}
    for pair in type_map:
        cxx, found, c_type = pair.rpartition("=")
        if not found or not (is_c_identifier(c_type.strip()) or is_fixed_point(c_type) or is_queue(c_type)):
            raise CompileError(Place("--type-map"), f"'{pair}' is not CXX=C", "for example nav_msgs::msg::Path=path_t")
        result[cxx.strip()] = c_type.strip()
    if include is not None:
        try:
            c.header(include)
        except ValueError as error:
            raise CompileError(Place("--include"), str(error)) from error
    return Options(
        floats,
        result,
        include,
        read_packages(packages),
        unset_ports,
        main_tree,
        search=read_search(),
        foreign=frozenset(_kept("foreign")),
    )


def _images(nodes: int | None, uses: int | None) -> tuple[int, int] | None:
    if nodes is None and uses is not None:
        raise CompileError(Place("--image-uses"), "needs --image-nodes", "say how many nodes an image may have")
    return None if nodes is None else (nodes, uses or DEFAULT_USES)


@click.command()
@click.argument("tree", type=click.Path(path_type=Path))
@click.option("--dbc", required=True, type=click.Path(path_type=Path), help="The bus the controller is on.")
@click.option("--node", required=True, help="The controller's name among the DBC's nodes (BU_).")
@click.option("--period-ms", required=True, type=in_range(PERIOD_MS), help="Time from tick to tick.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Folder for the generated files.")
@click.option("--name", help="Name of the application; the tree file's stem if not given.")
@type_options
@click.option("--stubs", "stubs_file", type=click.Path(path_type=Path), help="Write skeletons of what you write.")
@click.option("--depfile", type=click.Path(path_type=Path), help="Write the files that were read, as make's rule.")
@click.option("--image-nodes", type=in_range(IMAGE_NODES), help="Keep room for tree images of so many nodes.")
@click.option("--image-uses", type=in_range(IMAGE_USES), help="Of each leaf in an image; 8 if not given.")
@click.option("--bitrate", default=500_000, show_default=True, type=in_range(BITRATE), help="Of the bus, in bit/s.")
@click.option(
    "--foreign-load",
    default=LOAD_PERCENT,
    show_default=True,
    type=click.IntRange(0, 99),
    help="Share of the bus that frames of others take, in percent; all of them count as more urgent.",
)
@click.option(
    "--foreign-burst",
    default=BURST,
    show_default=True,
    type=click.IntRange(0, 10_000),
    help="So many frames of others may come in a row on top of that.",
)
@click.option(
    "--tx-latency-us",
    default=LATENCY_US,
    show_default=True,
    type=click.IntRange(0, 1_000_000),
    help="From a free mailbox to its next frame.",
)
@click.option(
    "--trace",
    "trace_base",
    type=HexNumber(0, 0x1FFFFFF8),
    metavar="ID",
    help="Send the trace, with eight ids from this one on.",
)
@click.option(
    "--trace-entries",
    default="all",
    show_default=True,
    type=click.Choice(["all", "marked", "none"]),
    help='Entries that the trace tells; marked: those of nodes with _trace="yes".',
)
@click.option(
    "--trace-guard", type=HexNumber(0, 0xFFFF), metavar="DATA_ID", help="Protect CanopyTick by E2E Profile 11."
)
@click.option(
    "--trace-ticks",
    default=TICKS_DEFAULT,
    show_default=True,
    type=in_range(TRACE_TICKS),
    help="Keep the trace of so many ticks while the bus lets nothing through.",
)
@click.option("--max-ram", type=click.IntRange(0), help="Fail when the static object is larger than so many bytes.")
@click.option("--max-flash", type=click.IntRange(0), help="Fail when the tables are larger than so many bytes.")
@click.option("--costs", is_flag=True, help="Print what each kind of node costs, too.")
@click.option("--json", "as_json", is_flag=True, help="Print the budget as JSON.")
def command(
    tree: Path,
    dbc: Path,
    node: str,
    period_ms: int,
    output: Path,
    name: str | None,
    include: str | None,
    floats: bool,
    unset_ports: bool,
    type_map: tuple[str, ...],
    packages: tuple[str, ...],
    main_tree: str | None,
    stubs_file: Path | None,
    depfile: Path | None,
    image_nodes: int | None,
    image_uses: int | None,
    bitrate: int,
    foreign_load: int,
    foreign_burst: int,
    tx_latency_us: int,
    trace_base: int | None,
    trace_entries: Entries,
    trace_guard: int | None,
    trace_ticks: int,
    max_ram: int | None,
    max_flash: int | None,
    costs: bool,
    as_json: bool,
) -> None:
    """Compile TREE (BehaviorTree.CPP XML, format 4) and a DBC to C.

    Writes NAME_app.c, NAME_app.h, NAME_leaves.h (what you write), NAME_bus.c and NAME_bus.h (the bus and its codec),
    and NAME.model.json for the tools; with --trace also NAME_trace.dbc, for other tools. Nothing is written when
    anything is wrong. Exit status: 0 done, 2 the input cannot be compiled.

    \b
    Example:
      canopy compile trees/get_home.xml --dbc nao.dbc --node Controller --period-ms 50 --trace 0x600 -o build/get_home
    """
    try:
        options = read_type_options(include, floats, unset_ports, type_map, packages, main_tree)
        images = _images(image_nodes, image_uses)
        others = Others(foreign_load, foreign_burst, tx_latency_us)
        trace = _trace(trace_base, trace_guard, trace_entries, trace_ticks)
        application = load_application(
            name or tree.stem, tree, dbc, node, period_ms, bitrate, include, options, images, others, trace
        )
        broken = refusal(application.bus, application.budget.bounds)
        if broken is not None:
            raise CompileError(Place(str(dbc)), *broken)
        files = render(application)
        first = (
            {}
            if stubs_file is None
            else {stubs_file: stubs(application.name, application.table, application.bus).encode()}
        )
        if depfile is not None:
            read = [*application.table.tree.files, *bus_paths(dbc)]
            first |= dependencies(depfile, output / f"{application.name}_app.c", read)
    except CompileError as error:
        fail(error)
    budget = application.budget
    for what, used, most in (("RAM", budget.ram_bytes, max_ram), ("flash", budget.flash_bytes, max_flash)):
        if most is not None and used > most:
            echo(f"{tree}: error: {what} budget exceeded: {used} of {most} bytes", err=True)
            sys.exit(INPUT_ERROR)
    for remark in application.bus.remarks:
        echo_lines(str(remark), err=True)
    write_or_exit(output, files, first, (stubs_file,) if stubs_file is not None else ())
    remove_old_overlay(output / dbc.name, files)
    print_note(application.table.tree.foreign.note())
    if as_json:
        echo(dumps(budget.as_dict()))
    else:
        _print_budget(application.name, budget, application.trace, max_ram, max_flash)
        if costs:
            _print_costs(budget)
