# SPDX-License-Identifier: MIT
"""Runs Frama-C: EVA on the engine, the validator, the loop and the codecs, WP on the rings' and validator's contracts.

usage: run.py [--jobs N] [--only WORD] [--all]

Prints a line a run and exits with 1 when one has an alarm that alarms.txt does not list, has not one that it lists, has
not come to its end, or has left a goal unproved. The logs stay in build/proof. --only takes the runs whose name has the
word in it; --all looks at every type of inner node, which takes hours.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path("tests/proof")
OUT = Path("build/proof")
PLAIN = OUT / "plain"  # where EVA works: the runtime without contracts
ENGINE = ["runtime/src/tree.c", "runtime/src/tree_validate.c"]
CODECS = [*sorted(Path("tests/integration/dbc").glob("*.dbc")), Path("examples/nao/nao.dbc")]
FRAMA_C = ["frama-c", "-c11", "-no-unicode", "-machdep", "gcc_x86_64"]
# States are kept apart at every return, so a tree's states are found one by one and never mixed.
EXACT = ["-eva-slevel", "10000000", "-eva-split-return", "full"]
# States are mixed at once: only so can tables of every size be looked at.
ANY_TABLE = ["-eva-slevel", "2", "-eva-domains", "cvalue,equality,symbolic-locations"]
ANY_TABLE += ["-eva-split-return-function", "canopy_tree_init:0,canopy_tree_validate:0"]
# main() may mix its states: which hooks there are is one state. A mailbox is looked at by itself.
LOOP = ["-eva-slevel", "20", "-eva-split-return-function", "receive:full,copy:0,find_mailbox:full,settle:full"]
LOOP += ["-eva-slevel-function", "main:0,find_mailbox:500,collect:500", "-eva-min-loop-unroll", "4"]


@dataclass
class Run:
    """One call of Frama-C: what it looks at, and with which options."""

    name: str
    sources: list[str]
    options: list[str]
    include: list[str] = field(default_factory=list)
    defines: list[str] = field(default_factory=list)
    everything: bool = False  # no statement of a function that is called at all may be out of reach
    wp: bool = False

    def command(self) -> list[str]:
        """The words to call."""
        share = subprocess.run(["frama-c", "-print-share-path"], capture_output=True, text=True, check=True).stdout
        include = [*self.include, "runtime/include", "runtime/src"]
        cpp = [f"-I{folder}" for folder in include] + [f"-D{define}" for define in self.defines]
        if self.wp:
            cpp = ["-nostdinc", f"-I{HERE}/include", f"-I{HERE}/include/atomics", *cpp, f"-I{share.strip()}/libc"]
            prove = ["-wp", "-wp-rte", *self.options, "-wp-prover", "z3,cvc4", "-wp-timeout", "60"]
            return [*FRAMA_C, "-no-frama-c-stdlib", f"-cpp-extra-args={' '.join(cpp)}", *prove, *self.sources]
        # Frama-C's own <stdatomic.h> says nothing of what its functions do.
        cpp += ["-D__FC_STDATOMIC", "-include", f"{HERE}/include/atomics/stdatomic.h"]
        show = ["-eva", "-eva-no-show-progress"]
        return [*FRAMA_C, f"-cpp-extra-args={' '.join(cpp)}", *show, *self.options, *self.sources]


def node_types() -> list[str]:
    """The node types' names in C, in the order of their numbers."""
    text = Path("runtime/include/canopy/nodes.def").read_text(encoding="utf-8")
    return re.findall(r"^CANOPY_NODE\((\w+),", text, re.MULTILINE)


def generate() -> Path:
    """Make the application, the codecs, and for each a program that calls its functions; return the former's folder."""
    canopy = [sys.executable, "-m", "canopy"]
    application = OUT / "nao_home"
    tree = ["examples/nao/trees/get_home.xml", "--dbc", "examples/nao/nao.dbc", "--node", "Controller"]
    options = ["--period-ms", "50", "--name", "nao_home", "-o", str(application)]
    subprocess.run([*canopy, "compile", *tree, *options], check=True, stdout=subprocess.DEVNULL)
    for dbc in CODECS:
        subprocess.run([*canopy, "codec", str(dbc), "-o", str(OUT)], check=True, stdout=subprocess.DEVNULL)
        harness = subprocess.run(
            [sys.executable, str(HERE / "codec_harness.py"), str(OUT / f"{dbc.stem}_codec.h")],
            capture_output=True,
            text=True,
            check=True,
        )
        (OUT / f"{dbc.stem}_harness.c").write_text(harness.stdout, encoding="utf-8")
    return application


def all_runs(every_inner: bool) -> list[Run]:
    """What there is to prove; the longest first."""
    application = generate()
    types = node_types()
    heavy = ["USER_CONTROL", "PARALLEL"]
    runs = [
        Run(
            f"tree {name}{', marked by the trace' if marked else ''}",
            [f"{HERE}/eva_tree.c", *ENGINE],
            EXACT,
            defines=[f"ROOT={types.index(name)}", *(["MARKED"] if marked else []), *(["ALL"] if every_inner else [])],
        )
        for name in sorted(types, key=lambda name: name not in heavy)
        for marked in (False, True)
    ]
    loop = [
        f"runtime/src/{part}.c"
        for part in (
            "tree",
            "bus",
            "transport",
            "can_state",
            "loop",
            "loop_run",
            "trace",
            "trace_health",
            "trace_nodes",
            "trace_values",
            "tx",
            "tx_service",
            "e2e",
        )
    ]
    generated = [str(path) for path in sorted(application.glob("*.c"))]
    runs += [
        Run("wp ring, time", [f"{HERE}/wp_arithmetic.c", "runtime/src/ring.c"], ["-wp-model", "Typed+Cast"], wp=True),
        # What the shapes are is proved by itself: 38 lines of values would be in the way of each of the other goals.
        Run("wp validator", [f"{HERE}/wp_validate.c"],
            ["-wp-no-init-const", "-wp-skip-fct",
             "shapes_of_nodes_def,canopy_time_reached,canopy_tree_status,canopy_tree_status_code"], wp=True),
        Run("wp shapes", [f"{HERE}/wp_validate.c"], ["-wp-fct", "shapes_of_nodes_def"], wp=True),
        Run("wp walks", [f"{HERE}/wp_walks.c"],
            ["-wp-fct", "canopy_count_children,canopy_parallel_open_child,canopy_try_catch_handler"], wp=True),
        *(Run(name, [f"{HERE}/eva_loop.c", *loop, *generated, "examples/nao/home_leaves.c"], LOOP,
              include=[str(application)], defines=defines)
          for name, defines in (("loop, bus, trace", []), ("loop, bus, mailboxes", ["MAILBOXES"]))),
        Run("e2e, time", [f"{HERE}/eva_e2e.c", "runtime/src/e2e.c"],
            ["-eva-precision", "6"]),
        Run("any table", [f"{HERE}/eva_table.c", *ENGINE], ANY_TABLE),
    ]  # fmt: skip
    return runs + [
        Run(f"codec {dbc.stem}", [f"{OUT}/{dbc.stem}_harness.c", f"{OUT}/{dbc.stem}_codec.c"],
            ["-eva-slevel", "100", "-warn-special-float", "none"], include=[str(OUT)], everything=True)
        for dbc in CODECS
    ]  # fmt: skip


def leave_out_contracts() -> None:
    """EVA would give an alarm for each contract that it cannot prove, and rely on it: it gets none of them."""
    for path in sorted(Path("runtime").rglob("*.*")):
        (PLAIN / path).parent.mkdir(parents=True, exist_ok=True)
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"/\*@.*?\*/|//@[^\n]*", lambda found: "\n" * found[0].count("\n"), text, flags=re.DOTALL)
        (PLAIN / path).write_text(text, encoding="utf-8")
    for folder in ("tests", "examples", "build"):
        if not (PLAIN / folder).is_symlink():
            (PLAIN / folder).symlink_to(Path(folder).resolve())


def listed_alarms() -> dict[str, set[str]]:
    """alarms.txt: run, then alarm; the indented lines after one or more alarms say why they cannot be."""
    alarms: dict[str, set[str]] = {}
    reasoned = True
    for line in (HERE / "alarms.txt").read_text(encoding="utf-8").splitlines():
        if line and line[0] not in "# ":
            run, alarm = line.split(" | ")
            alarms.setdefault(run, set()).add(alarm)
        if line and line[0] != "#":
            reasoned = line[0] == " "
        elif not reasoned:
            sys.exit(f"{HERE}/alarms.txt: no reason is given before the line after: {alarm}")
    return alarms


def found_alarms(log: str) -> set[str]:
    """`file: assertion` of each; a line's number would change with every edit above it."""
    found = re.findall(r"^\[eva:alarm\] (\S+?):\d+: Warning:((?:\s+[^\[\s].*)+)", log, re.MULTILINE)
    return {f"{file}: {' '.join(text.split())}" for file, text in found}


def judge_eva(run: Run, log: str) -> tuple[str, list[str]]:
    """What a run of EVA has looked at, and what is wrong with it."""
    functions = re.search(r"(\d+) functions analyzed", log)
    reached = re.search(r"(\d+) statements reached \(out of (\d+)\)", log)
    properties = re.findall(r"(?:Assertions|Preconditions) +\d+ valid +(\d+) unknown +(\d+) invalid", log)
    if functions is None or reached is None or "NON TERMINATING" in log:
        return "not done", ["did not get to its end"]
    found, listed = found_alarms(log), listed_alarms().get(run.name, set())
    wrong = [f"new alarm: {alarm}" for alarm in sorted(found - listed)]
    wrong += [f"gone, take it out of alarms.txt: {alarm}" for alarm in sorted(listed - found)]
    if any(unknown != "0" or invalid != "0" for unknown, invalid in properties):
        wrong.append("an assertion or a precondition is not valid")
    if run.everything and reached[1] != reached[2]:
        wrong.append("a statement is out of reach")
    return f"{functions[1]} functions, {reached[1]} statements, {len(found)} alarms", wrong


def judge_wp(log: str) -> tuple[str, list[str]]:
    """What WP has proved, and what not."""
    proved = re.search(r"Proved goals: +(\d+) / (\d+)", log)
    if proved is None:
        return "not done", ["did not get to its end"]
    wrong = re.findall(r"^\[wp\] \[(?:Failed|Timeout|Unknown|Unsuccess)\] Goal (\S+)", log, re.MULTILINE)
    if proved[1] != proved[2] and not wrong:
        wrong = ["goals are not proved"]
    return f"{proved[1]} of {proved[2]} goals proved", wrong


def prove(run: Run) -> bool:
    """One run; True when all is proved."""
    started = time.monotonic()
    folder = Path.cwd() if run.wp else PLAIN.resolve()
    environment = {**os.environ, "PWD": str(folder)}  # Frama-C goes by this
    result = subprocess.run(run.command(), cwd=folder, env=environment, capture_output=True, text=True, check=False)
    log = result.stdout + result.stderr
    (OUT / f"{re.sub('[^A-Za-z0-9]+', '_', run.name)}.log").write_text(log, encoding="utf-8")
    summary, wrong = judge_wp(log) if run.wp else judge_eva(run, log)
    if result.returncode != 0:
        wrong.append(log[-500:])
    lines = [f"{run.name:48} {summary:45} {time.monotonic() - started:5.0f} s", *(f"    {line}" for line in wrong)]
    print("\n".join(lines), flush=True)
    return not wrong


def prove_axioms() -> bool:
    """What wp_arithmetic.c takes for given, and the places in a ring."""
    answers = subprocess.run(["z3", str(HERE / "arithmetic.smt2")], capture_output=True, text=True, check=False)
    good = answers.stdout.split() == ["unsat"] * 5
    print(f"{'arithmetic':48} {'5 of 5 proved' if good else answers.stdout + answers.stderr}", flush=True)
    return good


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", metavar="WORD")
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    os.environ["WHY3CONFIG"] = str(OUT / "why3.conf")  # not the one in the user's home
    subprocess.run(["why3", "config", "detect"], capture_output=True, check=True)
    leave_out_contracts()
    runs = [run for run in all_runs(options.all) if options.only in run.name]
    with ThreadPoolExecutor(max_workers=options.jobs) as pool:
        results = [prove_axioms(), *pool.map(prove, runs)]
    print(f"{results.count(True)} of {len(results)} proved")
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
