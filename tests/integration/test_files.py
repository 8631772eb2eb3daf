# SPDX-License-Identifier: MIT
"""No file hangs the tools or brings a traceback."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from canopy.files import FileError, read_bytes, read_text
from integration.language import DBC, ROOT

HEAD = '<root BTCPP_format="4" main_tree_to_execute="Main">'
TREE = HEAD + '<BehaviorTree ID="Main">{}</BehaviorTree>{}</root>'
ROOM = ROOT / "tests" / "golden" / "cooler.xml"
MEGABYTE = 1_000_000

pytestmark = pytest.mark.timeout(120)


def canopy(*arguments: str | bytes | Path, seconds: float = 30, **more: object) -> subprocess.CompletedProcess[bytes]:
    """The command as a process; a test fails when it hangs."""
    command = [sys.executable, "-m", "canopy", *arguments]
    return subprocess.run(command, capture_output=True, timeout=seconds, check=False, **more)  # type: ignore[call-overload,no-any-return]


def commands(file: str | bytes | Path) -> dict[str, list[str | bytes | Path]]:
    """Every command that reads a file, with this one."""
    more = ["--node", "Controller", "--period-ms", "10"]
    return {
        "tree": ["compile", file, "--dbc", DBC, *more, "-o", "out", "--name", "x"],
        "dbc": ["compile", "main.xml", "--dbc", file, *more, "-o", "out"],
        "codec": ["codec", file, "-o", "out"],
        "check": ["check", file],
        "check --dbc": ["check", "main.xml", "--dbc", file, "--node", "Controller"],
        "show": ["show", file],
        "fmt": ["fmt", "--check", file],
        "image build": ["image", "build", "main.xml", "--for", file, "-o", "out.img"],
        "image show": ["image", "show", file],
        "monitor": ["monitor", "--model", file, "--can", "unixbus:x", "--duration", "1"],
        "bridge": ["bridge", "--model", file, "--can", "unixbus:x", "--duration", "1"],
        "record": ["record", "--model", file, "--can", "unixbus:x", "-o", "a.log", "--duration", "1"],
        "replay": ["replay", file, "--model", "room.model.json", "--program", "x"],
    }


KINDS: dict[str, Callable[[Path], object]] = {
    "a FIFO": os.mkfifo,
    "a folder": Path.mkdir,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a link to itself": lambda path: path.symlink_to(path.name),
    "nothing": lambda _: None,
    "not UTF-8": lambda path: path.write_bytes(b'<root a="\x81\xff">\x81</root>'),
}


@pytest.mark.parametrize(("command", "kind"), list(product(commands(""), KINDS)))
def test_what_is_no_file_of_text_is_an_error(tmp_path: Path, command: str, kind: str) -> None:
    (tmp_path / "main.xml").write_text(TREE.format("<AlwaysSuccess/>", ""))
    suffix = ".log" if command == "replay" else ".xml"
    model(tmp_path)
    KINDS[kind](tmp_path / f"input{suffix}")
    result = canopy(*commands(f"input{suffix}")[command], cwd=tmp_path)
    assert result.returncode in (1, 2), result.stdout
    assert b"Traceback" not in result.stderr and result.stderr.count(b"input.") >= 1, result.stderr
    assert not (tmp_path / "out").exists()


def model(folder: Path) -> Path:
    """A model file and its DBC, for the commands that want one."""
    nao = ROOT / "examples" / "nao"
    arguments = ["compile", str(nao / "trees" / "get_home.xml"), "--dbc", str(nao / "nao.dbc"), "--node", "Controller"]
    made = folder / "made"
    result = CliRunner().invoke(
        main, [*arguments, "--period-ms", "50", "--trace", "0x600", "--name", "room", "-o", str(made)]
    )
    assert result.exit_code == 0, result.output
    for name in ("room.model.json", "nao.dbc"):
        shutil.copy(made / name, folder / name)
    return folder / "room.model.json"


@pytest.mark.parametrize("command", commands(""))
def test_a_name_that_is_not_utf8_is_an_error(tmp_path: Path, command: str) -> None:
    suffix = {"replay": b".log", "dbc": b".dbc", "codec": b".dbc", "check --dbc": b".dbc"}.get(command, b".xml")
    name = b"in\xffput" + suffix
    (tmp_path / "main.xml").write_text(TREE.format("<AlwaysSuccess/>", ""))
    model(tmp_path)
    with open(os.fsencode(tmp_path) + b"/" + name, "wb") as file:
        file.write((tmp_path / "main.xml").read_bytes())
    result = canopy(*commands(name)[command], cwd=tmp_path)
    assert result.returncode in (1, 2)
    assert b"is not UTF-8; rename it" in result.stderr and b"in\\xffput" in result.stderr, result.stderr


@pytest.mark.parametrize("option", ["-o", "--depfile", "--stubs", "--name", "--include", "--main-tree", "--type-map"])
def test_an_argument_that_is_not_utf8_is_an_error(tmp_path: Path, option: str) -> None:
    (tmp_path / "main.xml").write_text(TREE.format("<AlwaysSuccess/>", ""))
    more = [] if option == "-o" else ["-o", "out"]
    base: list[str | bytes | Path] = [
        "compile",
        "main.xml",
        "--dbc",
        DBC,
        "--node",
        "Controller",
        "--period-ms",
        "10",
        *more,
    ]
    result = canopy(*base, option, b"x\xff.c", cwd=tmp_path)
    assert result.returncode == 2
    assert b"Traceback" not in result.stderr and b"\\xff" in result.stderr, result.stderr
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [tmp_path / "main.xml"]


def test_a_dbc_is_in_utf8_or_in_windows_1252(tmp_path: Path) -> None:
    head = 'VERSION ""\nBU_: Controller B\nBO_ 1 A: 8 B\n'
    for text, unit in (
        ("°C".encode(), "°C"),
        ("°C".encode("cp1252"), "°C"),
        ("\ufeff" + "Á", "Á"),
        (b"\x81\x9d", "\ufffd\ufffd"),  # no characters there
    ):
        data = text if isinstance(text, bytes) else "Á".encode()
        (tmp_path / "bus.dbc").write_bytes(head.encode() + b' SG_ X : 0|8@1+ (1,0) [0|1] "' + data + b'" Controller\n')
        result = CliRunner().invoke(main, ["codec", str(tmp_path / "bus.dbc"), "-o", str(tmp_path)])
        assert f"[{unit}]" in (tmp_path / "bus_codec.h").read_text(encoding="utf-8"), result.output


SUBTREE = '<SubTree ID="B{}"/>'
LONG = "ba" * MEGABYTE

# One megabyte, or two thousand files, that took minutes: each part is looked up, copied or asked about again and again.
SLOW = {
    "text": TREE.format("<AlwaysSuccess>" + "x\n" * (MEGABYTE // 2) + "</AlwaysSuccess>", ""),
    "text between": TREE.format("<Sequence>" + "xy<AlwaysSuccess/>" * (MEGABYTE // 18) + "</Sequence>", ""),
    "models": TREE.format(
        "<AlwaysSuccess/>",
        "<TreeNodesModel>"
        + "".join(f'<Condition ID="C{i}"/>' for i in range(MEGABYTE // 25))
        + "</TreeNodesModel>",
    ),
    "ports": TREE.format(
        "<A/>",
        '<TreeNodesModel><Action ID="A">'
        + "".join(f'<input_port name="p{i}" type="int" default="1"/>' for i in range(MEGABYTE // 50))
        + "</Action></TreeNodesModel>",
    ),
    "trees": TREE.format(
        "<AlwaysSuccess/>",
        "".join(f'<BehaviorTree ID="T{i}"><AlwaysSuccess/></BehaviorTree>' for i in range(MEGABYTE // 55)),
    ),
    "trees of trees": TREE.format(
        "<AlwaysSuccess/>",
        "".join(
            f'<BehaviorTree ID="B{i}"><Sequence>{SUBTREE.format(i + 1) * 2}</Sequence></BehaviorTree>'
            for i in range(20)
        )
        + '<BehaviorTree ID="B20"><AlwaysSuccess/></BehaviorTree>'
        + "".join(f'<BehaviorTree ID="R{i}"><SubTree ID="B0"/></BehaviorTree>' for i in range(MEGABYTE // 60)),
    ),
    "entries": TREE.format(
        "<Sequence>" + "".join(f'<Script code="a{i}:=a{i + 1}"/>' for i in range(10_000))
        + '<Script code="a10000:=1"/></Sequence>', ""
    ),
    "deep": TREE.format("<Sequence><AlwaysSuccess/>" * 30_000 + "<AlwaysSuccess/>" + "</Sequence>" * 30_000, ""),
    "clean-ups": TREE.format(
        "<Sequence>" + "".join(f"<A{i}/>" for i in range(8_000)) + "</Sequence>",
        "<TreeNodesModel>"
        + "".join(
            f'<Action ID="A{i}"><MetadataFields><Metadata undoes="A{i + 1}"/></MetadataFields></Action>'
            for i in range(8_000)
        )
        + "</TreeNodesModel>",
    ),
    "guards": TREE.format(
        "<ReactiveSequence>" + "<C/>" * 20_000 + "</ReactiveSequence>",
        '<TreeNodesModel><Condition ID="C"><MetadataFields><Metadata reads="Climate"/></MetadataFields></Condition>'
        "</TreeNodesModel>",
    ),
    "readers": TREE.format(
        "<Sequence>" + '<ScriptCondition code="x==1"/>' * (MEGABYTE // 40) + '<Script code="x:=1"/></Sequence>', ""
    ),
    "a name": TREE.format(f"<{'ab' * (MEGABYTE // 2)}/>", f'<TreeNodesModel><Action ID="{LONG}"/></TreeNodesModel>'),
    "an ID": TREE.format(f'<Action ID="{LONG}"/>', f'<TreeNodesModel><Action ID="{LONG}"/></TreeNodesModel>').replace(
        LONG, LONG.upper()
    ),
    "blanks": "\n" * MEGABYTE + TREE.format("<AlwaysSuccess/>", "") + "\n" * MEGABYTE,
    "includes": TREE.format("<AlwaysSuccess/>", "".join(f'<include path="i{i}.xml"/>' for i in range(2_000))),
    "a chain of includes": TREE.format("<AlwaysSuccess/>", '<include path="c0.xml"/>'),
}  # fmt: skip


@pytest.mark.parametrize("kind", SLOW)
def test_a_megabyte_takes_seconds(tmp_path: Path, kind: str) -> None:
    (tmp_path / "main.xml").write_text(SLOW[kind])
    for i in range(2_000 if "includes" in kind else 0):
        (tmp_path / f"i{i}.xml").write_text(f'{HEAD}<TreeNodesModel><Condition ID="C{i}"/></TreeNodesModel></root>')
        (tmp_path / f"c{i}.xml").write_text(f'{HEAD}<include path="c{i + 1}.xml"/></root>')
    (tmp_path / "c2000.xml").write_text(f"{HEAD}</root>")
    more = ["--dbc", str(DBC), "--node", "Controller", "--period-ms", "10", "-o", "out"]
    for arguments in (["check", "main.xml"], ["compile", "main.xml", *more], ["show", "main.xml"], ["fmt", "main.xml"]):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        result = canopy(*arguments, cwd=tmp_path, seconds=100)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        assert b"Traceback" not in result.stderr
        assert len(result.stderr) < 20_000 or kind == "trees"
        print(f"{kind}: {arguments[0]} {seconds:.1f} s")
        assert seconds < 25, arguments


BUS = 'VERSION ""\nBU_: Controller B\nBO_ 1 {}: 8 B\n SG_ X : 0|32@1+ (1,0) [0|0] "{}" Controller\n{}'
SLOW_BUSES = {
    "names of values": BUS.format("M", "", "VAL_ 1 X " + "".join(f'{i} "c" ' for i in range(MEGABYTE // 12)) + ";\n"),
    "a name": BUS.format("M" * MEGABYTE, "", ""),
    "a unit": BUS.format("M", "u" * MEGABYTE, ""),
    "a comment": BUS.format("M", "", 'CM_ BO_ 1 "' + "word\n" * (MEGABYTE // 5) + '";\n'),
    "multiplexed signals": BUS.format("M", "", "").replace("X :", "X M :")
    + "".join(f' SG_ X{i} m{i} : 32|8@1+ (1,0) [0|255] "" Controller\n' for i in range(MEGABYTE // 50)),
}


@pytest.mark.parametrize("kind", SLOW_BUSES)
def test_a_megabyte_of_a_bus_takes_seconds(tmp_path: Path, kind: str) -> None:
    (tmp_path / "bus.dbc").write_text(SLOW_BUSES[kind])
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    result = canopy("codec", "bus.dbc", "-o", "out", cwd=tmp_path, seconds=100)
    assert b"Traceback" not in result.stderr
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < 25
    if kind == "multiplexed signals":
        assert b"message 'M' has more than 2048 signals" in result.stderr


def test_entities_are_refused_before_they_grow(tmp_path: Path) -> None:
    entities = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10 if i else "x" * 10}">' for i in range(12))
    (tmp_path / "main.xml").write_text(f"<!DOCTYPE a [{entities}]><root>&e11;</root>")
    for command in (["check", "main.xml"], ["fmt", "main.xml"]):
        start = time.monotonic()
        result = canopy(*command, cwd=tmp_path)
        assert result.returncode == 2 and b"main.xml:1:1" in result.stderr and b"DOCTYPE" in result.stderr
        assert time.monotonic() - start < 10


def test_a_device_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "main.xml").write_text(TREE.format("<AlwaysSuccess/>", ""))
    (tmp_path / "null").symlink_to("/dev/null")
    result = canopy("show", "main.xml", "--svg", "null", cwd=tmp_path)
    assert result.returncode == 2 and b"is a device, not a file" in result.stderr
    assert Path("/dev/null").is_char_device() and (tmp_path / "null").is_symlink()


def test_the_bounds_of_reading(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"12345")
    assert read_bytes(file, 5) == b"12345"
    with pytest.raises(FileError, match="has 5 bytes; at most 4 are read"):
        read_bytes(file, 4)
    with pytest.raises(FileError, match="has 11 bytes; at most 10"):  # of size 0, as the kernel says
        read_bytes(Path("/proc/self/maps"), 10)
    file.write_bytes(b"a\nb\xff")
    with pytest.raises(FileError, match="line 2: byte 0xff is not UTF-8"):
        read_text(file)
