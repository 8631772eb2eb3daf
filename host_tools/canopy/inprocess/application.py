# SPDX-License-Identifier: MIT
"""A compiled application in this process, by the names of its DBC and its tree, in physical units."""

from __future__ import annotations

import ctypes
from collections.abc import Collection, Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

from cantools.database.can import Message, Signal

from canopy.compiler.errors import nearest
from canopy.files import FileError, read_bytes
from canopy.inprocess.library import DATA_MAX, NONE, EntryPlace, InProcessError, Library
from canopy.live.codes import Status
from canopy.model import ModelError, load_model
from canopy.signals import load_database, message_attribute

Value = int | float | str | Fraction


def _exact(number: float | None) -> Fraction:
    """The number as the DBC writes it: 0.1 is a tenth."""
    return Fraction(str(number))


class _Input:
    """A message that the application receives: its raw values, of which each tick gets a frame once one was set."""

    def __init__(self, message: Message, place: int) -> None:
        self.message = message
        self.place = place
        self.raw = {signal.name: _nearest_to_0(signal) for signal in message.signals}

    def data(self) -> bytes:
        return bytes(self.message.encode(self.raw, scaling=False, strict=False, padding=False))


def _nearest_to_0(signal: Signal) -> int | float:
    low, high = _raw_range(signal)
    return min(max(0, low), high) if low <= high else 0


def _raw_range(signal: Signal) -> tuple[int, int]:
    bits = signal.length
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signal.is_signed else (0, 2**bits - 1)
    if signal.is_float or signal.minimum is None or signal.maximum is None or signal.minimum >= signal.maximum:
        return low, high
    ends = [
        round((_exact(end) - _exact(signal.offset)) / _exact(signal.scale)) for end in (signal.minimum, signal.maximum)
    ]
    return max(low, min(ends)), min(high, max(ends))


def to_raw(signal: Signal, value: Value) -> int | float:
    """A physical value, or the name of one, as the signal's nearest raw value.

    Raises:
        InProcessError: It has no such name, or the value is outside the signal's range.
    """
    if isinstance(value, str):
        choices = {str(name): number for number, name in (signal.choices or {}).items()}
        if value not in choices:
            raise InProcessError(f"{signal.name} has no value '{value}'; {nearest(value, choices)}")
        return int(choices[value])
    if signal.is_float:
        return float(value)
    try:
        raw = round((Fraction(str(value)) - _exact(signal.offset)) / _exact(signal.scale))
    except ValueError:
        raise InProcessError(f"{signal.name} cannot be {value}") from None
    low, high = _raw_range(signal)
    if not low <= raw <= high and raw not in (signal.choices or {}):
        ends = [float(end * _exact(signal.scale) + _exact(signal.offset)) for end in (low, high)]
        raise InProcessError(f"{signal.name} cannot be {value}: its range is {min(ends):g} to {max(ends):g}")
    return raw


class Application:
    """One instance. What is set stays, and comes with every tick, until silence(). For one thread at a time.

    Attributes:
        library: The functions below it.
        model: What `canopy compile` tells of the application.
    """

    def __init__(self, model: Path, library: Path | None = None, *, trace: bool = False) -> None:
        """Loads an instance.

        Args:
            model: The model file, `NAME.model.json`.
            library: The shared library; None: `NAME.so` beside the model file.
            trace: Whether trace frames are made; they reach a world's tap only.

        Raises:
            InProcessError: A file is not there, or not what it should be, or the two do not belong together.
        """
        try:
            self.model = load_model(model, traced=False)
            database = load_database(self.model)
        except ModelError as error:
            raise InProcessError(str(error)) from error
        self.library = Library(library or model.with_name(f"{self.model.application}.so"), trace=trace)
        if self.library.nodes != len(self.model.nodes) or self.library.call["hash"]() != int(self.model.hash[:8], 16):
            raise InProcessError(f"{self.library.path}: is another build than {model}: build again")
        call = self.library.call
        self._inputs: dict[str, _Input] = {}
        self._outputs: dict[str, tuple[Message, int]] = {}
        for message in database.messages:
            if message.name in self.model.receive:
                place = call["receives"](message.frame_id, message.is_extended_frame)
                self._inputs[message.name] = _Input(message, self._known(place, message))
            if message.name in self.model.send:
                place = call["sends"](message.frame_id, message.is_extended_frame)
                self._outputs[message.name] = (message, self._known(place, message))
        self._entries = {entry.name: entry for entry in self.library.entries()}
        self._nodes: dict[str, list[int]] = {}
        self._name_nodes()

    def _name_nodes(self) -> None:
        self._nodes = {}
        for node in self.model.nodes:
            self._nodes.setdefault(node.name, []).append(node.index)

    def run_image(self, image: Path, model: Path) -> None:
        """Another tree: loads an image, and goes on with it. Every entry has its first value again.

        Args:
            image: Of `canopy image build` for this application.
            model: Its model file (`canopy image build --model`).

        Raises:
            InProcessError: One of them cannot be read, or the application rejects the image; then nothing is changed.
        """
        try:
            new, data = load_model(model, traced=False), read_bytes(image)
        except (ModelError, FileError) as error:
            raise InProcessError(f"{image}: {error}") from error
        self.library.run_image(data)
        if self.library.nodes != len(new.nodes):
            raise InProcessError(f"{model}: is not the model of {image}: it has {len(new.nodes)} nodes")
        self.model = new
        self._name_nodes()

    def _known(self, place: int, message: Message) -> int:
        if place == NONE:
            raise InProcessError(f"{self.library.path}: does not have message {message.name}: build again")
        return place

    def set(self, values: dict[str, Value], age: float = 0.0) -> None:
        """Sets input signals, by `Message.Signal`: physical values, names of values. Others of the message stay.

        Args:
            values: E.g. {"Battery.Level": 61.2, "Battery.Charging": 1}.
            age: Of the messages when a tick takes them [s].

        Raises:
            InProcessError: There is no such input, or a value is outside its range. Nothing was set.
        """
        news = []
        for name, value in values.items():
            message, signal = self._signal(name, {key: one.message for key, one in self._inputs.items()}, "input")
            news.append((message, signal.name, to_raw(signal, value)))
        for message, signal_name, raw in news:
            self._inputs[message].raw[signal_name] = raw
        for message in {one[0] for one in news}:
            self._put(message, age)

    def _put(self, name: str, age: float) -> None:
        one = self._inputs[name]
        data = one.data()
        length = _frame_length(len(data), one.message.is_fd)
        error = self.library.call["put"](one.place, data.ljust(length, b"\0"), length, round(age * 1e6))
        if error != 0:
            raise InProcessError(f"{name}: the application takes frames of another length: build again")
        self.library.call["hold"](one.place, True)

    def silence(self, *messages: str) -> None:
        """These messages come no more, until one of their signals is set again; without names: none of them."""
        for name in messages or self._inputs:
            if name not in self._inputs:
                raise InProcessError(f"no input message '{name}'; {nearest(name, self._inputs)}")
            self.library.call["hold"](self._inputs[name].place, False)

    def tick(self, ticks: int = 1, until: Iterable[Status] = ()) -> Status:
        """Makes `ticks` ticks, fewer when the root has a status of `until` after one. Gives the root's status."""
        self.run(ticks, until)
        return self.root

    def run(self, ticks: int, until: Iterable[Status] = ()) -> int:
        """As tick(); gives how many were made. The loop is in C, and Python's lock is free meanwhile."""
        if not 0 <= ticks < 2**63:
            raise InProcessError(f"{ticks} is not a number of ticks")
        mask = sum(1 << status for status in set(until))
        return int(self.library.call["run"](ticks, mask))

    @property
    def root(self) -> Status:
        """What the root returned last."""
        return Status(self.library.call["root"]())

    def watch(self) -> None:
        """From now on seen() collects; what was collected before is forgotten."""
        self.library.watch()

    def seen(self, node: str | int) -> frozenset[Status]:
        """Every status that a node has had after a tick since watch(), also where its parent has reset it."""
        bits = self.library.seen()[self.index(node)]
        return frozenset(status for status in Status if status >= 0 and bits >> status & 1)

    @property
    def now(self) -> float:
        """Time of the next tick [s], from 0."""
        return int(self.library.call["now"]()) / 1e6

    @now.setter
    def now(self, seconds: float) -> None:
        if self.library.call["set_now"](round(seconds * 1e6)) != 0:
            raise InProcessError(f"the clock is at {self.now} s, and cannot go back to {seconds} s")

    @property
    def faults(self) -> int:
        """Leaves that returned no valid status so far."""
        return int(self.library.call["faults"]())

    @property
    def rejected(self) -> int:
        """Frames that the application has rejected so far."""
        return int(self.library.call["rejected"]())

    def halt(self) -> None:
        """Halts the whole tree."""
        self.library.call["halt"]()

    def output(self, name: str) -> float | int | str:
        """An output signal, by `Message.Signal`, as the output image has it after the last tick.

        Returns:
            The name of the value where the DBC gives it one, else the physical value.

        Raises:
            InProcessError: There is no such output.
        """
        message_name, signal = self._signal(name, {key: one[0] for key, one in self._outputs.items()}, "output")
        return self.outputs(message_name)[signal.name]

    def outputs(self, message: str) -> dict[str, float | int | str]:
        """All signals of a message that the application sends, as output() gives them, but those of E2E.

        Raises:
            InProcessError: There is no such message.
        """
        if message not in self._outputs:
            raise InProcessError(f"no output message '{message}'; {nearest(message, self._outputs)}")
        described, place = self._outputs[message]
        data = ctypes.create_string_buffer(DATA_MAX)
        length = _frame_length(described.length, described.is_fd)
        if self.library.call["read"](place, data, length) != 0:
            raise InProcessError(f"{message}: the application sends frames of another length: build again")
        decoded = described.decode_simple(data.raw[: described.length], allow_truncated=True)
        hidden = {"E2E_CRC", "E2E_Counter"} if message_attribute(described, "E2EDataId", -1) >= 0 else set()
        values: dict[str, Any] = {key: value for key, value in decoded.items() if key not in hidden}
        return {key: str(value) if hasattr(value, "name") else value for key, value in values.items()}

    def entry(self, name: str) -> int | float | bool | str:
        """An entry of the blackboard, by its name with the path of its subtree before it.

        Returns:
            The value; of fixed point the physical one.

        Raises:
            InProcessError: There is no such entry, or it has a type that is not a number or a text.
        """
        place = self._entry(name)
        raw = _ctype(place).from_address(place.address).value
        if place.kind == "t":
            return self.library.text(int(raw))
        if place.step != "1":
            return float(Fraction(place.step) * int(raw))
        value: int | float | bool = raw
        return value

    def set_entry(self, name: str, value: int | float | bool) -> None:
        """Writes an entry between two ticks; of fixed point the physical value.

        Raises:
            InProcessError: There is no such entry, it is not a number, or the value does not fit.
        """
        place = self._entry(name)
        if place.kind == "t":
            raise InProcessError(f"entry '{name}' holds a text of the tree, and only leaves write those")
        cell = _ctype(place).from_address(place.address)
        before = cell.value
        raw: int | float | bool | None = value
        if place.kind in "iu":
            steps = Fraction(str(value)) / Fraction(place.step)
            raw = steps.numerator if steps.denominator == 1 else None
        if raw is not None:
            cell.value = raw
        if raw is None or (place.kind != "f" and cell.value != raw):
            cell.value = before
            raise InProcessError(f"entry '{name}' is {place.type} in steps of {place.step}, and cannot be {value}")

    @property
    def entries(self) -> Collection[str]:
        """The names of all entries."""
        return self._entries.keys()

    def _entry(self, name: str) -> EntryPlace:
        if name not in self._entries:
            raise InProcessError(f"no entry '{name}'; {nearest(name, self._entries)}")
        return self._entries[name]

    def status(self, node: str | int) -> Status:
        """The status of a node after the last tick, by its name or index; IDLE when its parent has reset it.

        Raises:
            InProcessError: No node has the name, or several have.
        """
        return Status(self.library.call["status"](self.index(node), False))

    def last_status(self, node: str | int) -> Status:
        """As status(), but of a node that its parent has reset what it returned before: RUNNING when it was halted."""
        return Status(self.library.call["status"](self.index(node), True))

    def index(self, node: str | int) -> int:
        """The index of a node. Raises InProcessError: no node has the name, or several have."""
        if isinstance(node, int):
            if not 0 <= node < len(self.model.nodes):
                raise InProcessError(f"no node {node}; the tree has {len(self.model.nodes)}")
            return node
        found = self._nodes.get(node, [])
        if len(found) != 1:
            way_out = f"give one of the indices {found}" if found else nearest(node, self._nodes)
            raise InProcessError(f"{len(found) or 'no'} nodes have the name '{node}'; {way_out}")
        return found[0]

    def _signal(self, name: str, messages: dict[str, Message], what: str) -> tuple[str, Signal]:
        message_name, _, signal_name = name.partition(".")
        message = messages.get(message_name)
        if message is None:
            raise InProcessError(f"no {what} message '{message_name}'; {nearest(message_name, messages)}")
        for signal in message.signals:
            if signal.name == signal_name:
                return message_name, signal
        known = [signal.name for signal in message.signals]
        raise InProcessError(f"message '{message_name}' has no signal '{signal_name}'; {nearest(signal_name, known)}")


def _frame_length(length: int, is_fd: bool) -> int:
    """Bytes of the frame that holds so many: CAN FD has steps."""
    return next(size for size in (*range(9), 12, 16, 20, 24, 32, 48, 64) if size >= length) if is_fd else length


def _ctype(place: EntryPlace) -> Any:
    if place.kind == "b":
        return ctypes.c_bool
    if place.kind == "f":
        return ctypes.c_float if place.size == ctypes.sizeof(ctypes.c_float) else ctypes.c_double
    if place.kind in "iut":
        return getattr(ctypes, f"c_{'u' if place.kind in 'ut' else ''}int{8 * place.size}")
    raise InProcessError(f"entry '{place.name}' is a {place.type}, which is neither a number nor a text")
