# SPDX-License-Identifier: MIT
"""The files that the guest reads when it boots: its first process, what to mount, and the command."""

import os
import shlex
import shutil
import socket
from collections.abc import Sequence
from pathlib import Path

from vcan_rig import RigError
from vcan_rig.options import Options

# What an ordinary user's command may do in the guest: set up interfaces, raw sockets, real-time priority, lock memory.
CAPABILITIES = "+net_admin,+net_raw,+sys_nice,+ipc_lock,+sys_resource"


def _is_within(path: Path, folders: list[Path]) -> bool:
    return any(path == folder or folder in path.parents for folder in folders)


def writable_folders(options: Options) -> list[Path]:
    """The current folder and --rw, without those that lie in another one.

    Raises:
        RigError: a path that cannot be written in a mount option.
    """
    kept: list[Path] = []
    for path in sorted(
        {folder.resolve() for folder in [Path.cwd(), *options.rw]}, key=lambda folder: len(folder.parts)
    ):
        if "," in str(path) or "\n" in str(path):
            raise RigError(f"a folder whose path has a comma or a line end cannot be kept writable: {path}")
        if path != Path("/") and not _is_within(path, kept):
            kept.append(path)
    return kept


def readable_folders(options: Options, hidden: list[Path], writable: list[Path]) -> list[Path]:
    """Folders under hidden ones that the command will want: of its programs, libraries, and absolute arguments."""
    wanted = [*options.ro, Path(os.environ.get("HOME", "/")), Path(os.environ.get("VIRTUAL_ENV", "/"))]
    for variable in ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "CLASSPATH"):
        wanted += [Path(entry) for entry in os.environ.get(variable, "").split(":") if entry]
    program = shutil.which(options.command[0])
    if program:
        wanted.append(Path(program).resolve().parent)
    for argument in options.command:
        if argument.startswith("/"):
            wanted.append(Path(argument) if os.path.isdir(argument) else Path(argument).parent)
    kept: list[Path] = []
    for path in sorted((folder.resolve() for folder in wanted), key=lambda folder: len(folder.parts)):
        under_hidden = any(folder in path.parents for folder in hidden)
        if under_hidden and path.is_dir() and not _is_within(path, writable + kept) and "," not in str(path):
            kept.append(path)
    return kept


def _settings(options: Options) -> str:
    hidden = [Path(folder) for folder in options.hide.split(",") if folder and Path(folder).is_dir()]
    writable = writable_folders(options)
    values: dict[str, Sequence[object]] = {
        "INTERFACES": options.iface,
        "HIDDEN": hidden,
        "WRITABLE": writable,
        "READABLE": readable_folders(options, hidden, writable),
        "HOST": [socket.gethostname()],
    }
    return "".join(f"{name}={shlex.quote(chr(10).join(map(str, lines)))}\n" for name, lines in values.items())


def _command(options: Options) -> str:
    left_out = ("TMPDIR", "TMP", "TEMP")  # they name folders of the host, which the guest may not see
    environment = [f"{name}={value}" for name, value in os.environ.items() if name not in left_out]
    words = ["env", "-i", *environment, "WITH_VCAN=uml", *options.command]
    if options.as_caller and os.getuid() != 0:
        groups = ",".join(map(str, os.getgroups() or [os.getgid()]))
        ids = ["--reuid", str(os.getuid()), "--regid", str(os.getgid()), "--groups", groups]
        words = ["setpriv", *ids, "--inh-caps", CAPABILITIES, "--ambient-caps", CAPABILITIES, *words]
    mask = os.umask(0)
    os.umask(mask)
    return (
        "echo $$ >/run/with-vcan/pid\n"
        f"cd {shlex.quote(str(Path.cwd()))} || exit 126\n"
        f"umask {mask:04o}\n"
        f"exec {shlex.join(words)}\n"
    )


def write_files(state: Path, options: Options, stdin: bytes) -> None:
    """Writes the files into the folder `state`; `stdin` is what the command reads from standard input.

    Raises:
        RigError: the command cannot be run as asked.
    """
    init = state / "init"
    shutil.copyfile(Path(__file__).with_name("guest-init"), init)
    init.chmod(0o755)
    # Arguments and environment may be no valid text: they pass as they are.
    (state / "settings").write_text(_settings(options), errors="surrogateescape")
    (state / "command").write_text(_command(options), errors="surrogateescape")
    (state / "stdin").write_bytes(stdin)
