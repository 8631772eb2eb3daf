# SPDX-License-Identifier: MIT
"""The trace decoder against frames that were written from docs/trace.md alone, with losses, restarts and garbage."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canopy.model import Model, load_model
from canopy.trace import BusState, Health, NodeState, Status, TraceDecoder, TreeView
from integration.trace_source import IDS, NUMBERS, SLOTS, TEXTS, VALUES, Frame, TraceSource, bits, write_model

SIZES = (1, 4, 10, 11, 35, 150)
UNKNOWN = -1
TICKS = int(os.environ.get("CANOPY_TRACE_TICKS", "20000"))
"""For each share of losses; `make test-trace` takes more."""


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Model]:
    made = {}
    for nodes in SIZES:
        folder = tmp_path_factory.mktemp("model")
        made[nodes] = load_model(write_model(folder, nodes, values=NUMBERS if nodes > 1 else []))
    return made


def feed(decoder: TraceDecoder, frames: list[Frame]) -> list[TreeView]:
    return [view for frame in frames for view in decoder.feed(*frame)]


def codes_of(view: TreeView) -> list[int]:
    """The certain ones."""
    return [node.code if node.certain else UNKNOWN for node in view.nodes]


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


def test_a_monitor_that_joins_late_knows_what_it_does_not_know(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(35), TraceDecoder(models[35])
    codes = [1] * 35
    source.frames(codes)
    codes[30] = 2
    (view,) = feed(decoder, source.frames(codes))
    assert codes_of(view) == [UNKNOWN] * 30 + [2] + [UNKNOWN] * 4
    assert view.nodes[30] == NodeState(2, True, 1, False)  # since then, or before: nobody has seen what was before
    (view,) = feed(decoder, source.frames(codes))
    assert codes_of(view) == [UNKNOWN] * 10 + [1] * 10 + [UNKNOWN] * 10 + [2] + [UNKNOWN] * 4
    assert view.nodes[10] == NodeState(1, True, 2, False)


def test_from_its_first_tick_on_all_is_known(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(35), TraceDecoder(models[35])
    codes = [0] * 35
    (view,) = feed(decoder, source.frames(codes))
    assert view.nodes == (NodeState(0, True, 0, True),) * 35
    codes[20] = 1
    (view,) = feed(decoder, source.frames(codes))
    assert view.nodes[20] == NodeState(1, True, 1, True)
    assert view.nodes[20].status is Status.RUNNING
    (view,) = feed(decoder, source.frames(codes))
    codes[20] = 12
    (view,) = feed(decoder, source.frames(codes))
    assert view.nodes[20] == NodeState(12, True, 3, True)
    assert (view.nodes[20].status, view.nodes[20].text) == (Status.IDLE, "IDLE (halted)")


def test_sixteen_nodes_that_flip_in_every_tick_hide_no_other(models: dict[int, Model]) -> None:
    """What waits is not certain meanwhile, and told in turn."""
    source, decoder = TraceSource(150, changes_max=3), TraceDecoder(models[150])
    codes = [0] * 150
    feed(decoder, source.frames(codes))
    for number in range(60):
        codes[:16] = [1 + number % 2] * 16
        codes[149] = 2 if number >= 30 else 0
        (view,) = feed(decoder, source.frames(codes))
        assert all(code in (UNKNOWN, truth) for code, truth in zip(codes_of(view), codes, strict=True))
        if number >= 32:
            assert view.nodes[149].certain or view.nodes[149].code == 2
    assert view.nodes[149].code == 2
    waited = [state for state in view.nodes if state.certain and state.since and not state.exact]
    assert waited  # "since then or before", for it was not certain in the tick before


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


def test_nodes_that_waited_and_went_back_are_certain_again(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(35, snapshot_every=1000, changes_max=1), TraceDecoder(models[35])
    feed(decoder, source.frames([0] * 35))
    (view,) = feed(decoder, source.frames([1] * 35))
    assert codes_of(view) == [1] * 5 + [UNKNOWN] * 30
    (view,) = feed(decoder, source.frames([1] * 5 + [0] * 30))
    assert codes_of(view) == [1] * 5 + [0] * 30
    assert view.nodes[5] == NodeState(0, True, 2, False)


def test_a_lost_tick_frame_is_a_missed_tick(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    feed(decoder, source.frames([1, 3, 1, 0]))
    assert feed(decoder, source.frames([1, 3, 2, 0])[1:]) == []
    (view,) = feed(decoder, source.frames([1, 3, 2, 0]))
    assert (view.tick, view.lost, view.ticks_missed, view.complete) == (2, 1, 1, True)
    assert codes_of(view) == [1, 3, 2, 0]


def test_silence_gives_up_the_tick_at_hand(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    assert decoder.flush() == ()
    feed(decoder, source.frames([1, 3, 1, 0])[:1])
    (view,) = decoder.flush()
    assert (view.tick, view.complete, codes_of(view)) == (0, False, [UNKNOWN] * 4)
    assert decoder.flush() == ()


@given(before=st.integers(0, 300), missing=st.integers(0, 2))
def test_a_restart_is_no_loss(models: dict[int, Model], before: int, missing: int) -> None:
    decoder = TraceDecoder(models[4])
    old = TraceSource(4)
    for _ in range(before + 1):
        feed(decoder, old.frames([1, 3, 1, 0], overruns=5))
    new = TraceSource(4, snapshot_every=1)
    views = feed(decoder, [frame for _ in range(3) for frame in new.frames([0, 0, 0, 0], root=2)][missing:])
    # Joined late, a new run looks like the old one's next ticks when that was as young.
    if missing == 0 or before > 1:
        assert decoder.restarts == 1
        assert decoder.lost == 0
        assert views[-1].overruns == 0
    assert codes_of(views[-1]) == [0, 0, 0, 0]
    assert views[-1].tick == 2


def test_a_restart_forgets_what_was_known(models: dict[int, Model]) -> None:
    decoder = TraceDecoder(models[35])
    old, new = TraceSource(35), TraceSource(35)
    for _ in range(4):
        feed(decoder, [*old.frames([1] * 35), old.health(4, 3)])
    (view,) = feed(decoder, new.frames([0] * 35))
    assert codes_of(view) == [0] * 35
    assert view.health == Health()
    for _ in range(4):
        feed(decoder, old.frames([1] * 35))
    new.tick = 3
    (view,) = feed(decoder, new.frames([2] + [0] * 34))
    assert codes_of(view) == [2] + [UNKNOWN] * 34
    assert view.restarts == 2


def test_the_tick_number_and_the_overruns_do_not_wrap(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(1, tick=2**32 - 2), TraceDecoder(models[1])
    views = [feed(decoder, source.frames([1], overruns=3 * number))[0] for number in range(6)]
    assert [view.tick for view in views] == [2**32 - 2 + number for number in range(6)]
    assert [view.overruns for view in views] == [3 * number for number in range(6)]
    assert views[-1].restarts == 0
    assert codes_of(views[-1]) == [1]
    feed(decoder, [source.health(2, 101)])
    (view,) = feed(decoder, source.frames([1], overruns=102))
    assert view.overruns == 102


def test_a_long_outage_counts_at_least_one_frame_for_each_tick(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(35, snapshot_every=1), TraceDecoder(models[35])
    for _ in range(4):
        feed(decoder, source.frames([1] * 35))
    for _ in range(1024):  # 2048 frames: the sequence looks as if nothing was lost
        source.frames([1] * 35)
    (view,) = feed(decoder, source.frames([1] * 35))
    assert view.ticks_missed == 1024
    assert view.lost >= 1024
    assert codes_of(view).count(UNKNOWN) == 25


def test_health_is_taken_over_page_by_page(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(1), TraceDecoder(models[1])
    feed(decoder, [source.health(0, 65535, 2, 3, last=4)])
    feed(decoder, [source.health(1, 5, 6, 7, last=8)])
    (view,) = feed(decoder, source.frames([1]))
    assert view.health == Health(65535, 2, False, 3, 4, 5, 6, 7, 8)
    feed(decoder, [source.health(2, 9, 0x1234, 0xAB56, last=0xCD), source.health(4, 10, 11, 12)])
    feed(decoder, [source.health(3, 0x21, 0, 0xF000, last=13), source.health(0, 1, 0, 3, filtered=True)])
    (view,) = feed(decoder, source.frames([1]))
    health = view.health
    assert (health.rx_rejected, health.rx_unknown, health.rx_filtered, health.rx_backlogs) == (1, None, True, 0)
    assert (health.overruns, health.longest_cycle_us, health.latest_start_us) == (9, 0x561234, 10 * 0xCDAB)
    assert (health.lateness, health.slips) == ((1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 15), 13)
    assert (health.leaf_faults, health.rx_errors, health.timeouts) == (10, 11, 12)


def test_the_state_of_the_bus_is_told_in_each_tick(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(1), TraceDecoder(models[1])
    told = []
    for state in range(7):
        (view,) = feed(decoder, source.frames([1], CanState=state, Overload=state % 2, Returning=state // 4))
        assert view.bus == BusState(state, bool(state % 2), state >= 4)
        assert view.bus.is_good == (state == 0)
        told.append(view.bus.text())
    assert told[0] == "error-active"
    assert told[3:5] == ["blocked, overload", "bus-off, sends safe values"]


def test_values_have_types_units_and_names(tmp_path: Path) -> None:
    source, decoder = TraceSource(4, SLOTS), TraceDecoder(load_model(write_model(tmp_path, values=VALUES, texts=TEXTS)))
    slots = [2**32 - 5, 1, 2, 2**32 - 215, 1, 2, 0, 0x3FF80000, 0x7FC00000, 1]
    views: list[TreeView] = []
    for _ in range(SLOTS):
        views = feed(decoder, source.frames([0] * 4, values=slots))
    assert [(value.known, value.text) for value in views[-1].values] == [
        (-5, "-5"),
        (2**33 + 1, f"{2**33 + 1} mm"),
        (-21.5, "-21.5 °C"),
        ("dark", "dark"),
        ("right", "right"),
        (1.5, "1.5"),
        ("nan", "nan"),
        (True, "true"),
    ]
    assert all(value.certain for value in views[-1].values)
    assert [value.value.title for value in views[-1].values][:2] == ["count", "arm/far"]
    (view,) = feed(decoder, source.frames([0] * 4, values=[*slots[:4], 7, 99, *slots[6:]]))
    assert [view.values[place].known for place in (3, 4)] == [7, "text 99"]


def test_values_that_wait_are_not_certain(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4, SLOTS, values_every=1000), TraceDecoder(models[4])
    feed(decoder, source.frames([0] * 4))
    (view,) = feed(decoder, source.frames([0] * 4, values=[7, 8, 9, 10] + [0] * 6))
    assert [(one.known, one.certain) for one in view.values][:4] == [(7, True), (8, True), (0, False), (0, False)]
    assert view.values[2].text == "0?"
    (view,) = feed(decoder, source.frames([0] * 4, values=[7, 8, 9, 10] + [0] * 6))
    assert [one.certain for one in view.values] == [True] * 8
    tick, inputs, first, _ = source.frames([0] * 4, values=[1, 8, 9, 11] + [0] * 6)
    assert feed(decoder, [tick, inputs, first]) == []
    (view,) = decoder.flush()
    assert not view.complete
    assert [(one.known, one.certain) for one in view.values][:4] == [(1, True), (8, False), (9, False), (10, False)]
    assert codes_of(view) == [0] * 4  # of the nodes nothing is missing
    source.told_slots[3] = 11
    (view,) = feed(decoder, source.frames([0] * 4, values=[1, 8, 9, 11] + [0] * 6))
    assert [one.known for one in view.values] == [1] + [None] * 7


def test_what_is_no_trace_frame_of_this_model_is_refused_and_changes_nothing(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4, snapshot_every=1), TraceDecoder(models[4])
    feed(decoder, source.frames([1, 3, 1, 0]))
    tick, change, snapshot = "CanopyTick", "CanopyChange", "CanopySnapshot"
    fives = {f"Status{place}": 15 for place in range(4, 10)}
    ends = {f"Entry{place}": 255 for place in range(5)}
    bad = [
        (IDS[tick], b""),
        (IDS[tick], bytes(7)),
        *((IDS[tick], bits(tick, Version=2, Tick=1, RootStatus=root)) for root in (0, 5, 6, 7)),
        (IDS[change], bits(change, More=1, Tick=1, **(ends | {"Entry0": 0x41}))),  # node 4 of 4
        (IDS[change], bits(change, More=1, Tick=1, Block=1, **(ends | {"Entry0": 0x01}))),  # node 16 of 4
        (IDS[change], bits(change, More=1, Tick=1, **(ends | {"Entry0": 0x01, "Entry1": 0xEF}))),  # no such entry
        (IDS[change], bits(change, More=1, Tick=1, **ends)),  # no node
        (IDS[change], bits(change, More=3, Tick=1, **(ends | {"Entry0": 0x01}))),
        (IDS[snapshot], bits(snapshot, Part=1, **{f"Status{place}": 15 for place in range(10)})),  # behind the last
        (IDS[snapshot], bits(snapshot, **(fives | {"Status9": 0}))),  # a code behind the last node
        (IDS[snapshot], bits(snapshot, **(fives | {"Status3": 15}))),  # none of a node
        (IDS["CanopyHealth"], bytes(9)),
        (IDS["CanopyHealth"], b"\x05" + bytes(7)),  # no such page
        (IDS["CanopyInputs"], bits("CanopyInputs", CanState=7)),
        (IDS["CanopyValue"], bits("CanopyValue", Slot=SLOTS)),
        (IDS["CanopyModel"], b"\x22" + bytes(7)),  # no such page
        (IDS["CanopyModel"], bytes(7)),
    ]
    for count, frame in enumerate(bad, 1):
        assert decoder.feed(*frame) == ()
        assert decoder.refused == count, frame
    assert decoder.feed(0x123, bytes(3)) == ()
    (view,) = feed(decoder, source.frames([1, 3, 1, 0]))
    assert (codes_of(view), view.lost, view.refused, view.complete) == ([1, 3, 1, 0], 0, len(bad), True)
    assert decoder.mismatch is None


def test_a_tick_that_is_guarded_is_checked(tmp_path: Path) -> None:
    model = load_model(write_model(tmp_path, guard=0x1234))
    source, decoder = TraceSource(4, guard=0x1234, snapshot_every=1), TraceDecoder(model)
    for _ in range(20):
        (view,) = feed(decoder, source.frames([1, 3, 1, 0]))
    assert (view.crc_errors, view.refused, view.lost) == (0, 0, 0)
    for bit in range(64):
        frames = source.frames([1, 3, 1, 0])
        data = bytearray(frames[0][1])
        data[bit // 8] ^= 1 << bit % 8
        assert decoder.feed(frames[0][0], bytes(data)) == ()
        assert decoder.crc_errors == decoder.refused == bit + 1
        feed(decoder, frames[1:])
    assert decoder.mismatch is None
    (view,) = feed(decoder, source.frames([1, 3, 1, 0]))
    assert (view.crc_errors, view.lost, view.ticks_missed) == (64, 64, 64)


@settings(max_examples=300)
@given(
    nodes=st.sampled_from((1, 4, 35)),
    frames=st.lists(
        st.tuples(st.sampled_from((*IDS.values(), 0x100)), st.binary(max_size=9) | st.binary(min_size=8, max_size=8))
    ),
)
def test_garbage_never_raises_and_counters_only_grow(models: dict[int, Model], nodes: int, frames: list[Frame]) -> None:
    decoder = TraceDecoder(models[nodes])
    before = (0, 0, 0, 0)
    for identifier, data in frames:
        if identifier == IDS["CanopyTick"] and len(data) == 8:
            data = bytes([data[0], data[1] & 15 | 0x20]) + data[2:]
        for view in decoder.feed(identifier, data):
            assert len(view.nodes) == nodes
            assert {node.code for node in view.nodes} <= set(range(-1, 15))
            assert all(node.text for node in view.nodes)
            assert all(value.text for value in view.values)
        now = (decoder.lost, decoder.ticks_missed, decoder.restarts, decoder.refused)
        assert all(a <= b for a, b in zip(before, now, strict=True))
        before = now


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


def test_a_controller_that_runs_another_tree_is_noticed(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    own = int(models[4].hash[:8], 16)
    for digits, nodes, right in ((own, 4, True), (own + 1, 4, False), (own, 5, False), (own, 4, True)):
        assert decoder.feed(*source.model(digits, nodes)) == ()
        assert (decoder.mismatch is None) == right
    decoder.feed(IDS["CanopyModel"], b"\x21" + bytes(7))  # the page of the time says nothing of it
    assert decoder.mismatch is None


def test_a_trace_of_another_version_is_not_guessed_at(models: dict[int, Model]) -> None:
    """Neither one of a later version nor a CanopyTick as it was before there was a version."""
    old = bytes([0, 7, 0, 0, 0, 1, 2, 0])  # Sequence, Tick, RootStatus, Changes, Overruns
    later = bits("CanopyTick", Version=3, RootStatus=1)
    for data in (old, later):
        decoder = TraceDecoder(models[4])
        assert decoder.feed(IDS["CanopyTick"], data) == ()
        assert decoder.mismatch is not None
        assert "0x600 are no CanopyTick of trace version 2" in decoder.mismatch
        assert "the release of Canopy that the firmware was built with" in decoder.mismatch
    decoder = TraceDecoder(models[4])
    decoder.feed(*TraceSource(4).model(0, 4, version=3))
    assert decoder.mismatch is not None


def test_the_texts_of_codes() -> None:
    texts = [NodeState(code, True, 0, True).text for code in range(-1, 15)]
    assert texts == [
        *("unknown", "IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED"),
        *("RUNNING (kept)", "SUCCESS (kept)", "FAILURE (kept)", "SKIPPED (kept)"),
        *("IDLE (halted now)", "IDLE (was SUCCESS now)", "IDLE (was FAILURE now)"),
        *("IDLE (halted)", "IDLE (was SUCCESS)", "IDLE (was FAILURE)"),
    ]
    assert NodeState(1, False, None, False).text == "RUNNING?"
    assert NodeState(1, False, None, False).status is Status.UNKNOWN
