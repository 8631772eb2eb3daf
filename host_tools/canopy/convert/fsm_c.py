# SPDX-License-Identifier: MIT
"""A state machine of leaves as C11, and that C compiled and ticked: what was written is what is checked."""

from __future__ import annotations

import ctypes
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.names import snake
from canopy.convert.equivalence import Answers, Shown, State
from canopy.convert.to_fsm import Jump, Machine, Vertex
from canopy.escape.c import in_code, in_comment
from canopy.files import read_bytes
from canopy.semantics.spec import CONTINUE, FAILURE, HALTED, RUNNING, START, SUCCESS

_HEADER = """\
/* Made by `canopy convert to-fsm` from the tree {tree}. Change the tree, not this. */
/**
 * @file
 * The tree as a state machine: each leaf is a state; what it returns says which leaf is ticked next in the same tick,
 * or what the whole returns. No memory but which leaf is RUNNING; no allocation, no recursion.
 *
 *     static {name}_fsm_t machine = {upper}_FSM_BEGIN;
 *     status = {name}_fsm_tick(&machine, &calls, context);
 */
#ifndef {upper}_FSM_H
#define {upper}_FSM_H

#include <stdbool.h>
#include <stdint.h>

/** The numbers of canopy_status_t. */
typedef enum {{ {upper}_RUNNING = 1, {upper}_SUCCESS = 2, {upper}_FAILURE = 3 }} {name}_fsm_status_t;

typedef enum {{
{leaves}
    {upper}_NONE = {count}
}} {name}_fsm_leaf_t;

/** Your leaves. `tick`: `first` is false if the leaf was RUNNING. `halt`: a RUNNING leaf is abandoned. */
typedef struct {{
    {name}_fsm_status_t (*tick)(void *context, {name}_fsm_leaf_t leaf, bool first);
    void (*halt)(void *context, {name}_fsm_leaf_t leaf);
}} {name}_fsm_calls_t;

/** The machine between two ticks. */
typedef struct {{
    {name}_fsm_leaf_t running;
}} {name}_fsm_t;

#define {upper}_FSM_BEGIN {{{upper}_NONE}}

/** What follows an answer: halt what is RUNNING from `halt_first` to before `halt_end`, then tick `next`. */
typedef struct {{
    uint16_t halt_first;
    uint16_t halt_end;
    uint16_t next;   /**< {upper}_NONE: the tick is done, with `status`. */
    uint16_t status; /**< {name}_fsm_status_t */
}} {name}_fsm_jump_t;

/** One tick. A wrong answer, such as RUNNING of a condition, counts as FAILURE. @return what the tree returns. */
static inline {name}_fsm_status_t
{name}_fsm_tick({name}_fsm_t *self, const {name}_fsm_calls_t *calls, void *context)
{{
    static const {name}_fsm_jump_t begin = {begin};
    static const {name}_fsm_jump_t jumps[{count}][3] = {{ /* RUNNING, SUCCESS, FAILURE */
{jumps}
    }};
    const {name}_fsm_jump_t *jump = &begin;
    {name}_fsm_leaf_t running = self->running;
    {name}_fsm_leaf_t started = {upper}_NONE;

    for (;;) {{
        if (jump->halt_first <= (uint16_t)running && (uint16_t)running < jump->halt_end) {{
            calls->halt(context, running);
            running = {upper}_NONE;
        }}
        if (jump->next == (uint16_t){upper}_NONE) {{
            break;
        }}
        {name}_fsm_leaf_t leaf = ({name}_fsm_leaf_t)jump->next;
        bool first = running != leaf;
        unsigned answer = (unsigned)calls->tick(context, leaf, first);

        if (!first) {{
            running = {upper}_NONE;
        }}
        if (answer < 1u || answer > 3u || jumps[leaf][answer - 1u].status == 0u) {{
            answer = (unsigned){upper}_FAILURE;
        }}
        if (answer == (unsigned){upper}_RUNNING) {{
            started = leaf;
        }}
        jump = &jumps[leaf][answer - 1u];
    }}
    self->running = started != {upper}_NONE ? started : running;
    return ({name}_fsm_status_t)jump->status;
}}

#endif
"""

_HARNESS = """\
#include "{name}_fsm.h"
unsigned check_tick(unsigned *running, const {name}_fsm_calls_t *calls);
unsigned check_tick(unsigned *running, const {name}_fsm_calls_t *calls)
{{
    {name}_fsm_t machine = {{({name}_fsm_leaf_t)*running}};
    unsigned status = (unsigned){name}_fsm_tick(&machine, calls, (void *)0);
    *running = (unsigned)machine.running;
    return status;
}}
"""
_TICK = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p, ctypes.c_uint, ctypes.c_bool)
_HALT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint)


class _Calls(ctypes.Structure):
    _fields_ = (("tick", _TICK), ("halt", _HALT))


def _jump(jump: Jump | None, count: int) -> str:
    """A jump's initialiser; all zero: the leaf cannot give this answer."""
    if jump is None:
        return "{0, 0, 0, 0}"
    status = RUNNING if jump.target is not None else jump.status  # not 0: that says that there is no such jump
    return f"{{{jump.halts[0]}, {jump.halts[1]}, {count if jump.target is None else jump.target}, {status}}}"


def write_c(machine: Machine) -> str:
    """One header, which needs nothing else."""
    name, count = snake(machine.name), len(machine.vertices)
    upper = name.upper()
    if count == 0:
        raise CompileError(Place(machine.name), "the tree has no user-defined leaf: there is nothing to make C of")
    leaves = [f"    {upper}_LEAF_{snake(vertex.id).upper()} = {i}," for i, vertex in enumerate(machine.vertices)]
    rows = []
    for vertex in machine.vertices:
        cells = ", ".join(_jump(vertex.jumps.get(status), count) for status in (RUNNING, SUCCESS, FAILURE))
        rows.append(f"        {{{cells}}}, /* {in_comment(vertex.name)} */")
    return _HEADER.format(
        tree=in_comment(machine.name), name=in_code(name), upper=in_code(upper), count=count, leaves="\n".join(leaves),
        jumps="\n".join(rows), begin=_jump(machine.begin, count),
    )  # fmt: skip


class CompiledMachine:
    """The written C, compiled with $CC (cc) and ticked in this process. Its state: which leaf is RUNNING."""

    def __init__(self, path: Path, name: str, vertices: list[Vertex]) -> None:
        self._vertices = vertices
        self._answers: Answers
        self._log: list[tuple[object, int]] = []
        compiler = shlex.split(os.environ.get("CC", "cc"))
        if shutil.which(compiler[0]) is None:
            raise CompileError(
                Place(str(path)),
                f"the C cannot be checked: there is no C compiler '{compiler[0]}'",
                "to fix: install one, or name it in CC; or take --unchecked",
            )
        # Not kept open: a loaded library stays mapped when its file is gone.
        with tempfile.TemporaryDirectory(prefix="canopy-") as folder:
            copy = Path(folder) / f"{snake(name)}_fsm.h"
            copy.write_bytes(read_bytes(path))
            source, library = Path(folder) / "check.c", Path(folder) / "check.so"
            source.write_bytes(_HARNESS.format(name=in_code(snake(name))).encode())
            options = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC"]
            built = subprocess.run(
                [*compiler, *options, str(source), "-o", str(library)], capture_output=True, text=True, timeout=300
            )
            if built.returncode != 0:
                raise CompileError(Place(str(path)), f"the written C does not compile:\n{built.stderr}")
            self._library = ctypes.CDLL(str(library))
        self._calls = _Calls(_TICK(self._tick), _HALT(self._halt))

    def _tick(self, _context: int | None, leaf: int, first: bool) -> int:
        vertex = self._vertices[leaf]
        if vertex.is_action:
            self._log.append((vertex.key, START if first else CONTINUE))
        return self._answers.ask(vertex.key, vertex.statuses)

    def _halt(self, _context: int | None, leaf: int) -> None:
        self._log.append((self._vertices[leaf].key, HALTED))

    def start(self) -> State:
        """No leaf is RUNNING."""
        return len(self._vertices)

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """One tick."""
        assert isinstance(state, int)
        running = ctypes.c_uint(state)
        self._answers = answers
        self._log = []
        status = self._library.check_tick(ctypes.byref(running), ctypes.byref(self._calls))
        assert status in (RUNNING, SUCCESS, FAILURE)
        return running.value, (status, tuple(self._log))
