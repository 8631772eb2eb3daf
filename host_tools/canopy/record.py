# SPDX-License-Identifier: MIT
"""`canopy record`: every frame of a bus, with its time, into a log for `canopy replay` and other tools."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import can
import click

from canopy.can_bus.steady import Gap, SteadyBus
from canopy.canbus import CanBusError, is_plain_data, split_spec
from canopy.escape.json_text import dumps
from canopy.escape.terminal import Styled, echo
from canopy.model import Model, ModelError, load_model
from canopy.process.say import Voice
from canopy.process.status import DONE, FAILED, NOTHING
from canopy.stop import StopFlag
from canopy.trace import TraceDecoder, TreeView

SUFFIXES = (".log", ".asc", ".blf")
"""Formats that keep all of a frame: candump's, Vector's text, Vector's binary."""

_POLL_S = 0.1
_SILENT_S = 0.2  # at the end: what is on its way still comes
_REST_S = 2.0
_TERMINAL_PERIOD_S = 0.5
_LINE_PERIOD_S = 10.0
_RECEIVE_BUFFER = 4 << 20
_LINE_START, _CLEAR = Styled("\r"), Styled("\x1b[K")


class RecordError(Exception):
    """The log cannot be made; the text says why, and the way out."""


class LogFailedError(Exception):
    """The log could not be written to its end; the text says why."""


@dataclass
class Summary:
    """What was recorded."""

    file: str
    frames: int = 0
    error_frames: int = 0
    """Of these: error frames of the own CAN controller."""
    seconds: float = 0.0
    lost: int | None = 0
    """Frames that this program was too slow for; None where the driver does not say."""
    ticks: int | None = None
    """With a model: ticks of the controller."""
    trace_lost: int | None = None
    """With a model: trace frames that are missing in the log, whoever lost them."""
    starts: int | None = None
    """With a model: how often the controller's first tick was recorded. A replay begins there."""
    disagreements: int | None = None
    """With a model: how often a CanopyModel began to claim another tree."""
    outages: int = 0
    """How often the bus was away: down, gone, or failed."""
    away_s: float = 0.0
    """How long in all."""

    def text(self) -> str:
        """For people, one line."""
        lost = "losses not known" if self.lost is None else f"{self.lost} lost"
        text = f"{self.frames} frames in {self.seconds:.1f} s, {lost}"
        if self.outages:
            text += f", {self.outages} gaps of {self.away_s:.1f} s in all"
        if self.ticks is not None:
            text += f"; {self.ticks} ticks, {self.trace_lost} trace frames lost, {self.starts} starts of the controller"
        if self.disagreements:
            text += f"; {self.disagreements} claims of another tree than the model's"
        return text


class Recorder:
    """Writes frames, and counts what they tell."""

    def __init__(
        self, writer: can.io.generic.MessageWriter, path: Path, channel: str, model: Model | None, voice: Voice
    ) -> None:
        self.summary = Summary(str(path))
        self.decoder = TraceDecoder(model) if model is not None else None
        self._writer = writer
        self._channel = channel
        self._voice = voice
        self._started = time.monotonic()
        self._last_tick: int | None = None
        self._told: set[str] = set()
        self._claim: str | None = None
        if model is not None:
            self.summary.ticks = self.summary.trace_lost = self.summary.starts = self.summary.disagreements = 0

    def take(self, message: can.Message) -> None:
        """Writes one frame."""
        message.channel = self._channel  # a folder's path could hold blanks, which candump's format has no quotes for
        self._writer.on_message_received(message)
        self.summary.frames += 1
        self.summary.error_frames += message.is_error_frame
        if self.decoder is not None and is_plain_data(message):
            self._count(self.decoder.feed(message.arbitration_id, bytes(message.data)))
            self._compare(self.decoder.mismatch)

    def mark(self, gap: Gap) -> None:
        """Writes where nothing could be recorded: an error frame at its end, with "GAP" and its length [ms] as data."""
        self.summary.away_s = round(self.summary.away_s + gap.seconds, 3)
        ended = gap.began + gap.seconds
        if isinstance(self._writer, (can.ASCWriter, can.BLFWriter)):  # the others have no place for words
            text = f"// {self._channel} gap of {gap.seconds:.3f} s: {gap.why}"
            self._writer.log_event(text.encode("ascii", "backslashreplace").decode("ascii"), ended)
        milliseconds = min(round(gap.seconds * 1000), 2**32 - 1)
        data = b"GAP\0" + milliseconds.to_bytes(4, "little")
        marker = can.Message(timestamp=ended, is_error_frame=True, is_extended_id=False, dlc=8, data=data)
        marker.channel = self._channel
        self._writer.on_message_received(marker)
        if self.decoder is not None:
            self._tell("nothing is known of the time in which the bus was away; the log cannot be replayed beyond it")

    def update(self, bus: SteadyBus) -> None:
        """Brings the summary up to date, and says once what a user should know while there is time to mend it."""
        summary, decoder = self.summary, self.decoder
        summary.seconds = round(time.monotonic() - self._started, 3)
        summary.lost = bus.losses()
        summary.outages = bus.outages
        if summary.lost:
            self._tell(
                "frames are lost: this machine is too slow for the bus; the log cannot be replayed from there on"
            )
        if decoder is not None:
            summary.trace_lost = decoder.lost
            if decoder.lost:
                self._tell("trace frames are lost on the way; the log cannot be replayed from there on")

    def _compare(self, claim: str | None) -> None:
        """A CanopyModel that is not the model's: anybody can send one, on a bus."""
        if claim is not None and claim != self._claim:
            self.summary.disagreements = (self.summary.disagreements or 0) + 1
            self._voice.say(claim, "model")
        self._claim = claim

    def _count(self, views: tuple[TreeView, ...]) -> None:
        assert self.summary.ticks is not None
        assert self.summary.starts is not None
        for view in views:
            if self._last_tick is None and view.tick != 0:
                self._tell(
                    f"the controller was running already (tick {view.tick}); a replay begins with its first tick: "
                    "start the record first, then the controller"
                )
            self.summary.starts += view.tick == 0
            self.summary.ticks += 1
            self._last_tick = view.tick

    def _tell(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            self._voice.say(text, "once")


class _Progress:
    """A line on stderr: in a terminal always the same one, into a file a new one now and then."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._due = time.monotonic() + _TERMINAL_PERIOD_S

    def is_due(self) -> bool:
        return time.monotonic() >= self._due

    def show(self, text: str) -> None:
        self._due = time.monotonic() + (_TERMINAL_PERIOD_S if self._terminal else _LINE_PERIOD_S)
        before, after = (_LINE_START, _CLEAR) if self._terminal else (Styled(), Styled())
        echo(before, text, after, err=True, nl=not self._terminal)

    def end(self) -> None:
        if self._terminal:
            echo(_LINE_START, _CLEAR, err=True, nl=False)


@contextmanager
def open_log(path: Path, force: bool) -> Iterator[can.io.generic.MessageWriter]:
    """A new log, in the format of its suffix; whole when the context ends.

    Raises:
        RecordError: It cannot be made.
        LogFailedError: It cannot be completed at the end.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise RecordError(f"{path}: the suffix says the format, and must be one of {', '.join(SUFFIXES)}")
    try:
        with path.open("wb" if force else "xb"):  # can.Logger would overwrite without a word
            pass
        writer = can.Logger(path)
    except FileExistsError:
        raise RecordError(f"{path}: is there already; give another name, or --force to overwrite it") from None
    except OSError as error:
        raise RecordError(f"{path}: cannot be written: {error.strerror}") from error
    assert isinstance(writer, can.io.generic.MessageWriter)
    try:
        yield writer
    finally:
        try:
            writer.stop()
        except OSError as error:
            raise LogFailedError(f"{path}: {error}: what was recorded last is missing") from error


def _channel(spec: str) -> str:
    """What the log calls the bus: can0, or for a unixbus the name of its folder."""
    name = Path(split_spec(spec)[1]).name
    return "".join(letter if letter.isalnum() else "_" for letter in name) or "bus"


def run(recorder: Recorder, bus: SteadyBus, stop: StopFlag, duration: float | None) -> None:
    """Until a signal comes or `duration` [s] is over; then what has come by then is still written.

    Raises:
        OSError: The log cannot be written, e.g. because the disk is full.
    """
    progress = _Progress()
    end = None if duration is None else time.monotonic() + duration
    try:
        while not stop and (end is None or time.monotonic() < end):
            message = bus.recv(_POLL_S)
            if message is not None:
                recorder.take(message)
            if progress.is_due():
                recorder.update(bus)
                progress.show(f"canopy record: {recorder.summary.text()}")
        limit = time.monotonic() + _REST_S  # a bus that never falls silent
        while time.monotonic() < limit and (message := bus.recv(_SILENT_S)) is not None:
            recorder.take(message)
        recorder.update(bus)
    finally:
        progress.end()


def _record(
    spec: str, output: Path, model: Model | None, force: bool, create: bool, duration: float | None
) -> Recorder:
    voice = Voice("canopy record")
    with (
        StopFlag() as stop,
        SteadyBus(spec, voice, create=create, receive_buffer=_RECEIVE_BUFFER, fd=True) as bus,
        open_log(output, force) as writer,
    ):
        recorder = Recorder(writer, output, _channel(spec), model, voice)
        bus.on_gap = recorder.mark
        echo(f"canopy record: {spec} to {output}  (Ctrl-C ends)", err=True)
        try:
            run(recorder, bus, stop, duration)
        except OSError as error:
            raise LogFailedError(f"{output}: {error}; {recorder.summary.text()} until then") from error
    voice.end()
    if not recorder.summary.frames:
        echo(f"canopy record: nothing came on {spec}; `canopy buses` lists the buses that there are", err=True)
    return recorder


@click.command(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  canopy record --can socketcan:can0 -o run.log
  canopy record --can unixbus:bus0 -o run.blf --model nao_home.model.json --duration 60 --json
""",
)
@click.option("--can", "bus_name", required=True, help="socketcan:vcan0, unixbus:bus0 or unixbus:/a/folder")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="The log. Its suffix says the format: .log (candump's), .asc or .blf (Vector's).",
)
@click.option(
    "--model", "model_path", type=click.Path(path_type=Path), help="<application>.model.json: counts ticks, too."
)
@click.option("--force", is_flag=True, help="Overwrite a file that is there.")
@click.option("--create", is_flag=True, help="Make the unixbus if it is missing.  [default: wait for it]")
@click.option("--duration", type=click.FloatRange(0, min_open=True), help="End after so many seconds.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one line of JSON.")
def command(
    bus_name: str,
    output: Path,
    model_path: Path | None,
    force: bool,
    create: bool,
    duration: float | None,
    as_json: bool,
) -> None:
    """Record every frame of a CAN bus, with its time.

    Start it before the controller: `canopy replay` needs the controller's first tick. Where the controller would make
    the unixbus, --create makes it before. It only listens. Progress and what was lost are shown on stderr. A bus that
    is down or gone is waited for, and the gap is marked in the log. Runs until Ctrl-C; a summary is printed at the end.

    Exit status: 0 recorded, 1 nothing came, or the bus, the file or the model cannot be used, 2 wrong command line,
    3 an error ended it, e.g. a full disk.
    """
    try:
        model = load_model(model_path) if model_path is not None else None
        recorder = _record(bus_name, output, model, force=force, create=create, duration=duration)
    except (ModelError, RecordError, CanBusError, can.CanError, OSError) as error:
        echo(f"canopy record: {error}", err=True)
        sys.exit(NOTHING)
    except LogFailedError as error:
        echo(f"canopy record: {error}", err=True)
        sys.exit(FAILED)
    summary = recorder.summary
    echo(dumps(asdict(summary)) if as_json else f"canopy record: {output}: {summary.text()}")
    sys.exit(DONE if summary.frames else NOTHING)
