# SPDX-License-Identifier: MIT
"""Runs trees in the engine itself: packs them into node tables, and reads what engine_runner prints."""

from __future__ import annotations

import struct
import subprocess
from pathlib import Path

from canopy.compiler.node_types import node_types
from canopy.semantics.spec import IDLE, WAS, Script, Spec
from differential.tree import ENTRIES, OPERATIONS, SCRIPT_LEAVES, SHAPES, USER_LEAVES, Outcome, Result, Tree

_HEADER = struct.Struct("<7H")
_NODE = struct.Struct("<2B5H")
_SCRIPT = struct.Struct("<BBhH")
_ENTRIES = struct.Struct(f"<{len(ENTRIES)}i")
_CALL = struct.Struct("<HB")
NO_HALT = 0xFFFF
# The types of the leaves that the compiler makes of these.
_AS_LEAF = {"Script": "SyncAction", "SetBlackboard": "SyncAction", "ScriptCondition": "Condition"}


def _code(stored: int) -> int:
    """The model's code of a byte as the engine keeps it (canopy/status_code.h). Never ticked is IDLE."""
    was, low = stored & 16, stored & 15
    last = 1 if was and low == 3 else low - 6 if 7 <= low <= 10 else IDLE
    return last + (WAS if was and last != IDLE else 0)


_CODES = bytes(map(_code, range(256)))


class TreeRefusedError(Exception):
    """canopy_tree_validate() refused a tree of the generator."""


class _Packer:
    """The tables of one tree."""

    def __init__(self, tree: Tree) -> None:
        self.types = node_types()
        self.rows = bytearray()
        self.parameters: list[int] = []
        self.answers: list[bytes] = []
        self.scripts: list[bytes] = []
        self.words = 0
        self.count = 0
        self.rows += self._rows(tree.root, 0)
        ticks = len(tree.times)
        halt = NO_HALT if tree.halt_after is None else tree.halt_after
        self.packed = b"".join(
            (
                _HEADER.pack(
                    self.count, len(self.answers), len(self.parameters), len(self.scripts), self.words, ticks, halt
                ),
                self.rows,
                struct.pack(f"<{len(self.parameters)}i", *self.parameters),
                struct.pack(f"<{ticks}Q", *tree.times),
                *self.scripts,
                *self.answers,
            )
        )

    def _rows(self, spec: Spec, parent: int) -> bytes:
        kind = self.types[_AS_LEAF.get(spec.kind, spec.kind)]
        number = self.count
        self.count += 1
        state, leaf, parameter = self.words, 0, 0
        self.words += kind.words
        if spec.kind in USER_LEAVES:
            leaf, parameter = USER_LEAVES.index(spec.kind), len(self.answers)
            self.answers.append(struct.pack("<H", number) + spec.answers)
        elif spec.kind in SCRIPT_LEAVES:
            leaf, parameter = len(USER_LEAVES) + (spec.kind == "ScriptCondition"), self._script(number, spec.scripts[0])
        elif spec.parameters or spec.scripts:
            parameter = len(self.parameters)
            shape = SHAPES[spec.kind]
            values = dict(zip(shape.parameters, spec.parameters, strict=True))
            for name, script in zip(shape.scripts, spec.scripts, strict=True):
                values[name] = self._script(number, script)
            self.parameters += [values.pop(entry.name) for entry in kind.parameters]
            assert not values, f"nodes.def knows no parameter {values} of {spec.kind}"
        below = b"".join(self._rows(child, number) for child in spec.children)
        return _NODE.pack(kind.number, 0, parent, self.count, state, leaf, parameter) + below

    def _script(self, node: int, script: Script | None) -> int:
        """Its number; -1 for none."""
        if script is None:
            return -1
        self.scripts.append(_SCRIPT.pack(OPERATIONS.index(script.operation), script.entry, script.value, node))
        return len(self.scripts) - 1


def _read(output: bytes, offset: int, tree: Tree) -> tuple[Result, int]:
    """One tree's result, and where the next one begins."""
    error, bad_node, nodes = struct.unpack_from("<bHH", output, offset)
    offset += 5
    if error:
        raise TreeRefusedError(f"canopy_tree_validate() returned {error} for node {bad_node} of\n{tree.text()}")
    outcomes = []
    for number in range(len(tree.times) + (tree.halt_after is not None)):
        status, calls = struct.unpack_from("<BH", output, offset)
        offset += 3
        end = offset + 3 * calls
        log = list(_CALL.iter_unpack(output[offset:end]))
        is_halt = tree.halt_after == number
        codes = output[end : end + nodes].translate(_CODES)
        entries = _ENTRIES.unpack_from(output, end + nodes)
        outcomes.append(Outcome(None if is_halt else status, log, codes, entries))
        offset = end + nodes + _ENTRIES.size
    faults, fault_node = struct.unpack_from("<IH", output, offset)
    return Result(outcomes, faults, fault_node), offset + 6


def run_engine(runner: Path, trees: list[Tree]) -> list[Result]:
    """Runs trees in the engine.

    Raises:
        TreeRefusedError: the engine's validator refused one.
        RuntimeError: the runner failed.
    """
    packed = b"".join(_Packer(tree).packed for tree in trees)
    process = subprocess.run([runner], input=packed, capture_output=True, timeout=600)
    if process.returncode != 0:
        raise RuntimeError(f"{runner} ended with {process.returncode}: {process.stderr.decode(errors='replace')}")
    results, offset = [], 0
    for tree in trees:
        result, offset = _read(process.stdout, offset, tree)
        results.append(result)
    if offset != len(process.stdout):
        raise RuntimeError(f"{runner} wrote {len(process.stdout)} bytes, {offset} were expected")
    return results
