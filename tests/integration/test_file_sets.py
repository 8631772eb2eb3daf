# SPDX-License-Identifier: MIT
"""What the tools write is the old set of files or the new one, wherever they are stopped."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import count, product
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.files import write_files
from canopy.model import ModelError, load_model
from canopy.signals import load_bus
from canopy.watch import Watch
from integration.language import ROOT, WARNINGS
from integration.test_files import TREE, model

pytestmark = pytest.mark.timeout(120)

OLD, NEW = "FAILURE", "SUCCESS"


def source(folder: Path, kind: str) -> list[str]:
    """The arguments to compile a tree; both kinds give other C in every file."""
    stale = f'<Metadata reads="Climate" stale="{kind}"/>'
    leaf = f'<Condition ID="IsWarm{kind}"><MetadataFields>{stale}</MetadataFields></Condition>'
    (folder / "room.xml").write_text(TREE.format(f"<IsWarm{kind}/>", f"<TreeNodesModel>{leaf}</TreeNodesModel>"))
    name = "Celsius" if kind == OLD else "Kelvin"
    (folder / "room.dbc").write_text(
        'VERSION ""\nBU_: Controller B\nBO_ 256 Climate: 2 B\n'
        f' SG_ {name} : 0|16@1- (0.1,0) [-40|120] "{name}" Controller\n'
        'BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;\nBA_DEF_DEF_ "GenMsgCycleTime" 100;\n'
    )
    return ["compile", str(folder / "room.xml"), "--dbc", str(folder / "room.dbc"), "--node", "Controller",
            "--period-ms", "100", "-o", str(folder / "out"), "--depfile", str(folder / "out" / "room.d")]  # fmt: skip


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "out").iterdir())}


def compiles(folder: Path) -> bool:
    """Do all C files of the set compile?"""
    include = [f"-I{ROOT / 'runtime' / 'include'}", f"-I{folder / 'out'}"]
    files = sorted((folder / "out").glob("*.c"))
    command = ["gcc", "-std=c11", *WARNINGS, *include, "-fsyntax-only", *map(str, files)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.fixture
def sets(tmp_path: Path) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """The old set, and the new one; the old one is there, and the sources are the new ones."""
    made = []
    for kind in (NEW, OLD):
        result = CliRunner().invoke(main, source(tmp_path, kind))
        assert result.exit_code == 0, result.output
        assert compiles(tmp_path)
        made.append(content(tmp_path))
    source(tmp_path, NEW)
    return made[1], made[0]


def test_files_of_two_runs_do_not_compile_together(tmp_path: Path, sets: tuple[dict[str, bytes], ...]) -> None:
    old, new = sets
    names = [name for name in old if name.endswith((".c", ".h"))]
    assert len(names) == 5
    for chosen in product((old, new), repeat=len(names)):
        for name, kind in zip(names, chosen, strict=True):
            (tmp_path / "out" / name).write_bytes(kind[name])
        assert compiles(tmp_path) == (all(kind is old for kind in chosen) or all(kind is new for kind in chosen))


@pytest.mark.parametrize("call", ["write", "fsync", "replace", "link", "fchmod", "open"])
def test_an_error_at_any_step_leaves_the_old_set(
    tmp_path: Path, sets: tuple[dict[str, bytes], ...], call: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new = sets
    for failing in count(1):
        with monkeypatch.context() as patch:
            calls = _fail_at(patch, call, failing)
            result = CliRunner().invoke(main, source(tmp_path, NEW))
        if len(calls) < failing:
            break
        assert isinstance(result.exception, SystemExit) and result.exit_code == 2, (failing, result.exception)
        assert "cannot be written: No space left on device" in result.stderr
        assert content(tmp_path) == old, failing
    assert failing > 8
    assert content(tmp_path) == new


def _fail_at(patch: pytest.MonkeyPatch, call: str, failing: int) -> list[object]:
    """The call number `failing` of canopy.files has no room on the disk; returns the list of all calls."""
    calls: list[object] = []
    name = "fdopen" if call == "write" else call
    real = getattr(os, name)

    def fake(*arguments: object, **more: object) -> object:
        target = str(arguments[0])
        if call == "open" and ".canopy-" not in target:
            return real(*arguments, **more)
        if call == "write" and arguments[1:2] != ("wb",):
            return real(*arguments, **more)
        calls.append(arguments)
        if len(calls) == failing:
            if call == "write":
                os.close(arguments[0])  # type: ignore[arg-type]
            raise OSError(28, "No space left on device")
        return real(*arguments, **more)

    patch.setattr(f"os.{name}", fake)
    return calls


KILLED = """
import os, sys
from canopy.cli import main
left = int(sys.argv[1])
def count(real):
    def counted(*arguments, **more):
        global left
        left -= 1
        if left == 0:
            os.kill(os.getpid(), 9)
        return real(*arguments, **more)
    return counted
for name in ("replace", "link", "fsync"):
    setattr(os, name, count(getattr(os, name)))
main(sys.argv[2:])
"""


def test_a_program_that_is_killed_at_any_step_leaves_no_set_of_both(
    tmp_path: Path, sets: tuple[dict[str, bytes], ...]
) -> None:
    """At each step: the old set, the new one, or files that do not compile; and the next run makes the new set."""
    old, new = sets
    seen = set()
    for step in count(1):
        for name, data in old.items():
            (tmp_path / "out" / name).write_bytes(data)
        arguments = source(tmp_path, NEW)
        result = subprocess.run([sys.executable, "-c", KILLED, str(step), *arguments], capture_output=True, check=False)
        if result.returncode == 0:
            break
        assert result.returncode == -9, result.stderr
        left = {name: data for name, data in content(tmp_path).items() if not name.startswith(".canopy-")}
        assert sorted(left) == sorted(old)
        kind = "old" if left == old else "new" if left == new else "mixed"
        seen.add(kind)
        c_files = [name for name in old if name.endswith((".c", ".h"))]
        whole = any(all(left[name] == one[name] for name in c_files) for one in sets)
        assert compiles(tmp_path) == whole, step
        # A build looks at this file: it is the last to be new, so that the next build makes all of them again.
        assert left["room_app.c"] == old["room_app.c"] or left == new, step
        for name in content(tmp_path).keys() - old.keys():
            (tmp_path / "out" / name).unlink()
    assert seen == {"old", "new", "mixed"}
    assert content(tmp_path) == new


def test_a_full_disk_leaves_the_old_set(tmp_path: Path, sets: tuple[dict[str, bytes], ...]) -> None:
    old, new = sets
    for room in range(0, max(map(len, new.values())), 500):
        limit = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, {room})); "
        program = limit + "import sys; from canopy.cli import main; main(sys.argv[1:])"
        arguments = source(tmp_path, NEW)
        result = subprocess.run(
            [sys.executable, "-B", "-c", program, *arguments], capture_output=True, text=True, check=False
        )
        assert result.returncode == 2 and "cannot be written: File too large" in result.stderr, (room, result.stderr)
        assert content(tmp_path) == old


def test_what_must_be_new_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "b").write_text("mine")
    with pytest.raises(FileExistsError):
        write_files({tmp_path / "a": b"1", tmp_path / "b": b"2"}, new=[tmp_path / "b"])
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"b": "mine"}


def test_the_tools_refuse_a_model_and_a_dbc_of_two_runs(tmp_path: Path) -> None:
    path = model(tmp_path)
    assert load_bus(load_model(path)) is not None
    with (tmp_path / "nao.dbc").open("a") as file:
        file.write("\n")
    with pytest.raises(ModelError, match=r"is not what room\.model\.json was written with"):
        Watch(load_model(path))
