# SPDX-License-Identifier: MIT
"""What can be made of many bus descriptions: of each file a codec, and an application for each of its nodes."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from canopy.bus.foreign import KINDS
from canopy.bus.overlay import overlay_path
from canopy.bus.overlay_writer import Values, Wanted, overlay_text, physical_text
from canopy.bus.source import SourceMessage, SourceSignal
from canopy.compiler.bus_model import float_value
from canopy.compiler.bus_reader import read_bus, read_messages
from canopy.compiler.codec_cli import render_codec
from canopy.compiler.dbc_file import Dbc, load_dbc, number
from canopy.compiler.emit import render_bus
from canopy.compiler.errors import CompileError
from canopy.compiler.signal_reader import read_signal
from canopy.files import write_files

SUFFIXES = (".dbc", *KINDS)
RULE_MS = 100
"""The cycle time where a file gives none."""
EVERYTHING = "Everything"
"""The node that receives all of a file that names nobody."""
_LONGEST_REASON = 110


class RuleValues(Values):
    """Fills an overlay by rule: 100 ms, timeouts of 500 ms, address 0, and the value nearest to 0 that may be sent."""

    def cycle_ms(self, _message: SourceMessage) -> str:
        """Of an output."""
        return str(RULE_MS)

    def timeout_ms(self, _message: SourceMessage) -> str:
        """Of an input."""
        return "500"

    def source(self, _message: SourceMessage) -> str:
        """Of an output of J1939."""
        return "0"

    def safe(self, _dbc: Dbc, message: SourceMessage, signal: SourceSignal) -> str:
        """Of a signal of an output, physical."""
        read = read_signal(message, signal)
        if read.is_float:
            return repr(float_value(read.safe, read.length) * float(read.scale) + float(read.offset))
        return physical_text(signal, Fraction(read.safe))


@dataclass
class FileResult:
    """One file."""

    name: str
    messages: int = 0
    compiled: int = 0
    """Messages in the codec."""
    signals: int = 0
    """Signals in the codec."""
    reasons: list[str] = field(default_factory=list)
    """Why messages are left out, one each."""
    dropped: int = 0
    """Signals that are left out of messages that are there."""
    tries: int = 0
    """Nodes that send or receive something."""
    applications: int = 0
    """Nodes for which there is an application's bus."""
    failed: list[str] = field(default_factory=list)
    """Why there is none for the others."""
    error: str = ""
    """Why the file cannot be read."""

    @property
    def share(self) -> float:
        """Of the messages, those that are left out [%]."""
        return 100 * (self.messages - self.compiled) / self.messages if self.messages else 0.0


def _nodes(dbc: Dbc) -> list[str]:
    """Those that send or receive something."""
    nodes = {node for message in dbc.messages for node in (*message.senders, *message.receivers)}
    return sorted(nodes)


def _period_ms(dbc: Dbc) -> int:
    """The longest one of which every cycle time is a multiple."""
    cycles = [number(dbc, "GenMsgCycleTime", message) or Fraction(0) for message in dbc.messages]
    return math.gcd(RULE_MS, *(int(cycle) for cycle in cycles if cycle.denominator == 1))


def try_application(path: Path, dbc: Dbc, node: str) -> str:
    """Makes the bus of an application for a node, with the overlay filled by rule; returns what is wrong, or ""."""
    everything = tuple(message.name for message in dbc.messages) if node == EVERYTHING else ()
    try:
        text = overlay_text(dbc, Wanted(node, receive=everything, values=RuleValues()))
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / path.name
            shutil.copyfile(path, copy)
            write_files({overlay_path(copy): text.encode()})
            period_ms = _period_ms(dbc)
            render_bus(read_bus(copy, node, period_ms), period_ms)
    except CompileError as error:
        return f"{node}: {error.message}"
    return ""


def survey_file(path: Path, name: str) -> FileResult:
    """Tries all that can be made of a file."""
    result = FileResult(name)
    try:
        dbc = load_dbc(path)
    except CompileError as error:
        result.error = error.message
        return result
    result.messages = len(dbc.source.messages) + len(dbc.source.problems)
    try:
        codec = read_messages(path)
        render_codec(codec)
    except CompileError as error:
        result.reasons = [error.message] * result.messages
        return result
    result.compiled = len(codec.messages)
    result.signals = sum(len(message.signals) for message in codec.messages)
    result.reasons = [problem.message for problem in codec.source.left_out]
    result.dropped = sum(len(message.dropped) for message in codec.source.messages if message.problem is None)
    for node in _nodes(dbc) or ([EVERYTHING] if dbc.messages else []):
        result.tries += 1
        wrong = try_application(path, load_dbc(path), node)
        result.applications += not wrong
        result.failed += [wrong] if wrong else []
    return result


def survey_folder(folder: Path) -> Iterator[FileResult]:
    """Every file of the kinds that can be read, in order of their names."""
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in SUFFIXES and path.is_file():
            yield survey_file(path, str(path.relative_to(folder)))


def commit_of(folder: Path) -> str:
    """The first 12 digits of the commit that is checked out there; "" where there is none."""
    command = ["git", "-C", str(folder), "rev-parse", "--short=12", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _summary(results: list[FileResult]) -> list[str]:
    read = [result for result in results if not result.error]
    messages = sum(result.messages for result in read)
    compiled = sum(result.compiled for result in read)
    return [
        str(len(results)),
        str(len(read)),
        str(messages),
        str(sum(result.signals for result in read)),
        f"{compiled} ({100 * compiled / messages:.1f} %)" if messages else "0",
        f"{sum(result.applications for result in read)} of {sum(result.tries for result in read)}",
        f"{max((result.share for result in read), default=0):.0f} %",
    ]


def _short(reason: str) -> str:
    return (reason if len(reason) <= _LONGEST_REASON else reason[:_LONGEST_REASON] + "…").replace("|", "\\|")


def _reasons(result: FileResult) -> str:
    if result.error:
        return _short(result.error)
    counted = Counter(_kind(reason) for reason in result.reasons)
    parts = [f"{number} x {kind}" for kind, number in counted.most_common()]
    return "; ".join([*parts, *map(_short, result.failed)])


_KINDS = {
    "does not fit": "does not fit",
    "needs more than 29 bits": "id of more than 29 bits",
    "have the same id": "id of another message",
    "is too long to be read": "a number too long to be read",
    "not clear by which multiplexer": "multiplexed by nobody knows what",
    "neither M nor m": "a multiplexer's mark without a number",
    "cannot be read here": "a line that cannot be read",
    "is a float of": "a float of another size",
    "at most 64 are possible": "a signal of more than 64 bits",
    "a container of others": "a container of others",
    "a value that signal": "a branch that its multiplexer cannot have",
}


def _kind(reason: str) -> str:
    return next((kind for part, kind in _KINDS.items() if part in reason), _short(reason))


def as_markdown(folders: dict[str, list[FileResult]]) -> str:
    """The tables of docs/dbc.md. `folders`: title -> its files."""
    head = ["collection", "files", "read", "messages", "signals", "in a codec", "applications", "left out at most"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    lines += [f"| {title} | {' | '.join(_summary(results))} |" for title, results in folders.items()]
    lines += ["", "What is not there:", "", "| file | messages | left out | why |", "|---|---|---|---|"]
    for results in folders.values():
        for result in results:
            lost = result.messages - result.compiled
            if lost or result.error or result.failed:
                lines.append(f"| {_short(result.name)} | {result.messages} | {lost} | {_reasons(result)} |")
    return "\n".join(lines) + "\n"
