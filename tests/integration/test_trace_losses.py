# SPDX-License-Identifier: MIT
"""The trace decoder with frames that are lost, or too many: what it shows as certain is so."""

from __future__ import annotations

import os
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canopy.model import Model
from canopy.trace import NodeState, TraceDecoder, TreeView
from integration.test_trace import SIZES, UNKNOWN, codes_of, feed
from integration.trace_source import IDS, SLOTS, Frame, TraceSource, bits, models_by_size

TICKS = int(os.environ.get("CANOPY_TRACE_TICKS", "20000"))
"""For each share of losses; `make test-trace` takes more."""


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Model]:
    return models_by_size(tmp_path_factory.mktemp("models"), SIZES)


class Truth:
    """A controller that does what chance says, and what its nodes and slots were after each tick since its start."""

    def __init__(self, nodes: int, seed: int, slots: int = SLOTS) -> None:
        self.random = random.Random(seed)
        self.source = TraceSource(nodes, slots, changes_max=self.random.choice((1, 2, 8)))
        self.codes: list[list[int]] = []
        self.slots: list[list[int]] = []
        self._flips = self.random.sample(range(nodes), min(nodes, self.random.choice((0, 1, 16))))
        self._rate = self.random.choice((0.0, 0.01, 0.1, 0.9))

    def tick(self) -> list[Frame]:
        """The frames of the next tick. Some nodes change in every tick, some now and then, all at once now and then."""
        chance, nodes = self.random, self.source.nodes
        codes = list(self.codes[-1]) if self.codes else [0] * nodes
        slots = list(self.slots[-1]) if self.slots else [0] * self.source.slots
        for node in self._flips:
            codes[node] = 1 + codes[node] % 3
        if chance.random() < 0.02:
            self._rate = chance.choice((0.0, 0.0, 0.01, 0.1, 0.9))
        if self._rate:
            for _ in range(chance.randint(0, max(1, int(nodes * self._rate)))):
                codes[chance.randrange(nodes)] = chance.randint(0, 14)
            for _ in range(chance.randint(0, 3) if slots else 0):
                slots[chance.randrange(len(slots))] = chance.getrandbits(32)
        self.codes.append(codes)
        self.slots.append(slots)
        return self.source.frames(codes, values=slots)

    def check(self, view: TreeView) -> None:
        """Nothing that is shown as certain is wrong: neither the code, nor since when it is so, nor a value."""
        codes = self.codes[view.tick]
        for node, state in enumerate(view.nodes):
            if not state.certain:
                assert state.since is None
                continue
            assert state.code == codes[node], (view.tick, node)
            assert state.since is not None
            assert all(
                self.codes[tick][node] == state.code for tick in range(max(state.since, view.tick - 20), view.tick)
            )
            assert self.codes[state.since][node] == state.code
            before = self.codes[state.since - 1][node] if state.since else 0
            assert not state.exact or before != state.code or (state.since == 0 and state.code == 0), (view.tick, node)
        slots = self.slots[view.tick]
        for value in view.values:
            if value.certain:
                low, *high = slots[value.value.slot : value.value.slot + value.value.slots]
                assert value.known == low + (high[0] << 32 if high else 0)


@pytest.mark.parametrize("nodes", [4, 35, 150])
@pytest.mark.parametrize("seed", range(4))
def test_without_losses_all_is_known_but_what_waits(models: dict[int, Model], nodes: int, seed: int) -> None:
    truth, decoder = Truth(nodes, seed), TraceDecoder(models[nodes])
    for number in range(300):
        frames = truth.tick()
        (view,) = feed(decoder, frames)
        assert (view.tick, view.complete, view.lost, view.refused) == (number, True, 0, 0)
        truth.check(view)
        waiting = {node for node, code in enumerate(truth.codes[-1]) if truth.source.told[node] != code}
        uncertain = {node for node, state in enumerate(view.nodes) if not state.certain}
        assert waiting <= uncertain
        assert waiting or not uncertain
        assert all(state.code != UNKNOWN for state in view.nodes)


@pytest.mark.parametrize("share", [0.01, 0.1, 0.5])
@pytest.mark.parametrize("nodes", [1, 11, 35])
def test_with_losses_nothing_wrong_is_certain(models: dict[int, Model], share: float, nodes: int) -> None:
    """Single frames are lost, and now and then all of a tick. The controller is started again at times."""
    chance, shown = random.Random(nodes), 0
    truth, decoder = Truth(nodes, nodes, slots=SLOTS if nodes > 1 else 0), TraceDecoder(models[nodes])
    for number in range(TICKS // 3):
        gone = chance.random() < share / 10
        for frame in truth.tick():
            if not gone and chance.random() >= share:
                for view in decoder.feed(*frame):
                    truth.check(view)
                    shown += sum(state.certain for state in view.nodes)
        if number % 500 == 499:
            for view in decoder.flush():
                truth.check(view)
            truth = Truth(nodes, number, slots=SLOTS if nodes > 1 else 0)
            feed(decoder, [])
            for frame in truth.tick():  # a start that nobody misses: see Limits in docs/trace.md
                for view in decoder.feed(*frame):
                    truth.check(view)
    assert decoder.restarts == TICKS // 3 // 500
    assert decoder.refused == 0
    assert shown > TICKS // 3 * nodes * {0.01: 0.5, 0.1: 0.05, 0.5: 0.0005}[share]


@pytest.mark.parametrize("nodes", SIZES)
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_after_its_last_loss_all_is_known_again_in_time(models: dict[int, Model], nodes: int, share: float) -> None:
    chance = random.Random(7)
    source, decoder = TraceSource(nodes), TraceDecoder(models[nodes])
    truth = [0] * nodes
    for _ in range(30):
        for number in range(40):
            truth[number % nodes] = chance.randint(0, 14)
            for frame in source.frames(truth):
                if chance.random() >= share:
                    decoder.feed(*frame)
        ticks = 2 * -(-nodes // 10)  # one snapshot around, one in two ticks
        views = [view for _ in range(ticks + 1) for view in feed(decoder, source.frames(truth))]
        assert codes_of(views[-1]) == truth
        assert views[-1].complete


def test_a_tick_without_its_changes_is_incomplete(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4, snapshot_every=1), TraceDecoder(models[4])
    feed(decoder, source.frames([1, 3, 1, 0]))
    source.snapshot_every = 100
    tick, inputs, _ = source.frames([2, 2, 9, 0])  # the CanopyChange is lost
    assert feed(decoder, [tick, inputs]) == []
    source.snapshot_every = 1
    views = feed(decoder, source.frames([2, 2, 9, 0]))
    assert [(view.complete, view.lost) for view in views] == [(False, 0), (True, 1)]
    assert codes_of(views[0]) == [UNKNOWN] * 4
    assert codes_of(views[1]) == [2, 2, 9, 0]


def test_between_two_changes_of_a_tick_only_what_lies_there_is_forgotten(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(150, snapshot_every=1000), TraceDecoder(models[150])
    codes = [1] * 150
    for _ in range(60):
        feed(decoder, source.frames(codes))
    for node in (5, 6, 7, 8, 9, 60, 61, 62, 63, 64, 100):
        codes[node] = 2
    frames = source.frames(codes)
    assert [identifier for identifier, _ in frames[2:]] == [IDS["CanopyChange"]] * 3
    (view,) = feed(decoder, frames[:3] + frames[4:])
    assert codes_of(view) == [UNKNOWN] * 5 + [2] * 5 + [UNKNOWN] * 90 + [2] + [UNKNOWN] * 49
    assert [node.code for node in view.nodes] == codes[:10] + [UNKNOWN] * 90 + codes[100:]
    assert not view.complete
    assert view.nodes[9] == NodeState(2, True, 60, True)
    (view,) = feed(decoder, source.frames(codes))
    assert codes_of(view) == codes[:10] + [UNKNOWN] * 90 + codes[100:]
    assert view.nodes[9] == NodeState(2, True, 60, True)
    assert view.nodes[4] == NodeState(1, True, 61, False)


def test_a_frame_of_another_tick_is_not_taken_for_this_ticks(models: dict[int, Model]) -> None:
    for later in (1, 2, 8, 15, 16, 17):
        source, decoder = TraceSource(10), TraceDecoder(models[10])
        codes = [1, 1, 1, 1, 1, 1, 1, 0, 0, 0]
        feed(decoder, source.frames([0] * 10))
        tick, inputs, *_ = source.frames(codes)
        assert feed(decoder, [tick, inputs]) == []
        for number in range(later):
            codes = [2 + number % 2] * 10
            last = source.frames(codes)[-1]
        (view,) = feed(decoder, [last])
        assert view.tick == 1
        assert codes_of(view) == [UNKNOWN] * 10


def test_a_snapshot_of_another_tick_is_not_taken_for_this_ticks(models: dict[int, Model]) -> None:
    """Neither one whose number fits modulo 8, nor one whose sequence fits modulo 64."""
    for later, skipped in ((8, 0), (2, 64 - 2), (3, 64 - 4)):
        source, decoder = TraceSource(10, snapshot_every=1), TraceDecoder(models[10])
        feed(decoder, source.frames([0] * 10))
        tick, inputs, *_ = source.frames([0] * 10)
        assert feed(decoder, [tick, inputs]) == []
        source.told = codes = [3] * 10  # no CanopyChange
        for _ in range(later - 1):
            source.frames(codes)
        source.sequence = (source.sequence + skipped) % 64
        last = source.frames(codes)[-1]
        (view,) = feed(decoder, [last])
        assert view.tick == 1
        assert codes_of(view) == [UNKNOWN] * 10


def test_a_change_that_breaks_the_order_is_refused(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(150, snapshot_every=1000), TraceDecoder(models[150])
    codes = [0] * 150
    feed(decoder, source.frames(codes))
    for nodes in ((40, 50), (30, 50), (20, 150)):  # begins at 100, goes around, and ends behind its beginning
        source._next_node = 100
        codes = [
            3 - code if 100 <= node < 120 or nodes[0] <= node < nodes[1] else code for node, code in enumerate(codes)
        ]
        frames = source.frames(codes)
        (view,) = feed(decoder, frames)
        assert view.complete
    source._next_node = 100
    tick, inputs, first, *_ = source.frames([1 if node % 30 == 20 else codes[node] for node in range(150)])
    again = bytes([first[1][0] + 1 & 63 | first[1][0] & 0xC0]) + first[1][1:]
    assert feed(decoder, [tick, inputs, first, (first[0], again)]) == []
    assert decoder.refused == 1


def test_a_frame_that_was_not_announced_makes_all_unknown(models: dict[int, Model]) -> None:
    signals = {
        "CanopyChange": {"More": 1, "Tick": 1, "Entry1": 0xFF},
        "CanopySnapshot": {"Tick": 1, **{f"Status{place}": 15 for place in range(4, 10)}},
        "CanopyValue": {"Tick": 1, "Slot": 1},
    }
    for kind, told in signals.items():
        source, decoder = TraceSource(4, SLOTS, snapshot_every=100), TraceDecoder(models[4])
        feed(decoder, source.frames([0] * 4))
        feed(decoder, source.frames([1] * 4))
        number = {} if kind == "CanopyValue" else {"Sequence": source.sequence}
        frame = bits(kind, **number, **told)
        assert decoder.feed(IDS[kind], frame) == ()
        source.sequence += len(number)
        (view,) = feed(decoder, source.frames([1] * 4))
        assert (codes_of(view), view.refused) == ([UNKNOWN] * 4, 0)


@settings(max_examples=200)
@given(seed=st.integers(0, 2**32), changed=st.integers(0, 2**64 - 1), kind=st.sampled_from(sorted(IDS)))
def test_a_frame_too_many_leads_to_nothing_that_stays_wrong(
    models: dict[int, Model], seed: int, changed: int, kind: str
) -> None:
    """Somebody else sends one: it may be believed, but two times around the tree later all is right."""
    truth, decoder = Truth(35, seed), TraceDecoder(models[35])
    for _ in range(5):
        feed(decoder, truth.tick())
    decoder.feed(IDS[kind], changed.to_bytes(8, "little"))
    codes, slots = truth.codes[-1], truth.slots[-1]
    views = [view for _ in range(40) for view in feed(decoder, truth.source.frames(codes, values=slots))]
    assert codes_of(views[-1]) == codes
