# SPDX-License-Identifier: MIT
"""Entries, reasons and a protected CanopyTick, from an application in C to what the tools show."""

from __future__ import annotations

import copy
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import cantools
import pytest
from cantools.database.can import Database
from click.testing import CliRunner

from canopy.cli import main
from canopy.model import Model, load_model
from canopy.trace import TraceDecoder, TreeView
from integration import logs
from integration.language import ROOT, WARNINGS, compile_files, tree
from integration.trace_source import LAYOUT

BASE, DATA_ID, TICKS = 0x18FF0000, 0x1234, 1000

MODEL = """<Action ID="Count">
<output_port name="n" type="int32_t"/><output_port name="far" type="int64_t"/>
<output_port name="level" type="int16_t/10"/><output_port name="word" type="std::string"/>
<output_port name="on" type="bool"/>
<MetadataFields><Metadata kind="SyncAction" reasons="too dark;too cold" texts="left;right" state="uint32_t"/>
</MetadataFields></Action>"""
NODES = """<Sequence name="All">
<Count n="{n}" far="{far}" level="{level}" word="{word}" on="{on}"/><Script code="twice := n * 2"/></Sequence>"""

LEAVES = """
#include "app_leaves.h"

canopy_status_t count_tick(const app_input_t *in, const count_ports_t *ports, uint32_t *self, count_reason_t *reason)
{
    uint32_t tick = (*self)++;

    (void)in;
    count_set_n(ports, -(int32_t)tick);
    count_set_far(ports, -((int64_t)1 << 40) * (int64_t)(tick / 8u) + 1);
    count_set_level(ports, (int16_t)(tick / 16u));
    count_set_word(ports, tick / 32u % 2u == 0u ? COUNT_LEFT : COUNT_RIGHT);
    count_set_on(ports, tick / 64u % 2u == 1u);
    *reason = (count_reason_t)(tick / 10u % 3u);
    return CANOPY_SUCCESS;
}
"""

MAIN = """
#include <stdio.h>

#include "app_app.h"
#include "canopy/clock/replay_files.h"

int main(int argc, char **argv)
{
    static canopy_replay_files_t replay;
    static canopy_loop_t loop;
    static char message[CANOPY_REPLAY_MESSAGE];
    canopy_loop_config_t config = {.app = &app_app};

    if (argc != 5 || canopy_replay_open(&replay, argv[2], argv[4], message, sizeof message) != CANOPY_OK) {
        fprintf(stderr, "%s\\n", message);
        return 1;
    }
    config.can = &replay.replay.can;
    config.clock = &replay.replay.clock;
    if (canopy_loop_init(&loop, &config) != CANOPY_OK || canopy_loop_run(&loop) != CANOPY_OK) {
        return 1;
    }
    return canopy_replay_close(&replay) == CANOPY_OK ? 0 : 1;
}
"""


def expected(tick: int) -> list[int | float | bool | str]:
    """The values after a tick, in the model's order."""
    far = -(1 << 40) * (tick // 8) + 1
    word, reason = ("left", "right")[tick // 32 % 2], ("", "too dark", "too cold")[tick // 10 % 3]
    return [-tick, far, tick // 16 / 10, word, tick // 64 % 2 == 1, -2 * tick, reason]


@dataclass
class Run:
    """The application, and what it sends."""

    folder: Path
    model: Model
    program: Path
    frames: list[can.Message]


@pytest.fixture(scope="module")
def run(build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("values")
    more = ["--name", "app", "--trace", hex(BASE), "--trace-guard", hex(DATA_ID)]
    result = compile_files(folder, {"main.xml": tree(NODES, model=MODEL)}, *more)
    assert result.exit_code == 0, result.output
    out = folder / "out"
    (out / "leaves.c").write_text(LEAVES)
    (out / "main.c").write_text(MAIN)
    program = folder / "app"
    includes = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{ROOT / 'drivers' / 'include'}", f"-I{out}"]
    sources = [str(path) for path in sorted(out.glob("*.c"))]
    drivers = [
        build_dir / "drivers" / f"libcanopy_{name}.a" for name in ("clock_replay_files", "clock_replay", "can_unixbus")
    ]
    libraries = [str(path) for path in (*drivers, *(build_dir / "drivers").glob("libcanopy_can_a*.a"))]
    libraries.append(str(build_dir / "runtime" / "libcanopy_runtime.a"))
    cache = (build_dir / "CMakeCache.txt").read_text(encoding="utf-8")
    sanitizers = (
        ["-fsanitize=address,undefined"] if re.search(r"^CANOPY_SANITIZE:.*address", cache, re.MULTILINE) else []
    )
    flags = ["-std=c11", "-D_GNU_SOURCE", *WARNINGS, *sanitizers]
    command = ["gcc", *flags, *includes, *sources, "-o", str(program), *libraries]
    subprocess.run(command, check=True)
    logs.write_record(folder / "record", [logs.Step(1_000_000 + 10_000 * tick, []) for tick in range(TICKS)])
    subprocess.run([str(program), "--replay", str(folder / "record"), "--sent", str(folder / "sent")], check=True)
    frames = logs.read_frames(folder / "sent")
    return Run(folder, load_model(out / "app.model.json"), program, frames)


def views_of(run: Run, decoder: TraceDecoder) -> Iterator[TreeView]:
    for frame in run.frames:
        if frame.is_extended_id:
            yield from decoder.feed(frame.arbitration_id, bytes(frame.data))


def test_what_is_certain_is_what_the_application_had(run: Run) -> None:
    decoder = TraceDecoder(run.model)
    certain = [0] * 7
    views = list(views_of(run, decoder))
    assert [view.tick for view in views] == list(range(TICKS))
    for view in views:
        assert all(node.certain for node in view.nodes)
        for place, (state, value) in enumerate(zip(view.values, expected(view.tick), strict=True)):
            assert not state.certain or state.known == value, (view.tick, state)
            certain[place] += state.certain
    assert (decoder.crc_errors, decoder.refused, decoder.lost) == (0, 0, 0)
    assert decoder.mismatch is None
    # Of 32 bits that change in every tick two fit, with one that is due now and then.
    assert certain[0] > TICKS * 0.7
    assert all(count > TICKS * 0.5 for count in certain)


def test_values_are_shown_with_their_words(run: Run) -> None:
    decoder = TraceDecoder(run.model)
    view = next(view for view in views_of(run, decoder) if view.tick > 500 and all(one.certain for one in view.values))
    n, far, level, word, on, twice, reason = (state.text for state in view.values)
    assert (n, twice) == (str(-view.tick), str(-2 * view.tick))
    assert far == str(-(1 << 40) * (view.tick // 8) + 1)
    assert level == f"{view.tick // 16 / 10:g}"
    assert (word, on, reason) == (
        ("left", "right")[view.tick // 32 % 2],
        ("false", "true")[view.tick // 64 % 2],
        ("none", "too dark", "too cold")[view.tick // 10 % 3],
    )
    titles = [state.value.title for state in view.values]
    assert titles == ["n", "far", "level", "word", "on", "twice", "Main/Count"]


def test_the_dbc_for_other_tools_says_the_same(run: Run) -> None:
    """Each signal where docs/trace.md has it; CanopyChange's entries in two halves."""
    database = cantools.database.load_file(run.folder / "out" / "app_trace.dbc")
    assert isinstance(database, Database)
    for name, fields in LAYOUT.items():
        message = database.get_message_by_name(name)
        assert (message.length, message.is_extended_frame) == (8, True)
        there = {signal.name: (signal.start, signal.length) for signal in message.signals}
        if name == "CanopyChange":
            there = {key: at for key, at in there.items() if not key.startswith(("Code", "Gap"))}
            there |= {f"Entry{place}": (24 + 8 * place, 8) for place in range(5)}
        assert fields.items() <= there.items()
        assert all(signal.byte_order == "little_endian" and not signal.is_signed for signal in message.signals)


def test_it_is_replayed_with_its_values_and_its_protection(run: Run, tmp_path: Path) -> None:
    ended = max(place for place, frame in enumerate(run.frames) if frame.is_extended_id) + 1

    def replay(frames: list[can.Message]) -> tuple[int, str]:
        path = logs.write_log(tmp_path / "run.log", logs.stamped(frames))
        command = ["replay", str(path), "--model", str(run.model.path), "--program", str(run.program)]
        result = CliRunner().invoke(main, command)
        return result.exit_code, result.stdout + result.stderr

    status, text = replay(run.frames[:ended])
    assert (status, text) == (0, f"app: {TICKS} ticks replayed, {ended} frames compared: all equal\n")
    spoilt = copy.deepcopy(run.frames[:ended])
    value = next(frame for frame in spoilt[ended // 2 :] if frame.arbitration_id == run.model.trace.ids["CanopyValue"])
    value.data[4] ^= 1
    status, text = replay(spoilt)
    assert status == 1
    assert "CanopyValue: value '" in text
    spoilt = copy.deepcopy(run.frames[:ended])
    ticks = [frame for frame in spoilt if frame.arbitration_id == BASE]
    ticks[300].data[0] ^= 1
    status, text = replay(spoilt)
    assert status == 1
    assert "tick 300 (frame " in text
    assert "CanopyTick: Crc: recorded" in text
