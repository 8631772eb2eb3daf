# SPDX-License-Identifier: MIT
"""Files of others are read with bounds, and files of ours are written as a set: all of them, or none.

A path may name a folder, a FIFO that nobody writes to, or a device without an end: only a file is read.
"""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

LARGEST = 16 * 1024 * 1024
"""Bytes that are read of a text."""

_KINDS = {
    stat.S_IFIFO: "is a FIFO, not a file",
    stat.S_IFCHR: "is a device, not a file",
    stat.S_IFBLK: "is a device, not a file",
    stat.S_IFSOCK: "is a socket, not a file",
}

_NONE = (errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG)


class FileError(Exception):
    """A file cannot be read or written; `problem` says why, without the file's name. `missing`: there is none."""

    def __init__(self, path: Path, problem: str, *, missing: bool = False) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = path
        self.problem = problem
        self.missing = missing


def check_name(path: Path) -> None:
    """Refuses a name that is not UTF-8: it could not be written into C, JSON or a rule for make.

    Raises:
        FileError: it is not.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise FileError(path, "the file's name is not UTF-8; rename it") from None


def read_bytes(path: Path, largest: int = LARGEST) -> bytes:
    """All bytes of a file.

    Raises:
        FileError: it cannot be read, is no file, is larger than `largest`, or has a name that is not UTF-8.
    """
    check_name(path)
    try:
        # O_NONBLOCK: to open a FIFO waits for a writer.
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        with os.fdopen(handle, "rb") as file:
            status = os.fstat(handle)
            kind = _KINDS.get(stat.S_IFMT(status.st_mode))
            if kind is not None:
                raise FileError(path, f"cannot be read: {kind}")
            data = file.read(largest + 1) if status.st_size <= largest else b""
            size = max(status.st_size, len(data))
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        code = error.errno if isinstance(error, OSError) else None
        problem = os.strerror(code) if code else str(error)
        raise FileError(path, f"cannot be read: {problem}", missing=code in _NONE) from error
    if size > largest:
        raise FileError(path, f"the file has {size} bytes; at most {largest} are read")
    return data


def read_text(path: Path, largest: int = LARGEST) -> str:
    """The text of a file in UTF-8.

    Raises:
        FileError: as read_bytes(), or it is not UTF-8.
    """
    data = read_bytes(path, largest)
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise FileError(path, f"line {line}: byte 0x{data[error.start]:02x} is not UTF-8; save it as UTF-8") from None


def check_file(path: Path) -> None:
    """For files that a library opens, and that are as large as they are.

    Raises:
        FileError: it is there and no file: a folder, a FIFO, a device.
    """
    check_name(path)
    kind = _KINDS.get(stat.S_IFMT(path.stat().st_mode)) if path.exists() else None
    if kind is not None:
        raise FileError(path, kind)


class _Replacement:
    """Files beside their targets, and what brings back the old ones."""

    def __init__(self) -> None:
        self.staged: list[tuple[Path, Path]] = []
        self.replaced: list[tuple[Path, Path | None]] = []

    def stage(self, path: Path, content: bytes, mode: int) -> None:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".canopy-")
        self.staged.append((Path(name), path))
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fchmod(handle, mode)
            os.fsync(handle)

    def commit(self, temporary: Path, path: Path, is_new: bool) -> None:
        if is_new:
            os.link(temporary, path)  # unlike rename, it never replaces
            self.replaced.append((path, None))
            return
        backup = temporary.with_name(f"{temporary.name}.old")
        try:
            os.link(path, backup)
        except FileNotFoundError:
            self.replaced.append((path, None))
        except OSError as error:
            if error.errno not in (errno.EPERM, errno.ENOTSUP):  # a file system without hard links
                raise
            self.replaced.append((path, backup))
            os.replace(path, backup)
        else:
            self.replaced.append((path, backup))
        os.replace(temporary, path)

    def undo(self) -> None:
        for path, backup in reversed(self.replaced):
            if backup is None:
                path.unlink(missing_ok=True)
            else:
                os.replace(backup, path)

    def clean(self) -> None:
        for leftover in [*(temporary for temporary, _ in self.staged), *(old for _, old in self.replaced if old)]:
            leftover.unlink(missing_ok=True)


def write_files(files: Mapping[Path, bytes], new: Collection[Path] = (), mode: int = 0o644) -> None:
    """Writes all files, or leaves all as they were; the folders are there. Renames in the order given.

    All bytes are on the disk before the first file is replaced. Where the machine or the program dies between two
    renames, the files before are new and those behind are old: generated C does not compile then.

    Args:
        files: The content of each file.
        new: Those of them that must not be there yet.
        mode: The files' permissions.

    Raises:
        FileExistsError: one of `new` is there.
        OSError: one cannot be written.
        FileError: a file's name is not UTF-8.
    """
    work = _Replacement()
    protected = {path.absolute() for path in new}
    try:
        for path, content in files.items():
            check_name(path)
            with _about(path):
                work.stage(_target(path), content, mode)
        for temporary, path in work.staged:
            with _about(path):
                work.commit(temporary, path, path.absolute() in protected)
    except BaseException:
        work.undo()
        raise
    finally:
        work.clean()
    for folder in {path.parent for path in files}:
        _sync_folder(folder)


def _target(path: Path) -> Path:
    """What is replaced: the file, or the one that a link leads to; never a device, whose name would go.

    Raises:
        FileError: it is no file.
    """
    target = path.resolve() if path.is_symlink() else path
    check_file(target)
    return target


@contextmanager
def _about(path: Path) -> Iterator[None]:
    """An error names the file that was to be written, not the temporary one beside it."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _sync_folder(folder: Path) -> None:
    """The renames, too, are on the disk; not every file system has that."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)
