# SPDX-License-Identifier: MIT
"""A bus description with its overlay, as everything that compiles or decodes reads it; and its attributes."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

from canopy.bus.dbc_parser import LONG_HELP, DbcParser, is_too_long, too_long
from canopy.bus.foreign import KINDS, read_foreign, refuse_kind
from canopy.bus.j1939 import set_masks
from canopy.bus.overlay import apply_overlay, overlay_path
from canopy.bus.soundness import check_source, name_apart
from canopy.bus.source import Given, Source, SourceMessage, SourceSignal
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.limits import Limits, whole
from canopy.compiler.numbers import exact
from canopy.files import FileError, read_bytes

MAX_BYTES = 16 * 1024 * 1024


@dataclass(frozen=True)
class Dbc:
    """A bus description as it was read, with its overlay, if it has one."""

    path: Path
    source: Source
    overlay: Path | None

    @property
    def messages(self) -> list[SourceMessage]:
        """Those of which there can be code."""
        return [message for message in self.source.messages if message.problem is None]

    @cached_property
    def _by_name(self) -> dict[str, SourceMessage]:
        """Of two messages of one name the first is good."""
        return {message.name: message for message in reversed(self.source.messages)}

    @property
    def left_out(self) -> list[CompileError]:
        """Why each message is left out that could not be taken, in the order of the file."""
        problems = [message.problem for message in self.source.messages]
        return [*self.source.problems, *(problem for problem in problems if problem is not None)]

    @property
    def names_left_out(self) -> frozenset[str]:
        """Names of the messages of which there can be no code."""
        return frozenset(message.name for message in self.source.messages if message.problem is not None)

    def unreadable(self, name: str) -> CompileError | None:
        """What is wrong with a statement that names a message, and that is none; None: there is no such statement."""
        word = re.compile(rf"(?<!\w){re.escape(name)}(?!\w)")
        return next((problem for problem in self.source.problems if word.search(problem.message)), None)

    def message(self, name: str) -> SourceMessage:
        """The message of that name.

        Raises:
            CompileError: it is left out, or there is none.
        """
        found = self._by_name.get(name)
        if found is not None and found.problem is not None:
            raise found.problem
        if found is not None:
            return found
        raise CompileError(
            Place(str(self.path)), f"no message '{name}'", nearest(name, (m.name for m in self.messages))
        )


def decode_dbc(data: bytes) -> str:
    """The text of a DBC: in UTF-8 if it is that, else in Windows-1252, in which most tools write DBCs.

    Bytes that stand for no character there can only be in texts of another encoding; they become U+FFFD.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_dbc(path: Path) -> bytes:
    """The bytes of a bus description.

    Raises:
        CompileError: it cannot be read, or is too large.
    """
    try:
        return read_bytes(path, MAX_BYTES)
    except FileError as error:
        raise CompileError(Place(str(path)), error.problem) from error


def bus_paths(path: Path) -> list[Path]:
    """The file and its overlay, if it has one. Together they describe the bus."""
    beside = overlay_path(path)
    return [path, beside] if beside.exists() else [path]


def read_bus_files(path: Path) -> dict[str, bytes]:
    """The same: name -> bytes. Raises CompileError where one cannot be read."""
    return {file.name: read_dbc(file) for file in bus_paths(path)}


def remove_old_overlay(target: Path, files: Mapping[str, bytes]) -> None:
    """When `files` with the copy `target` are written: an overlay of another run must not stay beside it."""
    old = overlay_path(target)
    if old.name not in files:
        old.unlink(missing_ok=True)


def hash_of(files: dict[str, bytes]) -> str:
    """16 hex digits that tell a file and its overlay from others."""
    return hashlib.sha256(b"".join(files.values())).hexdigest()[:16]


def load_text(text: str) -> Dbc:
    """A DBC that is a text, and no file; it has no overlay."""
    source = DbcParser("", text).source
    name_apart(source)
    set_masks(source)
    check_source(source)
    return Dbc(Path("text.dbc"), source, None)


def load_dbc(path: Path) -> Dbc:
    """Reads a bus description and its overlay. A message of which there can be no code is left out.

    Raises:
        CompileError: the file cannot be read, is no bus description, or the overlay is wrong.
    """
    source = _read_source(path)
    name_apart(source)
    overlay = apply_overlay(path, source)
    set_masks(source)
    for message in source.messages:  # a file need not list its nodes
        used = [*message.senders, *sorted(message.receivers)]
        source.nodes += [node for node in dict.fromkeys(used) if node not in source.nodes]
    source.messages = [message for message in source.messages if not message.is_left_out]
    check_source(source)
    return Dbc(path, source, overlay)


def _read_source(path: Path) -> Source:
    refuse_kind(path)
    text = decode_dbc(read_dbc(path))
    if path.suffix.lower() in KINDS:
        return read_foreign(path, text)
    parser = DbcParser(str(path), text)
    if not parser.is_dbc:
        raise CompileError(Place(str(path)), "not a DBC that can be read: it has no statement of one")
    return parser.source


def check_node(dbc: Dbc, node: str) -> None:
    """Raises CompileError when the bus has no such node."""
    if node not in dbc.source.nodes:
        help_text = f"{nearest(node, dbc.source.nodes)}; an overlay may name it as a sender or receiver"
        raise CompileError(Place(str(dbc.path)), f"no node '{node}'", help_text)


Owner = SourceMessage | SourceSignal


def given(dbc: Dbc, name: str, owner: Owner) -> Given | None:
    """An attribute: given on the object, else the file's default for it, else None."""
    return owner.attributes.get(name, dbc.source.defaults.get(name))


def _named(message: SourceMessage, signal: SourceSignal | None) -> str:
    return f"message '{message.name}'" if signal is None else f"signal '{message.name}.{signal.name}'"


def number(dbc: Dbc, name: str, message: SourceMessage, signal: SourceSignal | None = None) -> Fraction | None:
    """An attribute of a message, or of one of its signals, that is a number.

    Raises:
        CompileError: it is none, or too long to compute with.
    """
    found = given(dbc, name, message if signal is None else signal)
    if found is None or not found.value.strip():
        return None
    if is_too_long(found.value):
        raise CompileError(found.place, too_long(found.value.strip()), LONG_HELP)
    try:
        return exact(found.value)
    except ValueError:
        raise CompileError(
            found.place, f"attribute {name} of {_named(message, signal)} is {found.value!r}, and must be a number"
        ) from None


def attribute_place(dbc: Dbc, name: str, message: SourceMessage, signal: SourceSignal | None = None) -> Place:
    """The line that gives a message or signal the attribute, be it by default; else that of the object."""
    owner = message if signal is None else signal
    found = given(dbc, name, owner)
    return owner.place if found is None else found.place


def attribute(
    dbc: Dbc, name: str, limits: Limits, message: SourceMessage, signal: SourceSignal | None = None
) -> int | None:
    """An attribute that is a whole number, within limits.

    Raises:
        CompileError: it is not; with the line of the attribute.
    """
    value = number(dbc, name, message, signal)
    if value is None:
        return None
    return whole(value, limits, f"{name} of {_named(message, signal)}", attribute_place(dbc, name, message, signal))
