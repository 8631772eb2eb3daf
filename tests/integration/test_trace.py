# SPDX-License-Identifier: MIT
"""The trace decoder against frames that were written from docs/trace.md alone; losses are in test_trace_losses."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canopy.model import Model, load_model
from canopy.trace import BusState, Health, NodeState, Status, TraceDecoder, TreeView
from integration.trace_source import IDS, SLOTS, TEXTS, VALUES, Frame, TraceSource, bits, models_by_size, write_model

SIZES = (1, 4, 10, 11, 35, 150)
UNKNOWN = -1


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Model]:
    return models_by_size(tmp_path_factory.mktemp("models"), SIZES)


def feed(decoder: TraceDecoder, frames: list[Frame]) -> list[TreeView]:
    return [view for frame in frames for view in decoder.feed(*frame)]


def codes_of(view: TreeView) -> list[int]:
    """The certain ones."""
    return [node.code if node.certain else UNKNOWN for node in view.nodes]


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
