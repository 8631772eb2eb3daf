# SPDX-License-Identifier: MIT
"""Two decoders of the trace that were written apart, from docs/trace.md: what do they say of the same frames?

tests/trace/trial.c runs random trees in the engine, loses frames, judges what its own decoder (C) shows against the
truth, and writes the frames down with what was shown. canopy.trace.TraceDecoder has to show the same of every node and
slot in every tick: what is certain and since when, what is old, and what is not known.
"""

from __future__ import annotations

import os
import subprocess
from collections import deque
from fractions import Fraction
from pathlib import Path

import pytest

from canopy.live.codes import NOTHING_KNOWN, NodeState
from canopy.live.trace_model import Trace, TraceValue
from canopy.model import Model, Node
from canopy.trace import TraceDecoder, TreeView

TICKS = int(os.environ.get("CANOPY_TRACE_TICKS", "30000"))
SEED = int(os.environ.get("CANOPY_SEED", "20261130"))
BASE = 0x600
TICK_NUMBERS = 1 << 32

SlotState = tuple[int | None, bool]
"""What is known of a slot, and whether it is certain."""


def a_model(digest: str, nodes: int, slots: int, changes_max: int, guard: int) -> Model:
    """Of a controller in the trial: as much of it as the decoder asks for."""
    values = tuple(
        TraceValue("entry", f"entry{slot}", "", None, "uint32_t", slot, Fraction(1), "", {}) for slot in range(slots)
    )
    trace = Trace(BASE, False, None if guard < 0 else guard, 4, changes_max, 0, values, ())
    return Model(
        path=Path("trial.model.json"),
        application="trial",
        hash=digest.lower(),
        period_us=10_000,
        tree_id="Trial",
        nodes=tuple(Node(index, 0, index + 1, "Condition", "leaf", "Node", 1) for index in range(nodes)),
        dbc=Path("trial.dbc"),
        bus_node="Controller",
        receive=(),
        send=(),
        dbc_hash=None,
        trace=trace,
    )


class Shown:
    """What the decoder in C shows, tick by tick."""

    def __init__(self, model: Model) -> None:
        self.nodes: list[NodeState] = [NOTHING_KNOWN] * len(model.nodes)
        self.slots: list[SlotState] = [(None, False)] * len(model.trace.values)

    def change(self, tick: int, changes: list[str]) -> None:
        """Takes what has changed since the tick before; `tick` does not wrap, numbers in the changes do."""
        for change in changes:
            place, _, what = change.partition("=")
            numbers = [int(number) for number in what.split(",")] if what else []
            is_certain = len(numbers) > 1
            if place[0] == "v":
                self.slots[int(place[1:])] = (numbers[0], is_certain) if numbers else (None, False)
            elif is_certain:
                since = tick - (tick - numbers[1]) % TICK_NUMBERS
                self.nodes[int(place)] = NodeState(numbers[0], True, since, bool(numbers[2]))
            else:
                self.nodes[int(place)] = NodeState(numbers[0], False, None, False) if numbers else NOTHING_KNOWN


class Comparison:
    """Feeds the frames of a trial's log to the decoder in Python, and compares tick by tick.

    One decoder may wait a frame longer than the other one for CanopyInputs; what they show then has to be the same.
    """

    def __init__(self) -> None:
        self.ticks = 0
        self.certain = 0
        self.receivers = 0
        self._decoder: TraceDecoder | None = None
        self._shown: Shown | None = None
        self._views: deque[TreeView] = deque()
        self._others: deque[tuple[int, list[str]]] = deque()

    def take(self, line: str) -> None:
        """One line of the log."""
        kind, *words = line.split()
        if kind == "M":
            model = a_model(words[0], *(int(word) for word in words[1:]))
            self._decoder, self._shown = TraceDecoder(model), Shown(model)
            return
        assert self._decoder is not None
        if kind == "T":
            self._others.append((int(words[0]), words[1:]))
        elif kind == "F":
            self._views += self._decoder.feed(BASE + int(words[0]), bytes.fromhex(words[1]))
        elif kind == "S":
            self._views += self._decoder.flush()
        while self._views and self._others:
            self._compare(self._views.popleft(), *self._others.popleft())
        if kind == "E":
            assert not self._views and not self._others
            assert self._decoder.mismatch is None
            assert self._decoder.refused == int(words[0])
            self.receivers += 1

    def _compare(self, view: TreeView, number: int, changes: list[str]) -> None:
        assert self._shown is not None
        assert view.tick % TICK_NUMBERS == number
        self._shown.change(view.tick, changes)
        for node, (mine, other) in enumerate(zip(view.nodes, self._shown.nodes, strict=True)):
            assert mine == other, f"tick {number}, node {node}"
        slots = [(state.known, state.certain) for state in view.values]
        assert slots == self._shown.slots, f"tick {number}"
        self.ticks += 1
        self.certain += sum(node.certain for node in view.nodes)


def run(program: Path, ticks: int, seed: int) -> Comparison:
    comparison = Comparison()
    with subprocess.Popen([program, str(ticks), str(seed), "log"], stdout=subprocess.PIPE, text=True) as trial:
        assert trial.stdout is not None
        for line in trial.stdout:
            comparison.take(line)
    assert trial.returncode == 0
    return comparison


@pytest.mark.timeout(60 + TICKS // 200)
def test_both_show_the_same(build_dir: Path) -> None:
    comparison = run(build_dir / "tests" / "trace" / "trace_trial", TICKS, SEED)
    print(f"seed {SEED}: {comparison.ticks} ticks, {comparison.certain} certain codes, the same in both decoders")
    assert comparison.ticks > TICKS // 2
    assert comparison.certain > TICKS
