# SPDX-License-Identifier: MIT
"""The trace decoder against frames that cantools has written, with losses, restarts and garbage."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canopy.model import Model, load_model
from canopy.trace import BusState, Health, Status, TraceDecoder, TreeView, status_name
from integration.trace_source import IDS, Frame, TraceSource, write_model

CODES = (0, 1, 2, 3, 4, 9, 10, 11, 12)
UNKNOWN = int(Status.UNKNOWN)


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Model]:
    return {nodes: load_model(write_model(tmp_path_factory.mktemp("model"), nodes)) for nodes in (1, 4, 10, 11, 35)}


def feed(decoder: TraceDecoder, frames: list[Frame]) -> list[TreeView]:
    return [view for frame in frames for view in decoder.feed(*frame)]


@st.composite
def runs(draw: st.DrawFn) -> tuple[int, list[list[int]]]:
    """Number of nodes, and their statuses after each tick; from tick to tick a few nodes change, or many."""
    nodes = draw(st.sampled_from((1, 4, 10, 11, 35)))
    ticks = [[0] * nodes]
    change = st.dictionaries(st.integers(0, nodes - 1), st.sampled_from(CODES), max_size=nodes)
    for changes in draw(st.lists(change, min_size=1, max_size=25)):
        ticks.append([changes.get(node, code) for node, code in enumerate(ticks[-1])])
    return nodes, ticks[1:]


@given(run=runs())
def test_without_losses_every_tick_is_shown_as_it_was(
    models: dict[int, Model], run: tuple[int, list[list[int]]]
) -> None:
    nodes, ticks = run
    source, decoder = TraceSource(nodes), TraceDecoder(models[nodes])
    known: set[int] = set()
    for number, statuses in enumerate(ticks):
        known |= {node for node, code in enumerate(statuses) if code != source.statuses[node]}
        known |= set(range(number * 10 % (-(-nodes // 10) * 10), nodes)[:10])
        (view,) = feed(decoder, source.frames(statuses))
        assert view.tick == number
        assert view.complete
        assert list(view.statuses) == [code if node in known else UNKNOWN for node, code in enumerate(statuses)]
    assert (decoder.lost, decoder.ticks_missed, decoder.restarts, decoder.refused) == (0, 0, 0, 0)


@settings(max_examples=300)
@given(run=runs(), data=st.data())
def test_with_losses_nothing_wrong_is_shown_and_all_are_counted(
    models: dict[int, Model], run: tuple[int, list[list[int]]], data: st.DataObject
) -> None:
    nodes, ticks = run
    source, decoder = TraceSource(nodes), TraceDecoder(models[nodes])
    views: list[TreeView] = []
    lost = counted = 0
    joined = False
    for statuses in ticks:
        for frame in source.frames(statuses):
            if data.draw(st.integers(0, 3)) == 0:
                lost += joined
                continue
            joined = True
            views += decoder.feed(*frame)
            if frame[0] == IDS["CanopyTick"]:
                counted = lost
                assert decoder.lost == counted
    views += decoder.flush()
    numbers = [view.tick for view in views]
    assert numbers == sorted(set(numbers))
    for view in views:
        for code, truth in zip(view.statuses, ticks[view.tick], strict=True):
            assert code in (UNKNOWN, truth)
    # Losses end: a tree is known again as soon as each node has been in a snapshot.
    for _ in range(-(-nodes // 10) + 1):
        views += feed(decoder, source.frames(ticks[-1]))
    assert list(views[-1].statuses) == ticks[-1]
    assert views[-1].complete
    assert decoder.restarts == 0


def test_a_tick_without_its_changes_is_incomplete_and_the_snapshot_mends_it(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    feed(decoder, source.frames([1, 3, 1, 0]))
    tick, *_, snapshot = source.frames([2, 2, 9, 0])  # two Change frames are lost
    (view,) = feed(decoder, [tick, snapshot])
    assert not view.complete
    assert view.statuses == (2, 2, 9, 0)
    (view,) = feed(decoder, source.frames([2, 2, 9, 0]))
    assert view.complete
    assert view.lost == 2


def test_a_later_ticks_snapshot_is_not_taken_for_this_ticks(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(10), TraceDecoder(models[10])
    tick, *_, last_change, _ = source.frames([1, 1, 1, 1, 1, 1, 1, 0, 0, 0])  # three Changes and the Snapshot are lost
    assert feed(decoder, [tick, last_change]) == []
    *_, snapshot = source.frames([2, 1, 1, 1, 1, 1, 1, 0, 0, 0])  # CanopyTick and the Change are lost
    (view,) = feed(decoder, [snapshot])
    assert view.tick == 0
    assert not view.complete
    assert view.statuses[0] in (UNKNOWN, 1)


def test_a_lost_tick_frame_is_a_missed_tick(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    feed(decoder, source.frames([1, 3, 1, 0]))
    assert feed(decoder, source.frames([1, 3, 1, 0])[1:]) == []
    (view,) = feed(decoder, source.frames([1, 3, 1, 0]))
    assert (view.tick, view.lost, view.ticks_missed, view.complete) == (2, 1, 1, True)


def test_silence_gives_up_the_tick_at_hand(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    assert decoder.flush() == ()
    feed(decoder, source.frames([1, 3, 1, 0])[:1])
    (view,) = decoder.flush()
    assert (view.tick, view.complete, view.statuses) == (0, False, (UNKNOWN,) * 4)
    assert decoder.flush() == ()


@given(before=st.integers(0, 300), missing=st.integers(0, 2))
def test_a_restart_is_no_loss(models: dict[int, Model], before: int, missing: int) -> None:
    decoder = TraceDecoder(models[4])
    old = TraceSource(4)
    for _ in range(before + 1):
        feed(decoder, old.frames([1, 3, 1, 0], overruns=5))
    new = TraceSource(4)
    views = feed(decoder, [frame for _ in range(3) for frame in new.frames([0, 0, 0, 0], root=0)][missing:])
    # Tick 0, Snapshot, Tick 1 …: joined late, a new run looks like the old one's next ticks when that was as young.
    if missing == 0 or before > 1:
        assert decoder.restarts == 1
        assert decoder.lost == 0
        assert views[-1].overruns == 0
    assert views[-1].statuses == (0, 0, 0, 0)
    assert views[-1].tick == 2


def test_a_restart_forgets_what_was_known(models: dict[int, Model]) -> None:
    decoder = TraceDecoder(models[35])
    old, new = TraceSource(35), TraceSource(35)
    for _ in range(4):
        feed(decoder, [*old.frames([1] * 35), old.health(Faults=3)])
    (view,) = feed(decoder, new.frames([0] * 35))
    assert view.statuses == (0,) * 10 + (UNKNOWN,) * 25
    assert view.health is None


def test_the_tick_number_and_the_overruns_do_not_wrap(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(1), TraceDecoder(models[1])
    source.tick = 2**32 - 2
    views = [feed(decoder, source.frames([1], overruns=100 * number))[0] for number in range(6)]
    assert [view.tick for view in views] == [2**32 - 2 + number for number in range(6)]
    assert [view.overruns for view in views] == [100 * number for number in range(6)]
    assert views[-1].restarts == 0


def test_a_long_outage_counts_at_least_one_frame_for_each_tick(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(35), TraceDecoder(models[35])
    for _ in range(4):
        feed(decoder, source.frames([1] * 35))
    for _ in range(1024):  # 2048 frames: the sequence looks as if nothing was lost
        source.frames([1] * 35)
    (view,) = feed(decoder, source.frames([1] * 35))
    assert view.ticks_missed == 1024
    assert view.lost >= 1024
    assert view.statuses.count(UNKNOWN) == 25


def test_health_is_taken_over(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(1), TraceDecoder(models[1])
    health = source.health(RxRejected=65535, RxUnknown=2, TxDropped=3, Faults=4)
    assert feed(decoder, [health]) == []
    (view,) = feed(decoder, source.frames([1]))
    assert view.health == Health(65535, 2, 3, 4)
    assert view.health.unknown == 2
    assert Health(rx_unknown=65535).unknown is None


def test_the_state_of_the_bus_is_told(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(1), TraceDecoder(models[1])
    (view,) = feed(decoder, source.frames([1]))
    assert view.bus is None
    told = []
    for state in range(7):
        tick, *rest = source.frames([1])
        (view,) = feed(decoder, [tick, source.arrivals(state, state % 2, state // 4, ages=[7] * (state % 4)), *rest])
        assert view.bus == BusState(state, bool(state % 2), state >= 4)
        assert view.bus.is_good == (state == 0)
        told.append(view.bus.text())
    assert told[0] == "error-active"
    assert told[3:5] == ["blocked, overload", "bus-off, sends safe values"]
    (view,) = feed(decoder, source.frames([1]))
    assert view.bus == BusState(6, False, True)  # as it was
    new = TraceSource(1)
    (view,) = feed(decoder, new.frames([0]))
    assert (view.restarts, view.bus, view.refused) == (1, None, 0)


def test_what_is_no_trace_frame_of_this_model_is_refused_and_changes_nothing(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    feed(decoder, source.frames([1, 3, 1, 0]))
    bad = [
        (IDS["CanopyTick"], b""),
        (IDS["CanopyTick"], bytes(7)),
        (IDS["CanopyTick"], bytes(5) + b"\x05\0\0"),  # no such root status
        (IDS["CanopyChange"], bytes([0, 4, 0, 255, 255, 0xF1, 0, 0])),  # node 4 of 4
        (IDS["CanopyChange"], bytes([0, 1, 0, 255, 255, 0xF5, 0, 0])),  # no such status
        (IDS["CanopyChange"], bytes([0, 1, 0, 255, 255, 0x01, 0, 0])),  # no node, but a status
        (IDS["CanopySnapshot"], bytes([0, 4, 0, 255, 255, 255, 255, 255])),  # starts behind the last node
        (IDS["CanopySnapshot"], bytes([0, 0, 0, 0, 0, 255, 255, 0])),  # a status behind the last node
        (IDS["CanopySnapshot"], bytes([0, 0, 0, 0, 0x60, 255, 255, 255])),  # no such status
        (IDS["CanopyHealth"], bytes(9)),
        (IDS["CanopyArrivals"], bytes(7)),
        (IDS["CanopyArrivals"], b"\x07" + bytes(7)),  # no such state of the bus
        (IDS["CanopyArrivals"], b"\x80" + bytes(7)),  # not used
    ]
    for count, frame in enumerate(bad, 1):
        assert decoder.feed(*frame) == ()
        assert decoder.refused == count
    assert decoder.feed(0x123, bytes(3)) == ()
    (view,) = feed(decoder, source.frames([1, 3, 1, 0]))
    assert (view.statuses, view.lost, view.refused, view.complete) == ((1, 3, 1, 0), 0, len(bad), True)


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
    for frame in frames:
        for view in decoder.feed(*frame):
            assert len(view.statuses) == nodes
            assert set(view.statuses) <= {UNKNOWN, *CODES}
            assert view.root_status in range(5)
            assert all(status_name(code) for code in view.statuses)
        now = (decoder.lost, decoder.ticks_missed, decoder.restarts, decoder.refused)
        assert all(a <= b for a, b in zip(before, now, strict=True))
        before = now


def test_what_a_tick_worked_with_changes_no_view(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    head, *rest = source.frames([1, 3, 1, 0])
    (view,) = feed(decoder, [head, source.inputs(2**48 - 1, 255, 254), *rest])
    assert (view.complete, view.statuses, view.lost, view.refused) == (True, (1, 3, 1, 0), 0, 0)


def test_a_controller_that_runs_another_tree_is_noticed(models: dict[int, Model]) -> None:
    source, decoder = TraceSource(4), TraceDecoder(models[4])
    own = int(models[4].hash[:8], 16)
    for digits, nodes, right in ((own, 4, True), (own + 1, 4, False), (own, 5, False), (own, 4, True)):
        assert decoder.feed(*source.model(digits, nodes)) == ()
        assert (decoder.mismatch is None) == right


def test_status_names() -> None:
    assert [status_name(code) for code in (-1, 0, 1, 2, 3, 4, 9, 10)] == [
        "unknown",
        "IDLE",
        "RUNNING",
        "SUCCESS",
        "FAILURE",
        "SKIPPED",
        "IDLE (was RUNNING)",
        "IDLE (was SUCCESS)",
    ]
