# SPDX-License-Identifier: MIT
"""The real engine in this process: runtime/src as a shared library, ticked through ctypes with Python leaves."""

from __future__ import annotations

import ctypes
import os
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

from canopy.compiler.table import make_table
from canopy.compiler.tree import Node, Script, Tree

RUNTIME = Path(__file__).parents[2] / "runtime"
IDLE, RUNNING, SUCCESS, FAILURE, SKIPPED = range(5)
NAMES = ("IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED")

_TICK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_uint16)
_SCRIPT = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)
_HALTED = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint16)


class _Node(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_uint8),
        ("asks", ctypes.c_uint8),
        *((name, ctypes.c_uint16) for name in ("parent", "end", "state", "leaf", "parameter")),
    )


class _Leaf(ctypes.Structure):
    _fields_ = (("tick", _TICK), ("running", _TICK), ("halted", _HALTED))


class _Tree(ctypes.Structure):
    _fields_ = (
        ("nodes", ctypes.POINTER(_Node)),
        ("leaves", ctypes.POINTER(_Leaf)),
        ("controls", ctypes.c_void_p),
        ("scripts", ctypes.POINTER(_SCRIPT)),
        ("parameters", ctypes.POINTER(ctypes.c_int32)),
        *((f"{name}_count", ctypes.c_uint16) for name in ("node", "leaf", "control", "script", "parameter", "word")),
    )


class _Instance(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("tree", "application", "status", "words")),
        ("now", ctypes.c_uint64),
        ("faults", ctypes.c_uint32),
        ("fault_node", ctypes.c_uint16),
    )


def build(folder: Path) -> ctypes.CDLL:
    """Compiles the runtime with $CC (cc) into `folder`."""
    library = folder / "libcanopy_engine.so"
    sources = [str(RUNTIME / "src" / name) for name in ("tree.c", "tree_validate.c")]
    compiler = [*shlex.split(os.environ.get("CC", "cc")), "-std=c11", "-O1", "-shared", "-fPIC"]
    subprocess.run([*compiler, f"-I{RUNTIME / 'include'}", *sources, "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


class Engine:
    """A tree whose leaf nodes return what `answer(index)` says; `calls` has each call as (node's index, what).

    `ask` gives the value of a script, an entry that is a parameter included.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        tree: Tree,
        answer: Callable[[int], int],
        ask: Callable[[Script], int] = lambda _script: 0,
    ) -> None:
        self.calls: list[tuple[int, str]] = []
        self._answer = answer
        self._library = library
        for index, script in enumerate(tree.scripts):
            script.body = (f"return {index};",)  # not compiled, but told apart
        table = make_table(tree)
        self.nodes = [row.node for row in table.rows]
        self._index = {id(node): index for index, node in enumerate(self.nodes)}
        self._nodes = (_Node * len(table.rows))(
            *(_Node(r.node.type.number, r.asks, r.parent, r.end, r.state, r.leaf, r.parameter) for r in table.rows)
        )
        leaves = [self._leaf(use.nodes) for use in table.leaves]
        if table.script_leaf:
            leaves.append(self._script_leaf(table.scripts, ask))
        self._leaves = (_Leaf * max(1, len(leaves)))(*leaves)
        self._parameters = (ctypes.c_int32 * max(1, len(table.parameters)))(*table.parameters)
        scripts = (_SCRIPT(lambda _application, script=script: ask(script)) for script in table.scripts)
        self._scripts = (_SCRIPT * max(1, len(table.scripts)))(*scripts)
        counts = (len(table.rows), len(leaves), 0, len(table.scripts), len(table.parameters), table.words)
        self._tree = _Tree(self._nodes, self._leaves, None, self._scripts, self._parameters, *counts)
        self._status = (ctypes.c_uint8 * len(table.rows))()
        self._words = (ctypes.c_uint16 * max(1, table.words))()
        self._self = _Instance()
        if library.canopy_tree_validate(ctypes.byref(self._tree), None) != 0:
            raise ValueError("canopy_tree_validate() refuses the tables")
        library.canopy_tree_init(
            ctypes.byref(self._self), ctypes.byref(self._tree), self._status, self._words, ctypes.c_void_p()
        )

    def _leaf(self, uses: list[Node]) -> _Leaf:
        def call(what: str) -> Callable[[int | None, int], int]:
            def run(_application: int | None, parameter: int) -> int:
                index = self._index[id(uses[parameter])]
                self.calls.append((index, what))
                return self._answer(index) if what != "halt" else 0

            return run

        halted = call("halt")
        return _Leaf(_TICK(call("tick")), _TICK(call("running")), _HALTED(lambda a, p: (halted(a, p), None)[1]))

    @staticmethod
    def _script_leaf(scripts: tuple[Script, ...], ask: Callable[[Script], int]) -> _Leaf:
        """The leaf that runs Script and ScriptCondition."""
        return _Leaf(_TICK(lambda _application, number: SUCCESS if ask(scripts[number]) else FAILURE))

    def tick(self, now_us: int = 0) -> int:
        """One tick; `calls` is empty before it."""
        self.calls.clear()
        return int(self._library.canopy_tree_tick(ctypes.byref(self._self), ctypes.c_uint64(now_us)))

    def status(self, index: int) -> int:
        """What the node returned in the last tick that ticked it."""
        kept = self._status[index] & 15  # canopy/status_code.h: the result + 6; RUNNING that was halted has lost 4
        return RUNNING if kept == 3 else max(kept - 6, IDLE)

    def called(self, what: str | None = None) -> list[str]:
        """Names of the leaves called in the last tick, in order; `what`: tick, running or halt only."""
        return [self.nodes[index].name for index, done in self.calls if what in (None, done)]
