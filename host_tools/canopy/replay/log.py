# SPDX-License-Identifier: MIT
"""What a log of a bus says of one controller: its runs, tick by tick, with the frames that came in and went out.

A run begins with the controller's tick 0. CanopyInputs and CanopyArrivals give of each tick the time, how many frames
it has taken, and how old they were, CanopyModel the upper bits of the time; the log is complete as long as the sequence
numbers of the trace have no gap. All of it is kept in memory.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from pathlib import Path

import can
from cantools.database import load_string
from cantools.database.can import Database
from cantools.database.can import Message as DbcMessage

from canopy.compiler.trace_layout import dbc as trace_dbc
from canopy.files import FileError, check_file
from canopy.live.frames import ArrivalsFrame, TickFrame
from canopy.live.trace_model import VERSION
from canopy.model import Model, ModelError
from canopy.replay.ticks import Tick, find_times
from canopy.signals import load_database, message_attribute
from canopy.trace import mismatch
from canopy.unixbus import encode

_EXTENDED = 1 << 29
_SEQUENCES = 64
_LAST_TICK = (1 << 32) - 1
_NUMBERED = ("CanopyTick", "CanopySnapshot", "CanopyChange")
NEEDED = ("CanopyTick", "CanopyInputs", "CanopyArrivals")
"""Trace messages without which nothing can be replayed."""
COUNTED_MAX = 3 * 0xFFFF
"""Stands for any number of frames that never left, from this one on."""
SUFFIXES = (".log", ".asc", ".blf")


_TRANSMIT_PAGE = 1


class LogError(Exception):
    """A log cannot be replayed; the text names the place in it, and the way out."""


def key(identifier: int, extended: bool) -> int:
    """One number for an arbitration id and its kind."""
    return identifier | (_EXTENDED if extended else 0)


class Bus:
    """The controller's messages, by their key."""

    def __init__(self, model: Model) -> None:
        """Reads the DBC beside the model.

        Raises:
            ModelError: It cannot be used.
        """
        database = load_database(model)
        self.model = model
        self.ahead = model.trace.waits_periods + 1
        """A command may be so many ticks ahead of its CanopyTick."""
        self.received: dict[int, DbcMessage] = {}
        self.sent: dict[int, DbcMessage] = {}
        """Commands and trace."""
        self.trace: dict[int, str] = {}
        """Which kind a trace message is."""
        self.protected: dict[int, int] = {}
        """The E2E data ids of protected commands."""
        for message in database.messages:
            number = key(message.frame_id, message.is_extended_frame)
            if message.name in model.send:
                self.sent[number] = message
                data_id = message_attribute(message, "E2EDataId", -1)
                if data_id >= 0:
                    self.protected[number] = data_id
            elif message.name in model.receive:
                self.received[number] = message
        trace = load_string(trace_dbc(model.trace.base, model.trace.extended, model.bus_node), "dbc")
        assert isinstance(trace, Database)
        for message in trace.messages:
            number = key(message.frame_id, message.is_extended_frame)
            self.sent[number] = message
            self.trace[number] = message.name


@dataclass(frozen=True)
class Taken:
    """A frame with the id of a message that the controller receives."""

    place: int
    """Number of the frame in the log, from 1."""
    message: int
    """Its key."""
    sender: str
    """Who sends the message, by the DBC."""
    datagram: bytes
    """As the unixbus writes it."""
    fold: int | None
    """What it adds to CanopyInputs' Check; None when its form is not the message's."""


@dataclass(frozen=True)
class Sent:
    """A frame that the controller has sent."""

    place: int
    tick: int
    """Of a trace frame its tick. Of a command that of the CanopyTick behind it: its own tick, or one up to Bus.ahead
    before it, for commands overtake the trace."""
    data: bytes


@dataclass(frozen=True)
class Hole:
    """Trace frames that are missing while the ticks around them are whole."""

    tick: int
    """Its place in the run."""
    frames: int
    text: str


@dataclass
class Run:
    """From the controller's tick 0 to its end, to the log's end, or to the first gap."""

    before: int
    """How many frames that the controller receives are in the log before its tick 0."""
    ticks: list[Tick] = field(default_factory=list)
    sent: dict[int, list[Sent]] = field(default_factory=dict)
    doubtful: dict[int, int] = field(default_factory=dict)
    """How many of the first frames of a command may be of a run before."""
    holes: list[Hole] = field(default_factory=list)
    """Changes and snapshots that are missing: the controller may have dropped them."""
    gap: str | None = None
    """What is missing in the log behind the last tick; None: nothing."""
    mismatch: str | None = None
    """Why the model is not the controller's."""

    counted: list[tuple[int, int]] = field(default_factory=list)
    """Tick, and frames that never left, of each CanopyHealth that tells them, also behind a gap."""


@dataclass
class Recording:
    """All of a log."""

    path: Path
    frames: int = 0
    received: list[Taken] = field(default_factory=list)
    runs: list[Run] = field(default_factory=list)
    joined: int | None = None
    """The log begins with this tick, in the middle of a run; None: no."""


class _Reader:
    """Takes the log's frames one by one."""

    def __init__(self, bus: Bus, path: Path) -> None:
        self.recording = Recording(path)
        self._bus = bus
        self._run: Run | None = None
        self._sequence = 0
        self._last_tick: int | None = None
        self._commands: list[tuple[int, int, bytes]] = []
        """Since the last CanopyTick: key, place, data. They are given to the one that comes next."""

    def take(self, message: can.Message) -> None:
        """Takes frame number `recording.frames`."""
        place = self.recording.frames
        number = key(message.arbitration_id, message.is_extended_id)
        if message.is_error_frame:
            return
        if number in self._bus.received:
            self._take_received(message, place, self._bus.received[number])
        elif number in self._bus.sent and not message.is_remote_frame:
            data = bytes(message.data)
            kind = self._bus.trace.get(number)
            if kind is None:
                self._commands.append((number, place, data))
            elif len(data) != self._bus.sent[number].length:
                self._break(f"frame {place} has the id of {kind}, but {len(data)} bytes")
            else:
                self._take_trace(kind, number, place, data)

    def end(self) -> Recording:
        """Leaves out the last tick where the log ends before its CanopyInputs and CanopyArrivals."""
        for run in self.recording.runs:
            if run.ticks and _lacks(run.ticks[-1]) is not None:
                run.ticks.pop()
            self._end_at_hole(run)
            known = find_times(run.ticks)
            if known < len(run.ticks):
                number = run.ticks[known].number
                del run.ticks[known:]
                run.gap = f"the time of tick {number} is not known: CanopyModel frames are missing"
        return self.recording

    def _end_at_hole(self, run: Run) -> None:
        """A run ends where more trace frames are missing than the controller has counted as dropped."""
        left = max((dropped for _, dropped in run.counted), default=0)
        for hole in run.holes:
            left -= hole.frames
            if left < 0:
                run.gap = hole.text
                del run.ticks[hole.tick :]
                return

    def _take_received(self, message: can.Message, place: int, known: DbcMessage) -> None:
        try:
            datagram = encode(message)
        except ValueError as error:
            raise LogError(f"{self.recording.path}: frame {place}: {error}") from error
        fits = not message.is_remote_frame and message.is_fd == known.is_fd and message.dlc == known.length
        fold = reduce(xor, message.data, message.arbitration_id & 0xFF) if fits else None
        number = key(message.arbitration_id, message.is_extended_id)
        sender = known.senders[0] if known.senders else ""
        self.recording.received.append(Taken(place, number, sender, datagram, fold))

    def _take_trace(self, kind: str, number: int, place: int, data: bytes) -> None:
        if kind == "CanopyTick":
            self._look_at_tick(place, TickFrame.read(data))
        if kind == "CanopyHealth" and self.recording.runs:
            run = self.recording.runs[-1]
            if data[0] & 15 == _TRANSMIT_PAGE:
                run.counted.append((len(run.ticks) - 1, _not_sent(data)))
        if self._run is None:
            self._commands.clear()
            return
        if kind in _NUMBERED:
            self._follow(kind, place, data)
        if kind == "CanopyTick" and not self._add_tick(place, data):
            return
        if kind in ("CanopyInputs", "CanopyArrivals") and not self._complete_tick(kind, place, data):
            return
        if kind == "CanopyModel":
            self._take_model(data)
        self._run.sent.setdefault(number, []).append(Sent(place, len(self._run.ticks) - 1, data))

    def _look_at_tick(self, place: int, frame: TickFrame) -> None:
        """Is it of this version, and does a run begin?"""
        if frame.version != VERSION:
            raise LogError(
                f"{self.recording.path}: frame {place} is no CanopyTick of trace version {VERSION}, but of version "
                f"{frame.version}, or of an older one without a number; replay this log with the release of Canopy "
                "that recorded it, and with the program and the model file of then"
            )
        wraps = self._last_tick == _LAST_TICK
        self._last_tick = frame.tick
        if frame.tick == frame.sequence == 0 and not wraps:
            self._begin()
        elif self.recording.joined is None and not self.recording.runs:
            self.recording.joined = frame.tick

    def _take_model(self, data: bytes) -> None:
        """Page 0: which tree. Page 1: the upper bits of a tick's time."""
        assert self._run is not None
        if self._run.mismatch is None:
            self._run.mismatch = mismatch(self._bus.model, data)
        tick = self._run.ticks[-1]
        if data[0] & 15 == 1 and int.from_bytes(data[1:3], "little") == tick.number & 0xFFFF:
            tick.upper = int.from_bytes(data[3:6], "little")

    def _begin(self) -> None:
        """Tick 0. Of the commands before it all but the last ones may be those with which a run before has ended."""
        self._run = run = Run(before=len(self.recording.received))
        self.recording.runs.append(run)
        self._sequence = 0
        commands: dict[int, list[tuple[int, int, bytes]]] = {}
        for command in self._commands:
            commands.setdefault(command[0], []).append(command)
        run.doubtful = {number: len(frames[-self._bus.ahead :]) - 1 for number, frames in commands.items()}
        self._commands = sorted(command for frames in commands.values() for command in frames[-self._bus.ahead :])

    def _follow(self, kind: str, place: int, data: bytes) -> None:
        """Notes what is missing; where a whole tick is, the next CanopyTick or CanopyInputs shows it."""
        assert self._run is not None
        sequence = (data[6] if kind == "CanopyTick" else data[0]) % _SEQUENCES
        missing = (sequence - self._sequence) % _SEQUENCES
        self._sequence = (sequence + 1) % _SEQUENCES
        if missing and self._run.ticks:
            text = f"before frame {place} ({kind}) {missing} trace frames are missing, or {missing} more than 64"
            self._run.holes.append(Hole(len(self._run.ticks) - 1, missing, text))

    def _add_tick(self, place: int, data: bytes) -> bool:
        assert self._run is not None
        tick, ticks = TickFrame.read(data).tick, self._run.ticks
        lacking = _lacks(ticks[-1]) if ticks else None
        if lacking is not None:
            self._break(f"before frame {place} {lacking} of tick {ticks[-1].number} is missing")
            return False
        if ticks and tick != ticks[-1].number + 1:
            self._break(f"before frame {place} (tick {tick}) ticks are missing")
            return False
        ticks.append(Tick(tick, place))
        for number, where, command in self._commands:
            self._run.sent.setdefault(number, []).append(Sent(where, len(ticks) - 1, command))
        self._commands.clear()
        return True

    def _complete_tick(self, kind: str, place: int, data: bytes) -> bool:
        """Adds what CanopyInputs or CanopyArrivals says to the current tick."""
        assert self._run is not None
        tick = self._run.ticks[-1]
        if kind == "CanopyInputs":
            if tick.inputs:
                self._break(f"before frame {place} a CanopyTick is missing")
                return False
            tick.take_inputs(data)
        else:
            frame = ArrivalsFrame.read(data)
            if not tick.inputs:
                self._break(f"before frame {place} CanopyInputs of tick {tick.number} is missing")
                return False
            if frame is None or frame.tick != tick.number % 16 or tick.is_whole:
                self._break(f"before frame {place} (CanopyArrivals, not of tick {tick.number}) frames are missing")
                return False
            tick.take_arrivals(frame)
        before = self._run.ticks[-2].taken if len(self._run.ticks) > 1 else 0
        if tick.is_whole and not tick.read_ages(before):
            self._break(f"frame {place} ({kind} of tick {tick.number}) tells ages that cannot be; frames are missing")
            return False
        return True

    def _break(self, gap: str) -> None:
        """The run's last tick may lack frames, too: it is left out."""
        if self._run is not None:
            self._run.gap = gap
            self._run.ticks.pop()
            self._run = None


def _lacks(tick: Tick) -> str | None:
    """Which message a tick lacks; None: none."""
    if not tick.inputs:
        return "CanopyInputs"
    return None if tick.is_whole else "CanopyArrivals"


def _not_sent(data: bytes) -> int:
    """What a CanopyHealth counts of frames that never left: replaced, expired, trace frames that were dropped."""
    counts = [int.from_bytes(data[place : place + 2], "little") for place in (1, 3, 5)]
    return COUNTED_MAX if 0xFFFF in counts else sum(counts)


def read_recording(path: Path, model: Model, channel: str | None = None) -> Recording:
    """Reads a log.

    Args:
        path: A log in one of the formats of SUFFIXES.
        model: Of the controller.
        channel: Only the frames of this channel of the log; None: all, which must be of one.

    Raises:
        LogError: The log cannot be read, or holds several buses.
        ModelError: The DBC cannot be used.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise LogError(f"{path}: the suffix says the format, and must be one of {', '.join(SUFFIXES)}")
    reader = _Reader(Bus(model), path)
    channels: set[str] = set()
    try:
        check_file(path)
        with can.LogReader(path) as log:
            _take_all(reader, log, channel, channels)
    except FileError as error:
        raise LogError(str(error)) from error
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (LogError, ModelError):
        raise
    except Exception as error:
        # python-can lets the exceptions of its parsers through.
        raise LogError(
            f"{path}: is no {path.suffix} log behind frame {reader.recording.frames}: {error}; cut it there"
        ) from error
    if len(channels) > 1 and channel is None:
        raise LogError(f"{path}: has frames of several buses ({', '.join(sorted(channels))}): choose with --channel")
    return reader.end()


def _take_all(reader: _Reader, log: Iterable[can.Message], channel: str | None, channels: set[str]) -> None:
    for message in log:
        if message.channel is not None:  # python-can forgets that of an error frame
            channels.add(str(message.channel))
        reader.recording.frames += 1
        if channel is None or str(message.channel) == channel:
            reader.take(message)
