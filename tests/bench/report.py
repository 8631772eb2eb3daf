# SPDX-License-Identifier: MIT
"""Writes the measured figures as Markdown: readable in a terminal, and the tables of docs/benchmarks.md."""

from collections.abc import Sequence
from typing import Any

WHAT = {
    "sequence": "Sequence of {n} true conditions",
    "fallback": "Fallback of {n} false conditions",
    "reactive": "ReactiveSequence of {n} true conditions",
    "reactive_running": "ReactiveSequence of {n} leaves, the last one RUNNING",
    "memory_running": "Sequence of {n} leaves, the last one RUNNING: resumed there",
    "balanced": "balanced tree: {n} levels of 4 children, 5,461 nodes",
    "inverters": "{n} Inverters in each other, and a leaf",
    "halt_reactive": "ReactiveSequence abandons an action below {n} Sequences",
    "halt_parallel": "ReactiveParallel abandons an action below {n} Sequences",
    "halt_timeout": "Timeout abandons an action below {n} Sequences",
}
# The parts of a cycle, and what they are called.
CYCLE = {
    "whole": "mean of 100 cycles",
    "receive": "- check and decode",
    "begin": "- freshness, safe outputs",
    "tick": "- tick",
    "commit": "- commit",
    "trace": "- trace",
    "transmit": "- transmit",
    "rest": "- loop, clock, driver",
    "interrupts": "transmit interrupts, on top",
    "e2e": "- E2E in check and transmit",
    "worst": "longest of them",
}
WITHOUT_SHARE = ("whole", "interrupts", "worst")
PARTS_OF_WHOLE = ("receive", "begin", "tick", "commit", "trace", "transmit")
CYCLE_TARGETS = {
    "nao_power": {"cortex-m4 -O2": {"whole": 2300}},
    "courier": {"cortex-m4 -O2": {"whole": 3200}},
    "idle": {"cortex-m4 -O2": {"trace": 3500}},
}
TARGETS = {"sequence 100": "33", "balanced 6": "46"}

# Not to be had from a package registry, so not measured here: quoted from the measurements that set the targets, made
# once, on another day, with the same work in the leaves of all engines, gcc 12 -O2.
QUOTED = [
    ("c-behavior-tree (quoted)", "45", "63", "five node kinds, no halt; 72 B of RAM a node (36 B on Cortex-M)"),
    ("ZephyrBT core (quoted)", "33", "46", "no halt, its Parallel is a stub; 16 B of RAM a node (12 B on Cortex-M)"),
]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[column]) for row in [head, *rows]) for column in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        first = cells[0].ljust(widths[0])
        rest = [cell.rjust(width) for cell, width in zip(cells[1:], widths[1:], strict=True)]
        return "| " + " | ".join([first, *rest]) + " |"

    rule = (
        "|"
        + "|".join("-" * (widths[0] + 2) if not column else "-" * (w + 1) + ":" for column, w in enumerate(widths))
        + "|"
    )
    return "\n".join([line(head), rule, *map(line, rows)])


def _what(key: str) -> str:
    workload, n = key.split()
    return WHAT[workload].format(n=f"{int(n):,}")


def _per_leaf(key: str, value: float) -> str:
    return f"{value / (int(key.split()[1]) + 1):.1f}" if key.startswith("inverters") else f"{value:.1f}"


def _instructions(results: dict[str, Any]) -> str:
    columns = {**results["host"], **results["cortex_m4"]}
    keys = list(dict.fromkeys(key for column in columns.values() for key in column["per_leaf"]))
    rows = [
        [
            _what(key) + (", a node" if key.startswith("inverters") else ""),
            *(_per_leaf(key, c["per_leaf"][key]) if key in c["per_leaf"] else "" for c in columns.values()),
            TARGETS.get(key, ""),
        ]
        for key in keys
    ]
    names = [f"{results['machine']}, {name} -O2" if name in results["host"] else name for name in columns]
    return _table(["instructions a leaf", *names, "to reach"], rows)


def _stack(results: dict[str, Any]) -> str:
    columns = results["cortex_m4"]
    keys = list(next(iter(columns.values()))["stack"])
    rows = [[_what(key), *(str(c["stack"][key]) for c in columns.values())] for key in keys]
    worst = []
    for column in columns.values():
        most, of = column["worst_stack"]["bytes"], column["worst_stack"]["of"]
        worst.append(f"{most} ({of[0] if len(of) == 1 else f'{len(of)} types'})")
    rows.append(["all node types, ticked, abandoned and halted: the worst", *worst])
    return _table(["stack of a tick [bytes]", *columns], rows)


def _cycle_cell(name: str, target: str, counts: dict[str, float], part: str) -> str:
    if part == "rest":
        value = counts["whole"] - sum(counts[named] for named in PARTS_OF_WHOLE)
    elif part in counts and (counts[part] or part != "interrupts"):
        value = counts[part]
    else:
        return ""
    most = CYCLE_TARGETS.get(name, {}).get(target, {}).get(part)
    share = f" ({value / counts['whole']:.0%})" if part not in WITHOUT_SHARE else ""
    return f"{value:,.0f}" + share + (f" (to reach: {most:,})" if most is not None else "")


def _cycles(applications: dict[str, Any], machine: str) -> str:
    rows = []
    columns: list[str] = []
    for name, targets in applications.items():
        columns = [target if " " in target else f"{machine}, {target} -O2" for target in targets]
        for part, what in CYCLE.items():
            cells = [_cycle_cell(name, target, counts, part) for target, counts in targets.items()]
            if any(cells):
                rows.append([f"{name}: {what}" if part in WITHOUT_SHARE else what, *cells])
    return _table(["instructions per cycle", *columns], rows)


def _images(columns: dict[str, Any]) -> str:
    rows = []
    for name, image in next(iter(columns.values())).items():
        counts = [f"{column[name]['instructions']:,}" for column in columns.values()]
        rows.append([f"tree image of {image['nodes']} nodes, {image['bytes']} bytes", *counts])
    return _table(["instructions of canopy_image_load()", *columns], rows)


def _memory(memory: dict[str, Any]) -> str:
    sizes = memory["sizes"]
    outside = sorted({symbol for symbols in memory["calls_outside"].values() for symbol in symbols})
    rows = [
        ["flash per node [bytes]", str(sizes["flash_per_node"]), "12"],
        ["RAM per node [bytes]", str(sizes["ram_per_node"]), "2"],
        ["RAM per state word of a node that has state [bytes]", str(sizes["ram_per_word"]), ""],
        ["RAM per instance of a tree, 64 bit [bytes]", str(sizes["instance"]), ""],
        ["allocators that the engine's object files call", str(memory["allocators"]), "0"],
        ["functions that the engine calls from elsewhere", ", ".join(outside) or "none", ""],
        *(
            [f"code and constants, every node type, {name} [bytes]", f"{size:,}", ""]
            for name, size in memory["code_bytes"].items()
        ),
    ]
    return _table(["memory", "measured", "to reach"], rows)


def _peers(peers: dict[str, Any]) -> str:
    own = peers["Canopy"]["nanoseconds"]
    rows = []
    for name, peer in peers.items():
        times = peer["nanoseconds"]
        ratios = " / ".join(f"{times[shape] / own[shape]:,.0f}" if name != "Canopy" else "1" for shape in own)
        counts = [f"{peer['per_leaf'][shape]:,.0f}" for shape in own]
        rows.append([f"{name} ({peer['version']})", *counts, ratios])
    rows += [[name, flat, balanced, ""] for name, flat, balanced, _ in QUOTED]
    head = ["engine", "Sequence of 1,000", "balanced", "time of a leaf, Canopy = 1"]
    notes = "\n".join(f"- {name}: {note}." for name, _, _, note in QUOTED)
    return _table(head, rows) + "\n\n" + notes


def markdown(results: dict[str, Any]) -> str:
    """The six tables."""
    cycles = _cycles(results["cycles"], results["machine"])
    tables = (_instructions(results), cycles, _stack(results), _images(results["images"]), _memory(results["memory"]))
    return "\n\n".join((*tables, _peers(results["peers"])))
