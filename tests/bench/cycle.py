# SPDX-License-Identifier: MIT
"""Counts the instructions of whole cycles of the examples, on this machine and on Cortex-M4."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cantools

from . import build, cortex_m, image, instructions

EXAMPLES = build.REPOSITORY / "examples"
CYCLES = 100
WHOLE = "canopy_loop_step"
INTERRUPT = "bench_cycle_interrupt"
# What of a cycle is counted by itself: the functions' instructions, with all that they call.
PARTS = {
    "receive": ("canopy_bus_receive",),
    "begin": ("canopy_bus_begin_tick",),
    "tick": ("canopy_tree_tick",),
    "commit": ("canopy_bus_commit",),
    "trace": ("canopy_trace_send", "canopy_trace_health"),
    "transmit": ("canopy_tx_service",),
    # In receive and transmit, and there a second time.
    "e2e": ("canopy_e2e_check", "canopy_e2e_protect"),
}


@dataclass(frozen=True)
class Application:
    """An example, and what its bus carries before each cycle: message -> its signals' values."""

    name: str
    folder: Path
    tree: str
    dbc: str
    leaves: tuple[str, ...]
    frames: dict[str, dict[str, Any]]
    options: tuple[str, ...] = ()
    warm_up: int = 0
    """Cycles before those that are counted."""
    mailboxes: int = 0
    """Of the controller; 0: what it is given is out at once."""

    @property
    def title(self) -> str:
        """Its name in the tables."""
        return f"{self.name} with {self.mailboxes} mailboxes" if self.mailboxes else self.name


_E2E = {"E2E_CRC": 0, "E2E_Counter": 0}
_NAO = {
    "Battery": {**_E2E, "Charging": 0, "Level": 50.0, "ChargerDistance": 5.0},
    "Posture": {**_E2E, "HeadX": 0.5, "HeadHeight": 0.0},
}
_COURIER = {
    "Pose": {"X": 0, "Y": 0},
    "Order": {"Number": 1, "X": 3000, "Y": 2000},
    "PlanReply": {"Number": 1, "Result": 1, "ViaX": 1500, "ViaY": 1400},
    "MapStatus": {"ClearNumber": 1},
}
_COURIER_TYPES = {
    "geometry_msgs::msg::PoseStamped_<std::allocator<void>>": "pose_t",
    "nav_msgs::msg::Path_<std::allocator<void>>": "path_t",
}
_NAO_POWER = Application("nao_power", EXAMPLES / "nao", "power_supply.xml", "nao.dbc", ("power_leaves.c",), _NAO)
APPLICATIONS = (
    _NAO_POWER,
    Application("nao_home", EXAMPLES / "nao", "get_home.xml", "nao.dbc", ("home_leaves.c",), _NAO),
    Application(
        "courier",
        EXAMPLES / "courier",
        "courier.xml",
        "courier.dbc",
        ("navigation_nodes.c", "courier_leaves.c"),
        _COURIER,
        (
            *("--include", "courier_types.h"),
            *(word for cpp, c in _COURIER_TYPES.items() for word in ("--type-map", f"{cpp}={c}")),
        ),
    ),
    replace(_NAO_POWER, mailboxes=3),
)


IDLE_NODES = 1000
_IDLE_DBC = """VERSION ""
BU_: Controller
BO_ 256 Nothing: 1 Controller
 SG_ Zero : 0|8@1+ (1,0) [0|255] "" Vector__XXX
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_ SG_ "GenSigInactiveValue" INT 0 255;
BA_DEF_DEF_ "GenMsgCycleTime" 50;
BA_DEF_DEF_ "GenSigInactiveValue" 0;
"""


def idle(folder: Path, count: int = IDLE_NODES) -> Application:
    """A tree of so many nodes that are all ticked in every tick, always with the same results."""
    (folder / "trees").mkdir(parents=True, exist_ok=True)
    nodes = "<AlwaysSuccess/>" * (count - 1)
    tree = f'<root BTCPP_format="4"><BehaviorTree ID="Idle"><Sequence>{nodes}</Sequence></BehaviorTree></root>'
    (folder / "trees" / "idle.xml").write_text(tree, encoding="utf-8")
    (folder / "idle.dbc").write_text(_IDLE_DBC, encoding="utf-8")
    return Application("idle", folder, "idle.xml", "idle.dbc", (), {}, warm_up=60)


def _frames(application: Application) -> str:
    """The frames that arrive as C: bench_frames."""
    database = cantools.database.load_file(application.folder / application.dbc)
    rows = []
    for name, values in application.frames.items():
        message = database.get_message_by_name(name)  # type: ignore[union-attr]
        data = message.encode(values)
        rows.append(f"{{.id = {message.frame_id}u, .length = {len(data)}, .data = {{{', '.join(map(str, data))}}}}}")
    lines = ",\n    ".join(rows or ["{0}"])
    return (
        f'#include "cycle.h"\n\nconst canopy_can_frame_t bench_frames[] = {{\n    {lines}}};\n'
        f"const uint32_t bench_frame_count = {len(rows)};\n"
    )


def generate(application: Application, folder: Path) -> Path:
    """The application in C, and frames.c; returns the folder with all that."""
    out = folder / application.name
    tree, dbc = application.folder / "trees" / application.tree, application.folder / application.dbc
    options = (
        "--node",
        "Controller",
        "--period-ms",
        "50",
        "--trace",
        "0x600",
        "--name",
        application.name,
        *application.options,
    )
    build.run(*image.CANOPY, "compile", tree, "--dbc", dbc, *options, "-o", out)
    (out / "frames.c").write_text(_frames(application), encoding="utf-8")
    return out


def _sources(application: Application, generated: Path) -> tuple[str | Path, ...]:
    return (
        *(f"-DBENCH_APP={application.name}_app", f"-DBENCH_MAILBOXES={application.mailboxes}"),
        *(f"-I{generated}", f"-I{application.folder}"),
        *sorted(generated.glob("*.c")),
        *(application.folder / leaves for leaves in application.leaves),
        *sorted((build.REPOSITORY / "runtime/src").glob("*.c")),
        build.HERE / "cycle.c",
    )


def host_program(target: build.Target, application: Application, generated: Path, folder: Path) -> Path:
    """The application and its bus for this machine: bench_cycle CYCLES."""
    path = folder / f"cycle_{application.name}_{application.mailboxes}_{target.name}"
    sources = _sources(application, generated)
    build.run(*target.command, *build.COMMON, *sources, build.HERE / "cycle_main.c", "-o", path)
    return path


def measure_host(program: Path, warm_up: int = 0) -> dict[str, float]:
    """Part -> its instructions per cycle, and "whole" and "interrupts", which come on top of the whole.

    Raises RuntimeError when a frame was lost or rejected.
    """

    def counted(cycles: int, functions: tuple[str, ...]) -> int:
        return instructions.collected((program, str(cycles)), within=functions)[0] if cycles else 0

    parts = {"whole": (WHOLE,), **PARTS, "interrupts": (INTERRUPT,)}
    counts = {
        part: round((counted(warm_up + CYCLES, functions) - counted(warm_up, functions)) / CYCLES, 1)
        for part, functions in parts.items()
    }
    counts["transmit"] = round(counts["transmit"] - counts["interrupts"], 1)  # what is called within both
    return counts


def bare_program(target: build.Target, application: Application, generated: Path, folder: Path) -> Path:
    """The same for a Cortex-M core, as build.link_bare()."""
    path = folder / f"cycle_{application.name}_{application.mailboxes}_{target.name.replace(' ', '_')}.elf"
    return build.link_bare(target, path, *_sources(application, generated))


def measure_cortex(program: Path, warm_up: int = 0) -> dict[str, float]:
    """As measure_host(), and "worst": the most that a single cycle took."""
    core = cortex_m.Core(program)
    if core.call("bench_cycle_start") != 0:
        raise RuntimeError(f"{program.name}: canopy_loop_init() rejects the application")
    parts = {function: part for part, functions in PARTS.items() for function in functions}
    totals = dict.fromkeys(("whole", *PARTS, "interrupts"), 0)
    worst = 0
    for number in range(warm_up + CYCLES):
        core.call("bench_cycle_prepare")
        counts = core.count_parts(WHOLE, parts, core.address("bench_loop"))
        if number < warm_up:
            continue
        worst = max(worst, counts["whole"])
        for part, count in counts.items():
            totals[part] += count
        while core.call("bench_cycle_let_out") != 0:
            counts = core.count_parts(INTERRUPT, parts)
            totals["interrupts"] += counts["whole"]
            totals["e2e"] += counts["e2e"]
    failures = core.call("bench_cycle_failures")
    if failures != 0:
        raise RuntimeError(f"{program.name}: {failures} frames were lost or rejected, or faults counted")
    return {**{part: round(total / CYCLES, 1) for part, total in totals.items()}, "worst": worst}
