# SPDX-License-Identifier: MIT
"""The command `canopy replay`."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import click

from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo
from canopy.model import Model, ModelError, load_model
from canopy.replay.compare import Comparison, Result
from canopy.replay.inputs import Inputs
from canopy.replay.log import Bus, LogError, Recording, Run, read_recording
from canopy.replay.program import ProgramError, read_sent, run_program, write_record

_SHOWN = 12
"""So many differences of a tick are told to people; JSON has all."""


@dataclass(frozen=True)
class Options:
    """How to replay."""

    program: Path
    arguments: tuple[str, ...]
    channel: str | None
    run: int | None
    ticks: int | None
    keep: Path | None


@dataclass(frozen=True)
class Replayed:
    """What a replay came to."""

    run: int
    runs: int
    inputs: int
    """Frames that the controller took."""
    reordered: int
    unheard: int
    """Frames of the log that never reached the controller."""
    result: Result


def choose_run(recording: Recording, wanted: int | None) -> Run:
    """The run that was asked for, else the first.

    Raises:
        LogError: There is none.
    """
    if not recording.runs:
        seen = (
            f"begins with tick {recording.joined} of the controller, in the middle of its run"
            if recording.joined is not None
            else "has no CanopyTick frames of this controller"
        )
        raise LogError(
            f"{recording.path}: {seen}; a replay needs all since its first tick: start `canopy record` before the "
            "controller"
        )
    if wanted is not None and wanted > len(recording.runs):
        raise LogError(f"{recording.path}: has {len(recording.runs)} runs of the controller, and no run {wanted}")
    return recording.runs[(wanted or 1) - 1]


def count_ticks(recording: Recording, run: Run, wanted: int | None) -> int:
    """How many ticks are to be replayed.

    Raises:
        LogError: The log does not have so many without a gap, or is another controller's.
    """
    if run.mismatch is not None:
        raise LogError(run.mismatch)
    if wanted is not None and wanted > len(run.ticks):
        raise LogError(
            f"{recording.path}: has {len(run.ticks)} ticks of this run, not {wanted}: {run.gap or 'it ends there'}"
        )
    if wanted is None and run.gap is not None:
        way_out = f"--ticks {len(run.ticks)} replays what is before" if run.ticks else "record again"
        raise LogError(f"{recording.path}: {run.gap}; a replay needs all of them; {way_out}")
    if not run.ticks:
        raise LogError(f"{recording.path}: has no whole tick of the controller: record for longer")
    return wanted or len(run.ticks)


def replay(log: Path, model: Model, options: Options) -> Replayed:
    """Replays a log.

    Raises:
        LogError, ModelError: Log and model cannot be replayed.
        ProgramError, OSError: The program, or a file.
    """
    recording = read_recording(log, model, options.channel)
    run = choose_run(recording, options.run)
    ticks = count_ticks(recording, run, options.ticks)
    inputs = Inputs(recording, run, ticks)
    bus = Bus(model)
    with tempfile.TemporaryDirectory(prefix="canopy-replay-") as temporary:
        record, sent = options.keep or Path(temporary) / "record", Path(temporary) / "sent"
        write_record(record, run, inputs)
        run_program(options.program, options.arguments, record.absolute(), sent)
        result = Comparison(bus, run, inputs.ticks).run(read_sent(sent))
    return Replayed(options.run or 1, len(recording.runs), len(inputs), inputs.reordered, inputs.unheard, result)


def _show(log: Path, model: Model, options: Options, replayed: Replayed) -> None:
    result = replayed.result
    name = model.application
    if replayed.runs > 1 and options.run is None:
        echo(f"{name}: {log} has {replayed.runs} runs of the controller; this is the first, --run chooses", err=True)
    if not result.differences:
        dropped = f"; {result.dropped} more did not leave, as CanopyHealth has counted" if result.dropped else ""
        unheard = f"; {replayed.unheard} never reached the controller" if replayed.unheard else ""
        uncounted = f"; {result.uncounted} are missing too late in the log to be counted" if result.uncounted else ""
        equal = f"{result.ticks} ticks replayed, {result.frames} frames compared: all equal"
        echo(f"{name}: {equal}{dropped}{uncounted}{unheard}")
        return
    for difference in result.differences[:_SHOWN]:
        echo(f"{name}: {difference.text()}")
    if len(result.differences) > _SHOWN:
        echo(f"{name}: and {len(result.differences) - _SHOWN} more in this tick (--json has all)")
    echo(f"{name}: {result.ticks} ticks are equal, then the replay differs")
    record = options.keep or "run.replay"
    keep = "" if options.keep else f"with --keep {record}: "
    echo(
        f"  {keep}gdb --args {options.program} --replay {record}, and break there `if loop.ticks == {result.ticks}`",
        err=True,
    )


def _as_json(log: Path, model: Model, replayed: Replayed) -> str:
    result = replayed.result
    return dumps(
        {
            "log": str(log),
            "application": model.application,
            "run": replayed.run,
            "runs": replayed.runs,
            "inputs": replayed.inputs,
            "reordered": replayed.reordered,
            "unheard": replayed.unheard,
            "equal": not result.differences,
            **result.as_dict(),
        }
    )


@click.command(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy replay run.log --model nao_home.model.json --program build/host/examples/nao/nao_home
  canopy replay run.log --model nao_home.model.json --program ./nao_home --keep run.replay --ticks 200
""",
)
@click.argument("log", type=click.Path(path_type=Path, dir_okay=False))
@click.argument("arguments", nargs=-1, metavar="[-- ARGUMENTS OF THE PROGRAM]")
@click.option("--model", "model_path", type=click.Path(path_type=Path), required=True, help="<application>.model.json")
@click.option(
    "--program", type=click.Path(path_type=Path), required=True, help="The controller, built for this machine."
)
@click.option("--run", type=click.IntRange(1), help="Which start of the controller in the log.  [default: the first]")
@click.option("--ticks", type=click.IntRange(1), help="Only so many ticks from its start.  [default: all]")
@click.option("--channel", help="Only this bus of a log of several, as the log calls it.")
@click.option(
    "--keep",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write the record there, for the program's --replay.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as one line of JSON.")
def command(
    log: Path,
    arguments: tuple[str, ...],
    model_path: Path,
    program: Path,
    run: int | None,
    ticks: int | None,
    channel: str | None,
    keep: Path | None,
    as_json: bool,
) -> None:
    """Run a controller's program again on a LOG of its bus, and compare what it sends, bit for bit.

    The program takes the same frames at the same times, tick by tick, from the first one on; nothing is sent on any
    bus. LOG is what `canopy record` or candump -l wrote: .log, .asc or .blf.

    Exit status: 0 every frame is equal, 1 one is not, or the log cannot be replayed, 2 wrong command line.
    """
    options = Options(program, arguments, channel, run, ticks, keep)
    try:
        model = load_model(model_path)
        replayed = replay(log, model, options)
    except (LogError, ModelError, ProgramError, OSError) as error:
        if as_json:
            echo(dumps({"log": str(log), "equal": False, "error": str(error)}))
        echo(f"canopy replay: {error}", err=True)
        sys.exit(1)
    if as_json:
        echo(_as_json(log, model, replayed))
    else:
        _show(log, model, options, replayed)
    sys.exit(1 if replayed.result.differences else 0)
