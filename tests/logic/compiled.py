# SPDX-License-Identifier: MIT
"""A tree as `canopy compile` makes it, with the engine, in one library. Leaves and signals are as a trace says."""

from __future__ import annotations

import ctypes
import itertools
import os
import shlex
import subprocess
from pathlib import Path

from click.testing import CliRunner

from canopy.cli import main
from canopy.compiler.bus_model import Bus
from canopy.compiler.tree import Node
from canopy.verify.logic.board import Board
from canopy.verify.logic.replay import Inputs
from logic.bus import NODE

RUNTIME = Path(__file__).parents[2] / "runtime"

_DRIVE = """
void logic_begin(void)
{
    (void)memset(&memory, 0, sizeof memory);
    if (t_app.start != NULL) {
        t_app.start(&memory);
    }
    (void)canopy_tree_init(&memory.tree, t_app.tree, (uint8_t *)memory.status, memory.words, &memory);
}

void logic_tick(const int64_t *in, uint64_t now, uint8_t *status, int64_t *entries)
{
    given = in;
    SIGNALS
    (void)canopy_tree_tick(&memory.tree, now);
    for (uint16_t node = 0; node < T_NODES; node++) {
        status[node] = (uint8_t)canopy_tree_status(&memory.tree, node);
    }
    ENTRIES
}

#ifdef T_TEXTS
const char *logic_text(uint64_t place)
{
    return t_texts[place];
}
#endif
"""


class Compiled:
    """An application whose nodes of the user's are leaves, each used once."""

    def __init__(self, folder: Path, path: Path, dbc: Path, nodes: list[Node], board: Board) -> None:
        self._board, self._nodes = board, nodes
        self._names = self._signals(board.bus)
        sizes = [1 + 2 * len(node.bound) for node in nodes]
        self._slots = list(itertools.accumulate(sizes, initial=0))
        """Of each node its answer, and of each port whether it is written, and what; then the signals."""
        arguments = [str(path), "--name", "t", "--dbc", str(dbc), "--node", NODE, "--period-ms", "10"]
        result = CliRunner().invoke(main, ["compile", *arguments, "-o", str(folder)])
        assert result.exit_code == 0, result.output
        (folder / "drive.c").write_text(self._source())
        sources = [folder / "drive.c", folder / "t_bus.c", *sorted((RUNTIME / "src").glob("*.c"))]
        compiler = [*shlex.split(os.environ.get("CC", "cc")), "-std=c11", "-O0", "-shared", "-fPIC"]
        library = folder / f"{path.stem}_{os.getpid()}_{id(self)}.so"
        command = [*compiler, f"-I{folder}", f"-I{RUNTIME / 'include'}", *map(str, sources), "-o", str(library)]
        subprocess.run(command, check=True)
        self._library = ctypes.CDLL(str(library))
        if "T_TEXTS" in (folder / "t_app.h").read_text():
            self._library.logic_text.restype = ctypes.c_char_p

    @staticmethod
    def _signals(bus: Bus) -> list[tuple[str, str]]:
        """(key of the trace, member of the input image)."""
        found = []
        for message in bus.receive:
            found.append((message.name, f"{message.c_name}.fresh"))
            for signal in message.signals:
                found.append((f"{message.name}.{signal.name}", f"{message.c_name}.{signal.c_name}"))
                if signal.selectors:
                    found.append((f"?{message.name}.{signal.name}", f"{message.c_name}.{signal.has_name}"))
        return found

    def _source(self) -> str:
        leaves = []
        for number, node in enumerate(self._nodes):
            if node.leaf is None:
                continue
            name, place = node.leaf.c_name, self._slots[number]
            ports = f", const {name}_ports_t *ports" if node.leaf.ports else ""
            body = ["    (void)in;", "    (void)ports;" if ports else ""]
            for slot, bound in enumerate(node.bound):
                value = f"({bound.port.type.c})given[{place + 2 + 2 * slot}]"
                body.append(f"    if (given[{place + 1 + 2 * slot}] != 0) {{")
                body += [f"        {name}_set_{bound.port.c_name}(ports, {value});", "    }"]
            body.append(f"    return (canopy_status_t)given[{place}];")
            is_action = node.leaf.kind == "StatefulAction"
            for function in ("on_start", "on_running") if is_action else ("tick",):
                leaves += [f"canopy_status_t {name}_{function}(const t_input_t *in{ports})", "{", *body, "}"]
            if is_action:
                leaves += [f"void {name}_on_halted(const t_input_t *in{ports})", "{", "    (void)in;"]
                leaves += ["    (void)ports;" if ports else "", "}"]
        first = self._slots[-1]
        signals = [f"memory.input.{name} = (bool)in[{first + i}];" for i, (_, name) in enumerate(self._names)]
        signals = [line if _is_flag(line) else line.replace("(bool)", "") for line in signals]
        entries = [f"entries[{i}] = memory.entries.{one.c_name};" for i, one in enumerate(self._board.entries)]
        drive = _DRIVE.replace("SIGNALS", "\n    ".join(signals))
        head = '#include <string.h>\n#include "t_app.c"\nstatic const int64_t *given;\n'
        return head + "\n".join(leaves) + drive.replace("ENTRIES", "\n    ".join(entries))

    def begin(self) -> None:
        """As after the start of the program."""
        self._library.logic_begin()

    def tick(self, inputs: Inputs, now_us: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """One tick: the status of each node, and what each entry holds, in steps."""
        given = [0] * (self._slots[-1] + len(self._names))
        for number, answer in inputs.answers.items():
            given[self._slots[number]] = answer
            for slot, bound in enumerate(self._nodes[number].bound):
                place = self._board.place(bound.target)
                if place is not None:
                    at = self._slots[number] + 1 + 2 * slot
                    given[at] = inputs.bits.get(("writes", number, place), False)
                    given[at + 1] = inputs.numbers.get(("value", number, place), 0)
        for place, (name, _) in enumerate(self._names, self._slots[-1]):
            given[place] = self._signal(inputs, name)
        statuses = (ctypes.c_uint8 * len(self._nodes))()
        entries = (ctypes.c_int64 * max(1, len(self._board.entries)))()
        self._library.logic_tick((ctypes.c_int64 * len(given))(*given), ctypes.c_uint64(now_us), statuses, entries)
        held = [int(entries[place]) for place in range(len(self._board.entries))]
        for place, entry in enumerate(self._board.entries):
            if entry.type.kind == "text":
                text = self._library.logic_text(ctypes.c_uint64(held[place]))
                held[place] = self._board.text(text.decode())
        return tuple(statuses), tuple(held)

    def _signal(self, inputs: Inputs, name: str) -> int:
        if name.startswith("?"):
            return int(inputs.bits.get(("come", name[1:]), False))
        message, _, signal = name.partition(".")
        fresh = inputs.bits.get(("fresh", message), False)
        if not signal:
            return int(fresh)
        come = fresh and inputs.bits.get(("come", name), True)
        old = inputs.numbers.get(("old signal", name))
        return inputs.numbers.get(("signal", name), 0) if come or old is None else old


def _is_flag(line: str) -> bool:
    return ".fresh =" in line or ".has_" in line
