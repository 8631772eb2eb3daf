# SPDX-License-Identifier: MIT
"""Every number of a file that becomes a C integer is within its limits, or refused with file, line and name."""

# ruff: noqa: E501
# In the tables, one line is one case.

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.model import ModelError, load_model
from integration.codec_harness import ROOT, WARNINGS
from integration.compilers import COMPILERS
from integration.trace_source import model_data

pytestmark = pytest.mark.timeout(60)

TREE = '<root BTCPP_format="4"><BehaviorTree ID="Main">{}</BehaviorTree>{}</root>'
DBC = """VERSION ""
BU_: Controller B
BO_ 1 A: 8 Controller
 SG_ X : 0|8@1+ (1,0) [0|100] "" B

BO_ 2 S: 8 B
 SG_ E2E_CRC : 0|8@1+ (1,0) [0|255] "" Controller
 SG_ E2E_Counter : 8|4@1+ (1,0) [0|14] "" Controller
 SG_ Y : 16|8@1+ (1,0) [0|100] "" Controller

BA_DEF_ BO_ "GenMsgCycleTime" FLOAT -1e40 1e40;
BA_DEF_ BO_ "GenMsgTimeoutTime" FLOAT -1e40 1e40;
BA_DEF_ BO_ "E2EDataId" FLOAT -1e40 1e40;
BA_DEF_ SG_ "GenSigInactiveValue" FLOAT -1e40 1e40;
BA_DEF_DEF_ "GenMsgCycleTime" 100;
BA_DEF_DEF_ "GenMsgTimeoutTime" 0;
BA_DEF_DEF_ "E2EDataId" -1;
BA_DEF_DEF_ "GenSigInactiveValue" 60;
"""


def run(
    folder: Path, *more: str, tree: str = TREE.format("<AlwaysSuccess/>", ""), dbc: str = DBC, period: int = 100
) -> Result:
    (folder / "t.xml").write_text(tree)
    (folder / "b.dbc").write_text(dbc)
    command = [
        "compile",
        str(folder / "t.xml"),
        "--dbc",
        str(folder / "b.dbc"),
        "--node",
        "Controller",
        "--name",
        "app",
    ]
    return CliRunner().invoke(main, [*command, "--period-ms", str(period), "-o", str(folder / "out"), *more])


def expect_refused(folder: Path, result: Result, place: str, *texts: str) -> None:
    assert result.exit_code == 2, (result.output, result.exception)
    assert re.match(rf"{re.escape(str(folder / place))}[:\d]*: error: ", result.stderr), result.stderr[:300]
    for text in texts:
        assert text in result.stderr
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("line", "texts"),
    [
        ('BA_ "GenMsgCycleTime" BO_ 1 6553600;', ["GenMsgCycleTime of message 'A'", "is 65536", "1 to 65535 ticks"]),
        ('BA_ "GenMsgCycleTime" BO_ 1 -100;', ["GenMsgCycleTime of message 'A' is -100"]),
        ('BA_ "GenMsgCycleTime" BO_ 2 -100;', ["GenMsgCycleTime of message 'S' is -100"]),
        ('BA_ "GenMsgCycleTime" BO_ 1 33.3;', ["GenMsgCycleTime of message 'A' is 33.3", "whole number"]),
        ('BA_ "GenMsgCycleTime" BO_ 1 1e30;', ["GenMsgCycleTime of message 'A' is"]),
        ('BA_ "GenMsgTimeoutTime" BO_ 2 -500;', ["GenMsgTimeoutTime of message 'S' is -500", "0 to 4294967295 ms"]),
        ('BA_ "GenMsgTimeoutTime" BO_ 2 4294967296;', ["GenMsgTimeoutTime of message 'S'"]),
        ('BA_ "E2EDataId" BO_ 2 65536;', ["E2EDataId of message 'S' is 65536", "-1 to 65535"]),
        ('BA_ "E2EDataId" BO_ 2 -2;', ["E2EDataId of message 'S' is -2"]),
        ('BA_ "GenSigInactiveValue" SG_ 1 X 18446744073709551616;', ["GenSigInactiveValue of signal 'A.X'"]),
        ('BA_ "GenSigInactiveValue" SG_ 1 X 0.5;', ["GenSigInactiveValue of signal 'A.X' is 0.5"]),
        ('BA_ "GenMsgCycleTime" BO_ 1 1e99999999;', ["the number 1e99999999 is too long"]),
        ('BA_ "GenMsgCycleTime" BO_ 1 "1e99999999";', ["the number 1e99999999 is too long"]),
    ],
)  # fmt: skip
def test_an_attribute_out_of_its_limits_is_refused_at_its_line(tmp_path: Path, line: str, texts: list[str]) -> None:
    expect_refused(tmp_path, run(tmp_path, dbc=DBC + line + "\n"), f"b.dbc:{len(DBC.splitlines()) + 1}", *texts)


def test_a_default_is_refused_at_its_line(tmp_path: Path) -> None:
    dbc = DBC.replace('"GenMsgTimeoutTime" 0', '"GenMsgTimeoutTime" -1')
    line = dbc[: dbc.index('"GenMsgTimeoutTime" -1')].count("\n") + 1
    expect_refused(tmp_path, run(tmp_path, dbc=dbc), f"b.dbc:{line}", "is -1")


@pytest.mark.parametrize(("cycle", "period", "every"), [(65537, 65537, 1), (6553500, 100, 65535), (65535, 1, 65535)])
def test_the_longest_cycle_is_taken(tmp_path: Path, cycle: int, period: int, every: int) -> None:
    result = run(tmp_path, dbc=DBC + f'BA_ "GenMsgCycleTime" BO_ 1 {cycle};\n', period=period)
    assert result.exit_code == 0, result.output
    assert f".every = {every}u" in (tmp_path / "out" / "app_bus.c").read_text()


def test_a_cycle_of_65537_ticks_is_refused(tmp_path: Path) -> None:
    expect_refused(
        tmp_path, run(tmp_path, dbc=DBC + 'BA_ "GenMsgCycleTime" BO_ 1 65537;\n', period=1), "b.dbc", "is 65537"
    )


@pytest.mark.parametrize(
    ("option", "value", "text"),
    [
        ("--trace", "-1", "-1 is not between 0x0 and 0x1FFFFFF8"),
        ("--trace", "0x1FFFFFF9", "0x1FFFFFF9 is not between"),
        ("--trace", "9" * 30, "is not between"),
        ("--trace", "tick", "'tick' is no number; for example 0x600"),
        ("--trace-guard", "0x10000", "0x10000 is not between 0x0 and 0xFFFF"),
    ],
)
def test_an_option_of_the_trace_has_limits(tmp_path: Path, option: str, value: str, text: str) -> None:
    result = run(tmp_path, *(["--trace", "0x600"] if option != "--trace" else []), option, value)
    assert result.exit_code == 2
    assert text in " ".join(result.stderr.replace("│", "").split()), result.stderr


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ("[0|100]", "[0|1e99999999]", ["the number 1e99999999 is too long"]),
        ("[0|100]", "[-1e99999999|100]", ["the number -1e99999999 is too long"]),
        ("[0|100]", "[0|1e400]", ["signal 'A.X' has the maximum inf"]),
        ("(1,0)", "(1e400,0)", ["signal 'A.X' has the scale inf"]),
        ("(1,0)", "(1e-200,0)", ["signal 'A.X' has the scale 1e-200"]),
        ("(1,0)", "(1,1e200)", ["signal 'A.X' has the offset 1e+200"]),
        ("(1,0)", f"({'9' * 500},0)", ["the number 99999999999999999999… is too long"]),
        ("0|8@1+", "0|9999999999@1+", ["signal 'A.X' is at 0|9999999999"]),
        ("0|8@1+", "9999999999|8@1+", ["signal 'A.X' is at 9999999999|8"]),
        (": 8 Controller", ": 99999999999 Controller", ["message 'A' is longer than 1785 bytes"]),
        (": 8 Controller", ":\n 0xFFFFFFFF Controller", ["message 'A' is longer than 1785 bytes"]),
    ],
)  # fmt: skip
def test_a_signal_out_of_its_limits_is_refused_at_its_line(
    tmp_path: Path, old: str, new: str, texts: list[str]
) -> None:
    dbc = DBC.replace(old, new, 1)
    line = DBC[: DBC.index(old)].count("\n") + 1
    expect_refused(tmp_path, run(tmp_path, dbc=dbc), f"b.dbc:{line}", *texts)


def test_branches_of_a_multiplexer_are_counted_before_they_are_made(tmp_path: Path) -> None:
    dbc = DBC.replace("SG_ Y :", 'SG_ Z m0 : 48|8@1+ (1,0) [0|0] "" Controller\n SG_ Y M :').replace("16|8", "16|32")
    dbc += "SG_MUL_VAL_ 2 Z Y 0-4294967295;\n"
    expect_refused(tmp_path, run(tmp_path, dbc=dbc), f"b.dbc:{len(dbc.splitlines())}", "signal 'Z'", "1048576")


def test_such_numbers_in_comments_are_none(tmp_path: Path) -> None:
    assert run(tmp_path, dbc=DBC + 'CM_ BO_ 1 "from 1e99999999 on\nBO_ 7 Long: 99999999 B";\n').exit_code == 0


PORT = '<TreeNodesModel><Condition ID="Is"><input_port name="p" type="{}"/></Condition></TreeNodesModel>'


@pytest.mark.parametrize(
    ("port_type", "value"),
    [("float", "1e300"), ("float", "-1e39"), ("float", "1e-60"), ("double", "1e400"), ("double", "1e-400"), ("uint8_t", "256"), ("int8_t", "-129")],
)  # fmt: skip
def test_a_port_out_of_its_type_is_refused(tmp_path: Path, port_type: str, value: str) -> None:
    tree = TREE.format(f'<Is p="{value}"/>', PORT.format(port_type))
    expect_refused(tmp_path, run(tmp_path, "--allow-floating-point", tree=tree), "t.xml", "port 'p' of 'Is'")


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("x := 1e999*1e999*1e999*1e999*1e999", "about 1e4995 is too large"),
        ("x := 1.5; x := 1e400", "too large for floating point"),
        ("x := 1.5; x := 1e-400", "too small for floating point"),
    ],
)
def test_a_number_of_a_script_that_no_type_holds_is_refused(tmp_path: Path, code: str, text: str) -> None:
    more = ["--allow-floating-point"] if "1.5" in code else []
    result = run(tmp_path, *more, tree=TREE.format(f'<Script code="{code}"/>', ""))
    expect_refused(tmp_path, result, "t.xml", text if more else "outside int64_t")


@pytest.mark.parametrize(
    ("nodes", "models", "text"),
    [
        ("<Sequence>" + '<Sleep msec="1"/>' * 16_384 + "</Sequence>", "", "words of state of all nodes together: 65537"),
        ("<Sequence>" + "".join(f'<TestNode async_delay="{n}"/>' for n in range(13_200)) + "</Sequence>", "", "parameters of all nodes together: 66000"),
        (f"<LoopInt queue=\"{'1;' * 65_536}\" value=\"{{v}}\"><AlwaysSuccess/></LoopInt>", "", "items of the list: 65536"),
        ("<AlwaysSuccess/>", "<TreeNodesModel><Condition ID=\"Is\">" + "".join(f'<input_port name="p{n}" type="bool"/>' for n in range(1_001)) + "</Condition></TreeNodesModel>", "more than 1000 ports"),
    ],
    ids=["words", "parameters", "items", "ports"],
)  # fmt: skip
def test_counts_that_tables_cannot_hold_are_refused(tmp_path: Path, nodes: str, models: str, text: str) -> None:
    expect_refused(tmp_path, run(tmp_path, tree=TREE.format(nodes, models)), "t.xml", text)


@pytest.mark.parametrize(
    "option",
    [("--period-ms", "3600001"), ("--bitrate", "9" * 400), ("--max-ram", "-1"), ("--max-flash", "-1"), ("--image-nodes", "65535"), ("--image-uses", "4097")],
)  # fmt: skip
def test_options_are_bounded(tmp_path: Path, option: tuple[str, str]) -> None:
    result = run(tmp_path, *option)
    assert result.exit_code == 2
    assert f"Invalid value for '{option[0]}'" in result.stderr


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_largest_room_for_images_fits(tmp_path: Path, compiler: str) -> None:
    result = run(tmp_path, "--image-nodes", "65534", "--image-uses", "4096")
    assert result.exit_code == 0, result.output
    sources = [str(file) for file in (tmp_path / "out").glob("*.c")]
    include = f"-I{ROOT / 'runtime' / 'include'}"
    subprocess.run([compiler, *WARNINGS, include, "-fsyntax-only", *sources], check=True)


def test_more_entries_than_images_can_address_are_refused(tmp_path: Path) -> None:
    model = '<TreeNodesModel><Action ID="A"><output_port name="q" type="int32_t[20000]"/><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action></TreeNodesModel>'
    result = run(tmp_path, "--image-nodes", "10", tree=TREE.format('<A q="{q}"/>', model))
    expect_refused(tmp_path, result, "t.xml", "bytes of entries that tree images can use")


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("period_us", 0), ("period_us", -1), ("period_us", 10**20), ("period_us", True), ("image.nodes", 10**9),
        ("image.parameters", 65536), ("image.words", -1), ("image.texts", 2**32), ("image.uses", 0), ("image.kinds", [1]),
        ("image.kinds", [{"id": 1}]), ("image.entries", [{"name": "x"}]), ("image.scripts", [1]),
    ],
)  # fmt: skip
def test_a_model_file_with_a_number_out_of_its_limits_is_refused(tmp_path: Path, path: str, value: object) -> None:
    assert run(tmp_path, "--image-nodes", "10").exit_code == 0
    file = tmp_path / "out" / "app.model.json"
    data = json.loads(file.read_text())
    *parents, last = path.split(".")
    target = data
    for name in parents:
        target = target[name]
    target[last] = value
    file.write_text(json.dumps(data))
    result = CliRunner().invoke(
        main, ["image", "build", str(tmp_path / "t.xml"), "--for", str(file), "-o", str(tmp_path / "x.img")]
    )
    assert result.exit_code == 2, (result.output, result.exception)
    assert result.stderr.startswith(f"{file}: error: ") and path in result.stderr


@pytest.mark.parametrize(
    "change",
    [{"period_us": 10**12}, {"trace": {"base": 2**29}}, {"trace": {"base": -1}}, {"trace": {"changes_max": 999}}],
)
def test_a_model_file_to_watch_with_is_bounded(tmp_path: Path, change: dict[str, object]) -> None:
    assert run(tmp_path).exit_code == 0
    file = tmp_path / "out" / "app.model.json"
    data = json.loads(file.read_text()) | {"trace": model_data(1)["trace"]}
    data = {name: {**data[name], **to} if isinstance(to, dict) else to for name, to in (data | change).items()}
    file.write_text(json.dumps(data))
    with pytest.raises(ModelError, match=r"period_us|trace\.base|trace\.changes_max"):
        load_model(file)


def test_scripts_write_scaled_signals_that_have_a_table(tmp_path: Path) -> None:
    """Such a signal is a number with named exceptions, and has no enum in C."""
    dbc = DBC.replace('(1,0) [0|100] "" B', '(-1,0) [-100|0] "" B') + 'VAL_ 1 X 200 "Out of order" 0 "Zero" ;\n'
    tree = TREE.format("<Script code=\"A.X = -5; A.X = 'Out of order'\"/>", "")
    result = run(tmp_path, tree=tree, dbc=dbc)
    assert result.exit_code == 0, result.output
    sources = [str(file) for file in (tmp_path / "out").glob("*.c")]
    subprocess.run(["gcc", *WARNINGS, f"-I{ROOT / 'runtime' / 'include'}", "-fsyntax-only", *sources], check=True)


@pytest.mark.parametrize("code", ["(S.Y & 7) == -7", "(x & 7) == -7", "(x & 6) == 1", "(x | 6) == 1", "(x | 6) != 6"])
def test_comparisons_that_a_mask_decides_do_not_warn(tmp_path: Path, code: str) -> None:
    tree = TREE.format(
        f'<Sequence><Script code="x := S.Y"/><ScriptCondition code="{code.replace("&", "&amp;")}"/></Sequence>', ""
    )
    result = run(tmp_path, tree=tree)
    assert result.exit_code == 0, result.output
    sources = [str(file) for file in (tmp_path / "out").glob("*.c")]
    subprocess.run(["gcc", *WARNINGS, f"-I{ROOT / 'runtime' / 'include'}", "-fsyntax-only", *sources], check=True)


def test_more_frames_in_a_period_than_c_counts_are_refused(tmp_path: Path) -> None:
    dbc = DBC.replace('"GenMsgCycleTime" 100', '"GenMsgCycleTime" 3600000')
    result = run(tmp_path, "--bitrate", "100000000", dbc=dbc, period=3_600_000)
    assert result.exit_code == 2
    assert result.stderr.startswith("--bitrate: error: the number of frames that a bus of 100000000 bit/s carries")
    assert run(tmp_path, "--bitrate", "50000000", dbc=dbc, period=3_600_000).exit_code == 0


@pytest.mark.parametrize(("messages", "fits"), [(511, True), (512, False)])
def test_buffers_that_a_uint16_cannot_address_are_refused(tmp_path: Path, messages: int, fits: bool) -> None:
    sent = "".join(f'BO_ {n + 10} M{n}: 64 Controller\n SG_ X : 0|8@1+ (1,0) [0|100] "" B\n\n' for n in range(messages))
    formats = ",".join(
        f'"{name}"' for name in ("StandardCAN", "ExtendedCAN", *(f"r{n}" for n in range(12)), "StandardCAN_FD")
    )
    tail = f'BA_DEF_ BO_ "VFrameFormat" ENUM {formats};\nBA_DEF_DEF_ "VFrameFormat" "StandardCAN_FD";\n'
    dbc = (
        DBC.replace("BO_ 1 A: 8 Controller", sent + "BO_ 1 A: 0 B").replace(
            ' SG_ X : 0|8@1+ (1,0) [0|100] "" B\n\nBO_ 2', "\nBO_ 2"
        )
        + tail
    )
    result = run(tmp_path, dbc=dbc.replace('"GenMsgCycleTime" 100', '"GenMsgCycleTime" 1000000'))
    if fits:
        assert result.exit_code == 0, result.output
    else:
        expect_refused(
            tmp_path, result, "b.dbc", "bytes of two buffers for each message that node 'Controller' sends: 65536"
        )
