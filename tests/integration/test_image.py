# SPDX-License-Identifier: MIT
"""Tree images: the bytes of `canopy image build`, its refusals by name, and the runtime that loads them."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import zlib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.image import HEADER, read_image

ROOT = Path(__file__).parents[2]
EXCHANGE = ROOT / "tests/unit/exchange"
LANGUAGE = ROOT / "tests/unit/language"


def run(*arguments: object) -> Result:
    """`canopy` with these arguments."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def compile_firmware(tree: Path, dbc: Path, folder: Path, *more: object) -> Path:
    """Compiles a firmware; the path of its model file."""
    name = dbc.stem
    types = () if "--include" in more else ("--include", "state.h")
    firmware = run(
        *("compile", tree, "--name", name, "--dbc", dbc, "--node", "Controller", "--period-ms", 10, "-o", folder),
        *types,
        *more,
    )
    assert firmware.exit_code == 0, firmware.output
    return folder / f"{name}.model.json"


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model file of the application "exchange" of the unit tests."""
    folder = tmp_path_factory.mktemp("exchange")
    images = ("--image-nodes", 40, "--image-uses", 4)
    return compile_firmware(EXCHANGE / "main.xml", EXCHANGE / "exchange.dbc", folder, *images)


def build(tmp_path: Path, firmware: Path, nodes: str, models: str | None = None) -> Result:
    """Compiles an image with these nodes to tmp_path/x.img; `models` instead of models.xml."""
    (tmp_path / "models.xml").write_text(models or (EXCHANGE / "models.xml").read_text())
    (tmp_path / "x.xml").write_text(
        f'<root BTCPP_format="4" main_tree_to_execute="Main">\n<include path="models.xml"/>\n'
        f'<BehaviorTree ID="Main">\n{nodes}\n</BehaviorTree></root>\n'
    )
    return run("image", "build", tmp_path / "x.xml", "--for", firmware, "-o", tmp_path / "x.img")


# One good use of each leaf with ports.
MEASURE = '<Measure pose="{pose}" count="{count}"/>'
COMPARE = '<Compare exact="1" small="-3" count="2" after="3" wide="-4" label="Ä"/>'


def drive(gear: str = "GEAR_LOW", label: str = "{label}", temperature: str = "{Climate.Temperature}") -> str:
    """The drive of the firmware, with these ports."""
    return (
        f'<Drive speed="1" fast="1" gear="{gear}" pose="{{pose}}" label="{label}" temperature="{temperature}"/>'
        "<Script code=\"label := 'measured'; note := 0\"/>" + MEASURE + '<Note value="{note}"/>'
    )


def test_the_same_input_gives_the_same_bytes(tmp_path: Path, firmware: Path) -> None:
    images = []
    for folder in ("one", "two"):
        output = tmp_path / folder / "other.img"
        result = run("image", "build", EXCHANGE / "other.xml", "--for", firmware, "-o", output)
        assert result.exit_code == 0, result.output
        images.append(output.read_bytes())
    assert images[0] == images[1]
    size, nodes, tree = re.search(r"(\d+) bytes, (\d+) nodes, hash ([0-9a-f]{16})", result.output).groups()  # type: ignore[union-attr]
    assert int(size) == len(images[0])
    magic, version, zero, total, crc, tree_hash, _, node_count, *_ = HEADER.unpack_from(images[0])
    assert (magic, version, zero, total) == (b"CNPY", 1, 0, len(images[0]))
    assert crc == zlib.crc32(images[0][:12] + images[0][16:])
    assert (node_count, f"{tree_hash:016x}") == (int(nodes), tree)


def test_constants_are_the_bits_of_their_type(tmp_path: Path, firmware: Path) -> None:
    assert build(tmp_path, firmware, COMPARE).exit_code == 0
    image = read_image(tmp_path / "x.img")
    assert image.values == ((1, 1), (1, 0xFD), (1, 2), (1, 3), (1, 2**64 - 4), (2, 0))
    assert image.texts == "Ä".encode() + b"\0"


def test_fixed_point_constants_and_texts_that_leaves_write(tmp_path: Path) -> None:
    tree = tmp_path / "main.xml"
    text = (
        '<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence>'
        '<Say limit="-1.25" word="{word}"/><Say limit="2" word="{word}"/><Hear word="{word}"/></Sequence>'
        "</BehaviorTree>"
        '<TreeNodesModel><Action ID="Say"><input_port name="limit" type="int16_t*0.01"/>'
        '<output_port name="word" type="std::string"/><MetadataFields><Metadata kind="SyncAction" texts="yes;no"/>'
        '</MetadataFields></Action><Condition ID="Hear"><input_port name="word" type="std::string"/></Condition>'
        "</TreeNodesModel></root>"
    )
    tree.write_text(text)
    model = compile_firmware(tree, EXCHANGE / "exchange.dbc", tmp_path / "f", "--image-nodes", 9)
    assert run("image", "build", tree, "--for", model, "-o", tmp_path / "x.img").exit_code == 0
    assert read_image(tmp_path / "x.img").values == ((1, 0x10000 - 125), (3, 0), (1, 200), (3, 0), (0, 0))
    tree.write_text(text.replace("*0.01", "*0.25"))
    result = run("image", "build", tree, "--for", model, "-o", tmp_path / "y.img")
    assert result.exit_code == 2
    assert "'Say' is declared differently" in result.stderr


def test_floating_point_constants(tmp_path: Path) -> None:
    tree = tmp_path / "main.xml"
    tree.write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="Main"><Warm single="-1.5" both="0.1"/></BehaviorTree>'
        '<TreeNodesModel><Condition ID="Warm"><input_port name="single" type="float"/>'
        '<input_port name="both" type="double"/></Condition></TreeNodesModel></root>'
    )
    dbc = EXCHANGE / "exchange.dbc"
    model = compile_firmware(tree, dbc, tmp_path / "f", "--image-nodes", 4, "--allow-floating-point")
    assert run("image", "build", tree, "--for", model, "-o", tmp_path / "x.img").exit_code == 0
    (_, single), (_, both) = read_image(tmp_path / "x.img").values
    assert struct.pack("<I", single) == struct.pack("<f", -1.5)
    assert struct.pack("<Q", both) == struct.pack("<d", 0.1)


def test_unset_ports_are_zero_and_their_null_is_the_firmwares(tmp_path: Path) -> None:
    ports = "<input_port name='n' type='uint8_t'/><input_port name='t' type='string'/>"
    model = f"<TreeNodesModel><Action ID='Go'>{ports}</Action></TreeNodesModel>"
    trees = {"unset": "<Go/>", "none": "<Go n='3' t='hi'/>"}
    models = {}
    for name, node in trees.items():
        file = tmp_path / f"{name}.xml"
        file.write_text(f"<root BTCPP_format='4'><BehaviorTree ID='A'>{node}</BehaviorTree>{model}</root>")
        options = ("--allow-unset-ports", "--image-nodes", 4)
        models[name] = compile_firmware(file, EXCHANGE / "exchange.dbc", tmp_path / name, *options)
    image = tmp_path / "x.img"
    assert run("image", "build", tmp_path / "unset.xml", "--for", models["unset"], "-o", image).exit_code == 0
    assert read_image(image).values == ((1, 0), (0, 0))
    image.unlink()
    refused = run("image", "build", tmp_path / "unset.xml", "--for", models["none"], "-o", image)
    expect_refused(tmp_path, refused, "unset.xml:1:45", "no use of 'Go' has t like this")


def test_a_model_file_goes_along(tmp_path: Path, firmware: Path) -> None:
    output, rule = tmp_path / "other.img", tmp_path / "d"
    arguments = ("--for", firmware, "-o", output, "--model", "--depfile", rule)
    assert run("image", "build", EXCHANGE / "other.xml", *arguments).exit_code == 0
    model = json.loads((tmp_path / "other.model.json").read_text())
    assert model["hash"] == f"{read_image(output).hash:016x}"
    assert len(model["tree"]["nodes"]) == 14
    assert (tmp_path / "exchange.dbc").is_file()
    assert str(EXCHANGE / "models.xml") in rule.read_text()


def expect_refused(tmp_path: Path, result: Result, place: str, *texts: str) -> None:
    """Exit status 2, one message, no file."""
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith(f"{tmp_path / place}: error: firmware 'exchange': "), result.stderr
    for text in texts:
        assert text in result.stderr
    assert not (tmp_path / "x.img").exists()


def changed(old: str, new: str) -> str:
    """The models with one text changed."""
    text = (EXCHANGE / "models.xml").read_text()
    assert text.count(old) == 1
    return text.replace(old, new)


WITH_OTHER_LEAF = changed('<Condition ID="Idle"/>', '<Condition ID="Idle"/><Condition ID="Idler"/>')


@pytest.mark.parametrize(
    ("nodes", "models", "place", "texts"),
    [
        ("<Idler/>", WITH_OTHER_LEAF, "x.xml:4:1", ["has no Condition 'Idler'", "did you mean 'Idle'?"]),
        (
            COMPARE,
            changed('name="small" type="int8_t"', 'name="small" type="int16_t"'),
            "x.xml:4:1",
            ["'Compare' is declared differently", "in int int8_t small", "in int int16_t small"],
        ),
        (
            "<Idle/>",
            changed('<Condition ID="Idle"/>', '<Action ID="Idle"/>'),
            "x.xml:4:1",
            ["there: Condition Idle()", "here: StatefulAction Idle()"],
        ),
        (
            '<Measure pose="{pose}" count="{counter}"/>',
            None,
            "x.xml:4:31",
            ["has no entry {counter}: int int32_t counter", "did you mean 'count'?"],
        ),
        (
            '<Sequence><Script code="level += 1"/><ScriptCondition code="level &gt; 303"/></Sequence>',
            changed('name="level" type="uint16_t" default="300"', 'name="level" type="uint16_t" default="299"'),
            "models.xml:4:7",
            ["has no entry {level}", "there: int uint16_t level = '300' (level)"],
        ),
        (
            '<Sequence><Idle/>\n<Script code="level += 2"/></Sequence>',
            None,
            "x.xml:5:15",
            ['has no such script: code="level += 2"', "those that the firmware's own tree has"],
        ),
        (
            f"<Sequence>{drive(gear='GEAR_OFF')}</Sequence>",
            None,
            "x.xml:4:11",
            ["no use of 'Drive' has gear and label and temperature like this"],
        ),
        (f"<Sequence>{drive(label='x')}</Sequence>", None, "x.xml:4:11", ["gear and temperature like this"]),
        (
            '<Sequence><Measure count="{count}"/><Note value="{count}"/></Sequence>',
            None,
            "x.xml:4:50",
            ["waits for updates of {count}", "port 'value'"],
        ),
        (f"<Sequence>{'<AlwaysSuccess/>' * 40}</Sequence>", None, "x.xml:4:1", ["40 nodes, not 41", "IMAGE_NODES"]),
        (f"<Sequence>{'<Idle/>' * 5}</Sequence>", None, "x.xml:4:39", ["4 uses of 'Idle', not 5", "IMAGE_USES"]),
        (COMPARE.replace("Ä", "x" * 400), None, "x.xml:4:1", ["256 texts, not 401"]),
    ],
)
def test_what_the_firmware_does_not_have_is_refused_by_name(
    tmp_path: Path, firmware: Path, nodes: str, models: str | None, place: str, texts: list[str]
) -> None:
    expect_refused(tmp_path, build(tmp_path, firmware, nodes, models), place, *texts)


def test_a_signal_that_no_use_reads_changes_what_the_leaf_waits_for(tmp_path: Path, firmware: Path) -> None:
    result = build(tmp_path, firmware, f"<Sequence>{drive(temperature='3')}</Sequence>")
    expect_refused(tmp_path, result, "x.xml:4:11", "'Drive' is declared differently", "reads Climate", "reads nothing")


def test_texts_in_scripts_are_told_apart(tmp_path: Path, firmware: Path) -> None:
    """`label := 1u` is another text in a tree with other texts, though the C is the same."""
    nodes = (
        "<Sequence><Script code=\"label := 'meassured'; note := 0\"/>" + MEASURE + '<Note value="{note}"/></Sequence>'
    )
    expect_refused(tmp_path, build(tmp_path, firmware, nodes), "x.xml:4:25", "has no such script")


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "cannot be read"),
        ("{", "is no JSON"),
        ("[]", "is no model file of this version"),
        ('{"format": 9}', "is no model file of this version"),
        ('{"format": 2, "application": "x"}', "this firmware takes no images"),
        ('{"format": 2, "application": "x", "image": {}}', "bus.dbc is not of type str"),
    ],
)
def test_unusable_model_files_are_refused(tmp_path: Path, content: str | None, text: str) -> None:
    file = tmp_path / "f.model.json"
    if content is not None:
        file.write_text(content)
    result = build(tmp_path, file, COMPARE)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{file}: error: ") and text in result.stderr


def test_an_engine_with_other_nodes_is_refused(tmp_path: Path, firmware: Path) -> None:
    model = json.loads(firmware.read_text())
    model["image"]["engine"] = "0" * 16
    (tmp_path / "exchange.model.json").write_text(json.dumps(model))
    (tmp_path / "exchange.dbc").write_text((EXCHANGE / "exchange.dbc").read_text())
    result = build(tmp_path, tmp_path / "exchange.model.json", COMPARE)
    expect_refused(tmp_path, result, "x.xml:4:1", "other node types", "build it again")


def test_uses_without_nodes_are_refused(tmp_path: Path) -> None:
    arguments = ("--dbc", EXCHANGE / "exchange.dbc", "--node", "Controller", "--period-ms", 10, "-o", tmp_path / "out")
    result = run("compile", EXCHANGE / "main.xml", *arguments, "--include", "state.h", "--image-uses", 3)
    assert result.exit_code == 2
    assert "--image-uses: error: needs --image-nodes" in result.stderr
    assert not (tmp_path / "out").exists()


def test_without_the_option_nothing_is_generated(tmp_path: Path) -> None:
    model = compile_firmware(EXCHANGE / "main.xml", EXCHANGE / "exchange.dbc", tmp_path)
    assert "image" not in json.loads(model.read_text())
    for file in tmp_path.glob("exchange_*.[ch]"):
        assert "canopy_image" not in file.read_text(), file


def test_show(tmp_path: Path, firmware: Path) -> None:
    assert build(tmp_path, firmware, f"<Inverter>{COMPARE}</Inverter>").exit_code == 0
    file = tmp_path / "x.img"
    data = bytearray(file.read_bytes())
    text = run("image", "show", file)
    assert text.exit_code == 0
    assert re.search(r"CRC +[0-9a-f]{8} right", text.output)
    assert re.search(r"nodes +2\n", text.output) and re.search(r"values +6\n", text.output)
    shown: dict[str, Any] = json.loads(run("image", "show", file, "--json").output)
    assert [node["type"] for node in shown["nodes"]] == ["Inverter", "Condition"]
    assert shown["values"][0] == ["constant", 1] and shown["values"][5] == ["text", 0]
    assert shown["texts"] == ["Ä"] and shown["crc_is_right"] and shown["size"] == len(data)
    data[-2] ^= 1
    file.write_bytes(data)
    text = run("image", "show", file)
    assert text.exit_code == 1 and "WRONG" in text.output
    for broken in (b"", b"CNPY", bytes(data[:-1]), b"XXXX" + data[4:], data[:4] + b"\2" + data[5:]):
        file.write_bytes(broken)
        assert run("image", "show", file).exit_code == 2
    assert run("image", "show", tmp_path / "none.img").exit_code == 2


def test_a_tree_with_every_construct_ticks_the_same_from_an_image(tmp_path: Path) -> None:
    folder = tmp_path / "generated"
    images = ("--include", LANGUAGE / "state.h", "--image-nodes", 100)
    model = compile_firmware(LANGUAGE / "main.xml", LANGUAGE / "language.dbc", folder, *images)
    result = run("image", "build", LANGUAGE / "main.xml", "--for", model, "-o", tmp_path / "language.img")
    assert result.exit_code == 0, result.output
    sources = [*folder.glob("*.c"), *(ROOT / "runtime/src").glob("*.c"), LANGUAGE / "leaves.c"]
    twin = ROOT / "tests/integration/image/twin.c"
    flags = ["-std=c11", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-Wall", "-Werror"]
    subprocess.run(
        ["cc", *flags, f"-I{ROOT / 'runtime/include'}", f"-I{folder}", *map(str, sources), str(twin), "-o", "twin"],
        cwd=tmp_path,
        check=True,
    )
    output = subprocess.run(
        [str(tmp_path / "twin"), str(tmp_path / "language.img")], check=True, stdout=subprocess.PIPE, text=True
    ).stdout
    own, _, rest = output.partition("exchange\n")
    image = rest[rest.index("image\n") :]
    assert len(set(own.splitlines())) > 60  # it does something
    assert own.removeprefix("own\n") == image.removeprefix("image\n")
