# SPDX-License-Identifier: MIT
"""What is measured: every figure of docs/benchmarks.md, as one dictionary."""

import json
import platform
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from canopy.compiler.node_types import node_types

from . import build, cortex_m, cycle, image, instructions

# Workload and n. Instructions per leaf on this machine.
HOST_ROWS = [
    ("sequence", 10),
    ("sequence", 100),
    ("sequence", 1000),
    ("sequence", 10000),
    ("fallback", 1000),
    ("reactive", 1000),
    ("reactive_running", 10),
    ("reactive_running", 100),
    ("reactive_running", 1000),
    ("memory_running", 1000),
    ("balanced", 6),
    ("sequence", 60000),
    ("inverters", 60000),
]
CORTEX_ROWS = [("sequence", 10), ("sequence", 100), ("reactive_running", 100), ("balanced", 6)]
# Each of these at two sizes or depths: the stack must be the same.
STACK_ROWS = [
    ("sequence", (10, 60000)),
    ("inverters", (10, 60000)),
    ("halt_reactive", (2, 60)),
    ("halt_parallel", (2, 60)),
    ("halt_timeout", (2, 60)),
]
# Ticks of the trees for the worst stack. The times of the nodes are 2 ms.
STACK_TICKS, STACK_PERIOD_US = 100, 700
WORKLOADS = [
    *("sequence", "fallback", "reactive", "reactive_running", "memory_running"),
    *("balanced", "inverters", "halt_reactive", "halt_parallel", "halt_timeout"),
]
PEER_PROGRAMS = {"BehaviorTree.CPP 4": "behaviortree_cpp.py", "bonsai-bt": "bonsai.py", "py_trees": "pytrees.py"}
PEER_PACKAGES = {"BehaviorTree.CPP 4": "behaviortreepy", "bonsai-bt": "bonsai-bt", "py_trees": "py_trees"}
PEER_SHAPES = [("sequence", 1000, 1000), ("balanced", 6, 256)]  # the last number: leaf calls a tick
PEER_TIMED_TICKS = 200
ALLOCATORS = ("malloc", "calloc", "realloc", "free", "aligned_alloc", "sbrk", "_sbrk", "mmap")

Progress = Callable[[str], None]


def _host(folder: Path, say: Progress) -> dict[str, Any]:
    results: dict[str, Any] = {}
    for target in build.HOSTS:
        program = build.host_program(target, folder)
        counts = {}
        for workload, n in HOST_ROWS:
            say(f"{target.name}: {workload} {n}")
            counts[f"{workload} {n}"] = round(instructions.canopy_per_leaf(program, workload, n), 2)
        results[target.name] = {"version": build.run(*target.command, "--version").splitlines()[0], "per_leaf": counts}
    return results


def _cortex(folder: Path, say: Progress) -> dict[str, Any]:
    results: dict[str, Any] = {}
    for target in build.CORTEX_M4:
        program = build.bare_program(target, folder)
        counts = {}
        for workload, n in CORTEX_ROWS:
            say(f"{target.name}: {workload} {n}")
            core = cortex_m.Core(program)
            core.build(WORKLOADS.index(workload), n)
            core.tick(0)
            tick = core.tick(2000)
            counts[f"{workload} {n}"] = round(tick.instructions / tick.leaf_calls, 2)
        stack = {f"{workload} {n}": tick_stack(program, workload, n) for workload, ns in STACK_ROWS for n in ns}
        say(f"{target.name}: the stack of every node type")
        types = stack_of_types(program)
        worst = max(types.values())
        of = [name for name, most in types.items() if most == worst]
        results[target.name] = {"per_leaf": counts, "stack": stack, "worst_stack": {"bytes": worst, "of": of}}
    return results


def stack_of_types(program: Path) -> dict[str, int]:
    """Node type -> the most stack that ticks and halts take in a tree with one such node [bytes]."""
    worst = {}
    for name, node_type in node_types().items():
        stacks = []
        for asked in (False, True):
            core = cortex_m.Core(program)
            if core.build_stack(node_type.number, asked) == 0:
                raise RuntimeError(f"canopy_tree_validate() refuses the tree for the stack of {name}")
            stacks.append(core.worst_stack(STACK_TICKS, STACK_PERIOD_US))
        worst[name] = max(stacks)
    return worst


def tick_stack(program: Path, workload: str, n: int) -> int:
    """Largest stack of three ticks [bytes]: the first starts what is to be halted, the second halts it."""
    core = cortex_m.Core(program)
    core.build(WORKLOADS.index(workload), n)
    return max(core.tick(number * 2000, count=False).stack for number in range(3))


def _images(folder: Path, say: Progress) -> dict[str, Any]:
    say("loading tree images")
    generated = image.generate(folder)
    return {target.name: image.measure(target, generated, folder) for target in build.CORTEX_M4}


def _cycles(folder: Path, say: Progress) -> dict[str, Any]:
    """Application -> compiler -> part -> instructions a cycle."""
    results: dict[str, Any] = {}
    for application in (*cycle.APPLICATIONS, cycle.idle(folder / "idle_tree")):
        generated = cycle.generate(application, folder)
        columns = results[application.title] = {}
        for target in build.HOSTS:
            say(f"{target.name}: cycles of {application.name}")
            columns[target.name] = cycle.measure_host(
                cycle.host_program(target, application, generated, folder), application.warm_up
            )
        for target in build.CORTEX_M4:
            say(f"{target.name}: cycles of {application.name}")
            columns[target.name] = cycle.measure_cortex(
                cycle.bare_program(target, application, generated, folder), application.warm_up
            )
    return results


def _memory(folder: Path) -> dict[str, Any]:
    program = build.host_program(build.HOSTS[0], folder)
    objects = {
        target: build.engine_object(target, folder) for target in (*build.HOSTS, *build.CORTEX_M4, *build.CORTEX_M0)
    }
    outside = {t.name: build.undefined_symbols(t, path) for t, path in objects.items()}
    return {
        "sizes": json.loads(build.run(program, "sizes")),
        "allocators": sum(len(set(ALLOCATORS) & set(symbols)) for symbols in outside.values()),
        "calls_outside": outside,
        "code_bytes": {t.name: build.text_bytes(t, path) for t, path in objects.items()},
    }


def _peers(folder: Path, say: Progress) -> dict[str, Any]:
    program = build.host_program(build.HOSTS[0], folder)
    results: dict[str, Any] = {"Canopy": {"version": "this tree", "per_leaf": {}, "nanoseconds": {}}}
    for shape, n, leaves in PEER_SHAPES:
        timed = json.loads(build.run(program, "time", shape, str(n)))
        results["Canopy"]["per_leaf"][shape] = round(instructions.canopy_per_leaf(program, shape, n), 2)
        results["Canopy"]["nanoseconds"][shape] = round(timed["nanoseconds"] / leaves, 2)
    for name, file in PEER_PROGRAMS.items():
        path = build.HERE / "peer_programs" / file
        package = PEER_PACKAGES[name]
        version = build.run(sys.executable, "-c", f"import importlib.metadata as m; print(m.version('{package}'))")
        results[name] = {"version": f"{package} {version.strip()}", "per_leaf": {}, "nanoseconds": {}}
        for shape, n, leaves in PEER_SHAPES:
            say(f"{name}: {shape} {n}")
            command = (sys.executable, path, shape, str(n))
            results[name]["per_leaf"][shape] = round(instructions.per_tick(command) / leaves, 1)
            shortest = int(build.run(*command, str(PEER_TIMED_TICKS)))
            results[name]["nanoseconds"][shape] = round(shortest / leaves, 1)
    return results


def measure(say: Progress) -> dict[str, Any]:
    """Everything; takes minutes. `say` is told what comes next. Raises RuntimeError when a program fails."""
    with tempfile.TemporaryDirectory(prefix="canopy-bench-") as name:
        folder = Path(name)
        return {
            "machine": platform.machine(),
            "host": _host(folder, say),
            "cortex_m4": _cortex(folder, say),
            "cycles": _cycles(folder, say),
            "images": _images(folder, say),
            "memory": _memory(folder),
            "peers": _peers(folder, say),
        }
