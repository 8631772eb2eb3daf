# SPDX-License-Identifier: MIT
"""The shared library of an application (cmake/CanopyInProcess.cmake); each load is an instance of its own.

An application's memory is one static object. So each Library loads a copy of the file: the loader knows a library by
its file, and gives each its own memory. Copies are removed as soon as they are loaded.
"""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

VERSION = 1
"""Of the functions in drivers/in_process/library.c."""

NONE = 0xFFFF
"""CANOPY_IN_PROCESS_NONE."""

DATA_MAX = 64
"""Bytes of a frame."""


class InProcessError(Exception):
    """An application cannot be run in this process, or has no such signal, entry or node; the text says the way out."""


class _CEntry(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p),
        ("type", ctypes.c_char_p),
        ("step", ctypes.c_char_p),
        ("size", ctypes.c_uint32),
        ("address", ctypes.c_void_p),
        ("kind", ctypes.c_char),
    )


@dataclass(frozen=True)
class EntryPlace:
    """An entry of the blackboard in the application's memory. `kind` is that of canopy_in_process_entry_t."""

    name: str
    type: str
    step: str
    size: int
    address: int
    kind: str


_U32, _U64, _BOOL, _INT = ctypes.c_uint32, ctypes.c_uint64, ctypes.c_bool, ctypes.c_int
_BYTES = ctypes.c_char_p
_FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "version": (_U32, ()),
    "name": (ctypes.c_char_p, ()),
    "period": (_U64, ()),
    "hash": (_U32, ()),
    "nodes": (_U32, ()),
    "open": (_INT, (_BOOL,)),
    "receives": (_U32, (_U32, _BOOL)),
    "sends": (_U32, (_U32, _BOOL)),
    "put": (_INT, (_U32, _BYTES, _U32, _U64)),
    "hold": (_INT, (_U32, _BOOL)),
    "read": (_INT, (_U32, _BYTES, _U32)),
    "run": (_U64, (_U64, _U32)),
    "root": (_U32, ()),
    "now": (_U64, ()),
    "set_now": (_INT, (_U64,)),
    "faults": (_U32, ()),
    "rejected": (_U32, ()),
    "statuses": (ctypes.c_void_p, ()),
    "status": (_INT, (_U32, _BOOL)),
    "halt": (None, ()),
    "watch": (None, (ctypes.c_void_p,)),
    "run_image": (_INT, (_BYTES, ctypes.c_size_t)),
    "entry": (ctypes.c_void_p, (_U32, ctypes.POINTER(_CEntry))),
}


def _load(path: Path) -> ctypes.CDLL:
    with tempfile.NamedTemporaryFile(suffix=".so") as copy:
        try:
            with path.open("rb") as original:
                shutil.copyfileobj(original, copy)
            copy.flush()
            return ctypes.CDLL(copy.name)
        except OSError as error:
            raise InProcessError(
                f"{path}: cannot be loaded: {error}; canopy_add_in_process() in CMake makes it (docs/in-process.md)"
            ) from error


class Library:
    """One instance of an application: the functions of drivers/in_process/library.c. For one thread at a time."""

    def __init__(self, path: Path, *, trace: bool = False) -> None:
        """Loads a copy and sets the application up, as after a reset; its clock is at 0.

        Args:
            path: The shared library.
            trace: Whether it makes trace frames, which nobody reads here, but which take their time.

        Raises:
            InProcessError: The file is not there, or not such a library.
        """
        self.path = path
        self._library = _load(path)
        self.call: dict[str, Any] = {}
        for name, (result, arguments) in _FUNCTIONS.items():
            self.call[name] = self.function(f"canopy_library_{name}", result, *arguments)
        version = self.call["version"]()
        if version != VERSION:
            raise InProcessError(f"{path}: has interface {version}, and these tools want {VERSION}: build it again")
        error = self.call["open"](trace)
        if error != 0:
            raise InProcessError(f"{path}: the application's tables are not complete: error {error}")
        self.nodes = 0
        self._look_at_tree()

    def _look_at_tree(self) -> None:
        self.nodes = int(self.call["nodes"]())
        self._statuses = (ctypes.c_uint8 * self.nodes).from_address(self.call["statuses"]())
        self._seen: Any = None

    def function(self, name: str, result: Any, *arguments: Any) -> Any:
        """A function of the library, a world's own one for example, with its ctypes.

        Raises:
            InProcessError: It has none of that name.
        """
        try:
            found = getattr(self._library, name)
        except AttributeError:
            raise InProcessError(
                f"{self.path}: has no function {name}: was it made with canopy_add_in_process()?"
            ) from None
        found.restype, found.argtypes = result, list(arguments)
        return found

    def statuses(self) -> bytes:
        """A byte per node, as the engine keeps its status (canopy/status_code.h), in depth-first order."""
        return bytes(self._statuses)

    def watch(self) -> None:
        """From now on collects what each node has been; forgets what it has collected."""
        self._seen = (ctypes.c_uint8 * self.nodes)()
        self.call["watch"](self._seen)

    def seen(self) -> bytes:
        """A byte per node since watch(): bit s is set once the node has had status s."""
        return bytes(self._seen) if self._seen is not None else bytes(self.nodes)

    def run_image(self, image: bytes) -> None:
        """Loads a tree image, and lets its tree begin in the place of the one that runs (docs/image.md).

        Raises:
            InProcessError: The application takes no images, or not this one.
        """
        error = self.call["run_image"](image, len(image))
        if error != 0:
            raise InProcessError(
                f"{self.path}: the image is rejected with error {error}: it must be built for this application, which "
                "must have IMAGE_NODES; canopy_add_in_process() needs IMAGE"
            )
        self._look_at_tree()

    def entries(self) -> list[EntryPlace]:
        """The blackboard's entries."""
        found: list[EntryPlace] = []
        entry = _CEntry()
        while self.call["entry"](len(found), ctypes.byref(entry)):
            texts = (entry.name.decode(), entry.type.decode(), entry.step.decode())
            found.append(EntryPlace(*texts, entry.size, entry.address, entry.kind.decode()))
        return found

    def text(self, place: int) -> str:
        """A text of the tree, by its place in the table of texts; what lies outside is the empty one."""
        count = _U32.in_dll(self._library, "canopy_in_process_text_count").value
        if place >= count:
            return ""
        table = ctypes.POINTER(ctypes.c_char_p).in_dll(self._library, "canopy_in_process_texts")
        value = table[place]
        return "" if value is None else value.decode()
