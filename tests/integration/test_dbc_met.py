# SPDX-License-Identifier: MIT
"""DBCs as they are met: one bad message costs that message, and what can be taken is right. A kind of fault a test."""

from __future__ import annotations

import random
from pathlib import Path

import cantools.database
import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.bus_model import Message
from canopy.compiler.bus_reader import read_bus, read_messages
from canopy.compiler.errors import CompileError
from integration.codec_harness import Library, as_int64, codec_harness, start_build

HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: ECU Robot\n\n'
TREE = """<root BTCPP_format="4"><BehaviorTree ID="T">{}</BehaviorTree><TreeNodesModel>{}</TreeNodesModel></root>"""


def write(folder: Path, messages: str, name: str = "x.dbc") -> Path:
    (folder / name).write_text(HEAD + messages, encoding="utf-8")
    return folder / name


def codec(folder: Path, messages: str, *options: str) -> Result:
    path = write(folder, messages)
    return CliRunner().invoke(main, ["codec", str(path), "-o", str(folder / "out"), *options])


def compiled(folder: Path, messages: str, leaf: str = "", node: str = "ECU") -> Result:
    """An application of one leaf, with `leaf` as its declaration."""
    path = write(folder, messages)
    tree = TREE.format("<Leaf/>" if leaf else "<AlwaysSuccess/>", leaf)
    (folder / "t.xml").write_text(tree)
    arguments = ["compile", str(folder / "t.xml"), "--dbc", str(path), "--node", node, "--period-ms", "10"]
    return CliRunner().invoke(main, [*arguments, "-o", str(folder / "app")])


def reads(name: str) -> str:
    metadata = f'<MetadataFields><Metadata reads="{name}"/></MetadataFields>'
    return f'<Condition ID="Leaf">{metadata}</Condition>'


def library(folder: Path, path: Path) -> tuple[Library, tuple[Message, ...]]:
    """The codec of a file, built with warnings as errors."""
    result = CliRunner().invoke(main, ["codec", str(path), "-o", str(folder)])
    assert result.exit_code == 0, result.output
    bus = read_messages(path)
    (folder / "harness.c").write_text(codec_harness(bus))
    sources = [folder / "harness.c", folder / f"{bus.name}_codec.c"]
    assert start_build(folder, sources, folder / "codec.so").wait() == 0
    return Library(folder / "codec.so"), bus.messages


GOOD = 'BO_ 100 Good: 8 Robot\n SG_ a : 0|8@1+ (1,0) [0|0] "" ECU\n\n'

# What is wrong, and what is said of it; Good is there all the same. The signal of the message stands behind the colon.
BAD = "BO_ 101 Bad: 8 Robot"
LEFT_OUT = {
    "does not fit": ("BO_ 101 Bad: 1 Robot: 0|16@1+ (1,0) [0|0]", "", "'Bad.a' does not fit: it ends in byte 1"),
    "too long": ("BO_ 101 Bad: 99999 Robot: 0|16@1+ (1,0) [0|0]", "", "longer than 1785 bytes"),
    "30 bits": (
        "BO_ 1073741925 Bad: 8 Robot: 0|8@1+ (1,0) [0|0]",
        "",
        "id 0x40000065 of message 'Bad' needs more than 29",
    ),
    "31 bits": ("BO_ 3221225573 Bad: 8 Robot: 0|8@1+ (1,0) [0|0]", "", "'Bad' needs more than 29 bits"),
    "same id": ("BO_ 100 Bad: 8 Robot: 0|8@1+ (1,0) [0|0]", "", "'Good' and 'Bad' have the same id 0x64"),
    "float16": (f"{BAD}: 0|16@1- (1,0) [0|0]", "SIG_VALTYPE_ 101 a : 1;", "'Bad.a' is a float of 16 bits"),
    "valtype": (f"{BAD}: 0|32@1- (1,0) [0|0]", "SIG_VALTYPE_ 101 a : 3;", "SIG_VALTYPE_ of 'a' is 3"),
    "scale": (f"{BAD}: 0|16@1- (0,0) [0|0]", "", "'Bad.a' has the scale 0"),
    "no multiplexer": (f"{BAD}:m0: 0|16@1- (1,0) [0|0]", "", "not clear by which multiplexer"),
    "marker": (f"{BAD}:mx: 0|16@1- (1,0) [0|0]", "", "'mx' behind signal 'a'"),
    "signal": (f"{BAD}: 0|16@1 (1,0) [0|0]", "", "SG_ cannot be read here: SG_ a : 0|16@1 (1,0)"),
    "message": ("BO_ 101 Bad 8 Robot: 0|16@1+ (1,0) [0|0]", "", "BO_ cannot be read here: BO_ 101 Bad 8 Robot"),
    "number": (f"{BAD}: 0|16@1+ (1e99999,0) [0|0]", "", "the number 1e99999 is too long"),
    "no bits": (f"{BAD}: 0|0@1+ (1,0) [0|0]", "", "has no bits"),
    "table": (f"{BAD}: 0|8@1+ (1,0) [0|0]", 'VAL_ 101 a 1e9999 "x" ;', "the number 1e9999 is too long"),
    "no length": ("BO_ 101 Bad: x8 Robot: 0|8@1+ (1,0) [0|0]", "", "'x8' is not a number of bytes"),
}


def bad_message(name: str) -> tuple[str, str]:
    """The lines of a message of LEFT_OUT, and what is said of it."""
    written, tail, text = LEFT_OUT[name]
    head, signal = written.rsplit(":", 1)
    if head.count(":") == 2:
        head, marker = head.rsplit(":", 1)
        return f'{head}\n SG_ a {marker} :{signal} "" ECU\n{tail}\n', text
    return f'{head}\n SG_ a :{signal} "" ECU\n{tail}\n', text


@pytest.mark.parametrize("name", LEFT_OUT)
def test_one_bad_message_costs_that_message(tmp_path: Path, name: str) -> None:
    bad, text = bad_message(name)
    result = codec(tmp_path, GOOD + bad)
    assert result.exit_code == 0, result.output
    assert (
        f"{tmp_path / 'x.dbc'}:" in result.stderr and "warning: left out: " in result.stderr and text in result.stderr
    )
    assert "x_good_decode" in (tmp_path / "out" / "x_codec.h").read_text()
    assert "x_bad" not in (tmp_path / "out" / "x_codec.h").read_text()


@pytest.mark.parametrize("name", LEFT_OUT)
def test_a_leaf_that_reads_it_is_told_why_it_is_not_there(tmp_path: Path, name: str) -> None:
    bad, text = bad_message(name)
    ignored = compiled(tmp_path, GOOD + bad, reads("Good"))
    assert ignored.exit_code == 0 and "warning: left out: " in ignored.stderr and text in ignored.stderr
    result = compiled(tmp_path, GOOD + bad, reads("Bad"))
    assert result.exit_code == 2 and "error: " in result.stderr and text in result.stderr


@pytest.mark.parametrize("name", LEFT_OUT)
def test_a_file_of_nothing_else_is_refused(tmp_path: Path, name: str) -> None:
    bad, text = bad_message(name)
    if "same id" not in text:
        result = codec(tmp_path, bad)
        assert result.exit_code == 2 and text in result.stderr and not (tmp_path / "out").exists()


def test_a_message_that_the_node_sends_is_never_left_out(tmp_path: Path) -> None:
    bad = 'BO_ 101 Bad: 1 ECU\n SG_ a : 0|16@1+ (1,0) [0|0] "" Robot\n'
    result = compiled(tmp_path, GOOD + bad)
    assert result.exit_code == 2 and "'Bad.a' does not fit" in result.stderr
    assert "`leave_out = true` for 'Bad' in the overlay" in result.stderr


def test_a_signal_that_cannot_be_taken_costs_the_signal(tmp_path: Path) -> None:
    message = (
        'BO_ 101 Long: 8 Robot\n SG_ a : 0|8@1+ (1,0) [0|0] "" ECU\n SG_ Name : 8|1600@1+ (1,0) [0|0] "" ECU\n'
        ' SG_ Wide : 0|64@1+ (0,0) [0|0] "" ECU\n'
    )
    result = codec(tmp_path, message)
    assert result.exit_code == 0
    assert "left out: signal 'Long.Name' does not fit: it ends in byte 200" in result.stderr
    assert "left out: signal 'Long.Wide' has the scale 0" in result.stderr
    header = (tmp_path / "out" / "x_codec.h").read_text()
    assert "x_long_decode" not in header and "x_long__decode" in header and "_encode" not in header
    assert compiled(tmp_path, message, reads("Long.a")).exit_code == 0
    told = compiled(tmp_path, message, reads("Long.Name"))
    assert told.exit_code == 2 and "'Long.Name' does not fit" in told.stderr


def test_overlapping_signals_can_be_received(tmp_path: Path) -> None:
    fault = (
        'BO_ 287 Fault: 1 Robot\n SG_ Code : 0|8@1+ (1,0) [0|255] "" ECU\n'
        ' SG_ Bit0 : 0|1@1+ (1,0) [0|1] "" ECU\n SG_ Bit1 : 1|1@1+ (1,0) [0|1] "" ECU\n'
    )
    result = codec(tmp_path, GOOD + fault)
    assert result.exit_code == 0 and "'Code' and 'Bit0' of message 'Fault' overlap" in result.stderr
    header = (tmp_path / "out" / "x_codec.h").read_text()
    assert "x_fault_decode" in header and "x_fault_encode" not in header and "x_good_encode" in header
    built, messages = library(tmp_path, tmp_path / "x.dbc")
    number = [message.name for message in messages].index("Fault")
    assert built.decode(number, messages[number], b"\x02") == (0, {"Code": 2, "Bit0": 0, "Bit1": 1})
    assert compiled(tmp_path, GOOD + fault, reads("Fault")).exit_code == 0
    sent = compiled(tmp_path, GOOD + fault, node="Robot")
    assert sent.exit_code == 2 and "overlap: 'Fault' cannot be sent so" in sent.stderr
    assert "[message.Fault.signal.Bit0] leave_out = true" in sent.stderr


def test_signals_of_two_branches_do_not_overlap(tmp_path: Path) -> None:
    text = (
        'BO_ 1 M: 8 Robot\n SG_ Page M : 0|8@1+ (1,0) [0|0] "" ECU\n SG_ a m0 : 8|8@1+ (1,0) [0|0] "" ECU\n'
        ' SG_ b m1 : 8|8@1+ (1,0) [0|0] "" ECU\n'
    )
    assert codec(tmp_path, text).stderr == ""


def test_two_messages_of_one_name_both_stay(tmp_path: Path) -> None:
    text = "".join(f'BO_ {i} Status: 8 Robot\n SG_ a : 0|8@1+ (1,0) [0|0] "" ECU\n\n' for i in (100, 101))
    result = codec(tmp_path, text)
    assert "x.dbc:12: warning: there is another message 'Status': this one is 'Status_65' here" in result.stderr
    assert [(m.name, m.id) for m in read_messages(tmp_path / "x.dbc").messages] == [("Status", 100), ("Status_65", 101)]
    assert compiled(tmp_path, text, reads("Status_65")).exit_code == 0


def test_an_id_of_29_bits_without_its_mark_is_one_all_the_same(tmp_path: Path) -> None:
    result = codec(
        tmp_path, 'BO_ 316495015 Zone: 8 Robot\n SG_ a : 0|8@1+ (1,0) [0|0] "" ECU\nCM_ BO_ 316495015 "of it";\n'
    )
    assert result.exit_code == 0 and "needs more than 11 bits, so it is taken as one of 29" in result.stderr
    (message,) = read_messages(tmp_path / "x.dbc").messages
    assert (message.id, message.extended, message.comment) == (0x12DD54A7, True, "of it")


@pytest.mark.parametrize(
    "line",
    [
        'CM_ SG_ 100 "no name";', 'CM_ 100 "what";', 'CM_ SG_ 7 a "no such message";', 'VAL_ 7 a 1 "x" ;',
        'VAL_ 100 b 1 "x" ;',
        "SIG_VALTYPE_ 7 a : 1;", "SIG_VALTYPE_ 100 b : 1;", 'BA_ "Unknown" BO_ 100 5;', 'BA_ "Unknown" BO_ 100 True;',
        'BA_DEF_ BO_ "B" BOOL False True;', "SIG_GROUP_ 100 G 1 : a b;",
        'EV_ E: 0 [0|1] "" 0 1 DUMMY_NODE_VECTOR0 Vector__XXX;',
        "BO_TX_BU_ 7 : ECU;", "SG_MUL_VAL_ 7 a b 1-1;", "// BO_ 5 X: 8 Robot",
        'CM_ BO_ 7 "has \\"BO_ 5 X: 8 Robot\\" in it";',
        'BA_DEF_REL_ BU_SG_REL_ "R" INT 0 1;', "CAT_DEF_ 1 A 0;", 'CM_ "a // b";', 'VAL_TABLE_ T 1 "x" ;',
        'CM_ EV_ E "\n BO_ 5 X: 8 Robot\n";', "FILTER", "SGTYPE_ x : 1;",
    ],
)  # fmt: skip
def test_a_harmless_line_costs_nothing(tmp_path: Path, line: str) -> None:
    result = codec(tmp_path, f"{GOOD}{line}\n\n" + GOOD.replace("100 Good", "102 Last"))
    assert result.exit_code == 0 and result.stderr == "", result.stderr
    assert [(m.name, m.length) for m in read_messages(tmp_path / "x.dbc").messages] == [("Good", 8), ("Last", 8)]


def test_a_number_may_begin_with_its_point(tmp_path: Path) -> None:
    codec(tmp_path, 'BO_ 1 A: 8 Robot\n SG_ a : 0|8@1+ (.25,-.5) [-.5|+63.25] "" ECU\n')
    (signal,) = read_messages(tmp_path / "x.dbc").messages[0].signals
    assert (str(signal.scale), str(signal.offset), signal.low, signal.high) == ("0.25", "-0.5", 0, 255)


def test_one_name_in_two_branches_is_one_signal(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        'BO_ 100 Metis: 8 Robot\n SG_ Page M : 0|8@1+ (1,0) [0|0] "" ECU\n SG_ id m0 : 8|32@1+ (1,0) [0|0] "" ECU\n'
        ' SG_ id m1 : 8|32@1+ (1,0) [0|0] "" ECU\n SG_ other m2 : 8|8@1+ (1,0) [0|0] "" ECU\n'
        ' SG_ other m3 : 16|8@1+ (1,0) [0|0] "" ECU\n',
    )
    built, (message,) = library(tmp_path, path)
    assert [s.name for s in message.signals] == ["Page", "id", "other", "other_m3"]
    for page, wanted in ((0, {"id": 0x0A090807}), (1, {"id": 0x0A090807}), (2, {"other": 7}), (3, {"other_m3": 8})):
        assert built.decode(0, message, bytes([page, 7, 8, 9, 10, 0, 0, 0])) == (0, {"Page": page} | wanted)


def test_a_huge_range_of_a_multiplexer_takes_no_time(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        'BO_ 100 Msg1: 8 Robot\n SG_ S4 m0 : 32|8@1+ (1,0) [0|0] "" ECU\n SG_ S1 M : 0|32@1+ (1,0) [0|0] "" ECU\n\n'
        "SG_MUL_VAL_ 100 S4 S1 0-1000000;\n",
    )
    built, (message,) = library(tmp_path, path)
    for value, result in ((0, 0), (999_999, 0), (1_000_000, 0), (1_000_001, -2)):
        assert built.decode(0, message, value.to_bytes(4, "little") + b"\x05\0\0\0")[0] == result


def test_a_cycle_need_not_be_a_whole_number_of_ms(tmp_path: Path) -> None:
    cycle = 'BA_DEF_ BO_ "GenMsgCycleTime" FLOAT 0 1000;\nBA_ "GenMsgCycleTime" BO_ 100 33.3;\n'
    assert compiled(tmp_path, GOOD + cycle, reads("Good")).exit_code == 0
    assert read_bus(tmp_path / "x.dbc", "ECU", 10).receive[0].timeout_us == 166_500
    result = compiled(tmp_path, GOOD + cycle, node="Robot")
    assert (
        result.exit_code == 2
        and "GenMsgCycleTime of message 'Good' is 33.3, and must be a whole number" in result.stderr
    )


def test_signs_in_a_table_make_names(tmp_path: Path) -> None:
    names = ["---", "A-B", "Fuse- closed", "Fuse+ closed", "", "+", "-", "-5 V", "", "reserved", "Reserved"]
    table = " ".join(f'{value} "{name}"' for value, name in enumerate(names))
    assert codec(tmp_path, f"{GOOD}VAL_ 100 a {table} ;\n").exit_code == 0
    header = (tmp_path / "out" / "x_codec.h").read_text()
    stem = "X_GOOD_A_"
    for value, name in ((3, "FUSE_PLUS_CLOSED"), (2, "FUSE_MINUS_CLOSED"), (1, "A_B"), (0, "VALUE_0"), (5, "PLUS"),
                        (6, "MINUS"), (7, "MINUS_5_V"), (8, "VALUE_8"), (10, "RESERVED_2")):  # fmt: skip
        assert f"{stem}{name} = {value}" in header


def test_names_of_other_alphabets(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        'BO_ 100 电池: 8 Robot\n SG_ 温度 : 0|8@1+ (1,-40) [-40|215] "℃" ECU\n'
        ' SG_ Größe : 8|8@1+ (1,0) [0|0] "" ECU\n\n'
        'CM_ SG_ 100 温度 "电池温度 误差";\nVAL_ 100 温度 255 "无效" ;\n',
        "电池.dbc",
    )
    bus = read_messages(path)
    (message,) = bus.messages
    assert message.name == "电池" and message.c_name == "u7535_u6c60"
    assert [(s.name, s.c_name, s.unit) for s in message.signals] == [
        ("温度", "u6e29_u5ea6", "℃"),
        ("Größe", "gr_uf6_udf_e", ""),
    ]
    assert message.signals[0].choices == ((255, "无效"),) and message.signals[0].comment == "电池温度 误差"
    built, _ = library(tmp_path, path)
    assert built.decode(0, message, bytes([60, 7, *[0] * 6])) == (0, {"温度": 60, "Größe": 7})


def test_bytes_of_another_encoding_are_no_more_than_texts(tmp_path: Path) -> None:
    (tmp_path / "x.dbc").write_bytes((HEAD + GOOD).encode() + b'CM_ SG_ 100 a "\xb5\xe7\x81\xff";\n')
    assert len(read_messages(tmp_path / "x.dbc").messages) == 1


@pytest.mark.parametrize(
    ("signal", "text"),
    [
        ("a : 0|1@1- (1,0) [0|0]", "has one bit and a sign: its values are 0 and -1"),
        ("a : 0|1@1- (1,0) [0|1]", "has one bit and a sign: its values are 0 and -1"),
        ("a : 0|16@1+ (0.01,0) [0|1]", "takes 101 of the 65536 values of its bits"),
        ("a : 0|8@1- (1,0) [0|255]", "none below 0: its range is one of an unsigned signal"),
        ("a : 0|8@1+ (1,0) [300|400]", "no value of signal 'Good.a' is in its range [300, 400]"),
    ],
)
def test_what_nobody_can_have_meant_gets_a_warning(tmp_path: Path, signal: str, text: str) -> None:
    dbc = GOOD.replace("a : 0|8@1+ (1,0) [0|0]", signal)
    for result in (codec(tmp_path, dbc), compiled(tmp_path, dbc, reads("Good"))):
        assert result.exit_code == 0 and "x.dbc:10: warning: " in result.stderr and text in result.stderr


def test_no_range_is_better_than_one_that_takes_nothing(tmp_path: Path) -> None:
    dbc = GOOD.replace("[0|0]", "[300|400]")
    built, (message,) = library(tmp_path, write(tmp_path, dbc))
    assert built.decode(0, message, bytes([77, *[0] * 7])) == (0, {"a": 77})
    sent = compiled(tmp_path, dbc, node="Robot")
    assert sent.exit_code == 2 and '[message.Good.signal.a] range = [LOW, HIGH], or "any"' in sent.stderr


def test_scales_of_all_sorts_against_cantools(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        'BO_ 100 F: 8 Robot\n SG_ a : 0|64@1+ (0.001,-1000) [0|0] "" ECU\n\n'
        'BO_ 101 G: 8 Robot\n SG_ a : 7|64@0- (-0.5,3.25) [-10|10] "" ECU\n\n'
        'BO_ 102 K: 8 Robot\n SG_ a : 0|64@1+ (1,0) [0|18446744073709551615] "" ECU\n\n'
        'BO_ 103 L: 8 Robot\n SG_ a : 0|32@1+ (1E-07,-1E+02) [0|0] "deg" ECU\n',
    )
    built, messages = library(tmp_path, path)
    peer = cantools.database.load_file(path)
    assert isinstance(peer, cantools.database.can.Database)
    rng = random.Random(7)
    for number, message in enumerate(messages):
        for _ in range(50):
            data = rng.randbytes(8)
            raw = peer.get_message_by_name(message.name).decode_simple(data, scaling=False)["a"]
            assert isinstance(raw, int)
            result, found = built.decode(number, message, data)
            taken = message.signals[0].low <= raw <= message.signals[0].high
            assert (result, found) == ((0, {"a": as_int64(raw)}) if taken else (-2, found))


def test_names_that_c_does_not_have(tmp_path: Path) -> None:
    names = [
        "linux",
        "NULL",
        "errno",
        "uint8_t",
        "data",
        "asm",
        "memcpy",
        "class",
        "limited",
        "self",
        "int32_t",
        "typeof",
    ]
    signals = "".join(f' SG_ {name} : {4 * i}|4@1+ (1,0) [0|0] "" ECU\n' for i, name in enumerate(names))
    case = "".join(
        f' SG_ {name} : {8 * i}|8@1+ (1,0) [0|0] "" ECU\n' for i, name in enumerate(("aB", "a_b", "A_B", "a_b_2"))
    )
    long = 80 * "Very"
    path = write(
        tmp_path,
        f"BO_ 100 unix: 8 Robot\n{signals}\nBO_ 101 length: 8 Robot\n{signals}\nBO_ 102 Foo: 8 Robot\n{case}\n"
        f"BO_ 103 FOO: 8 Robot\n{case}\nBO_ 104 {long}: 8 Robot\n"
        f' SG_ {long}A : 0|8@1+ (1,0) [0|0] "" ECU\n SG_ {long}B : 8|8@1+ (1,0) [0|0] "" ECU\n',
        "2020 car-v1.2.dbc",
    )
    _, messages = library(tmp_path, path)
    assert len(messages) == 5


def test_a_reversed_range_of_a_multiplexer_selects_nothing(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        'BO_ 2348873389 Msg1: 8 Robot\n SG_ S4 m0 : 32|8@1- (1,0) [0|0] "" ECU\n SG_ S3 : 48|8@1- (1,0) [0|0] "" ECU\n'
        ' SG_ S2 m0M : 24|8@1- (1,0) [0|0] "" ECU\n SG_ S1 M : 0|24@1- (1,0) [0|0] "" ECU\n\n'
        "SG_MUL_VAL_ 2348873389 S4 S2 0-0;\nSG_MUL_VAL_ 2348873389 S2 S1 1-1, 2-1, 5-7;\n",
    )
    built, (message,) = library(tmp_path, path)
    assert built.decode(0, message, bytes([1, 0, 0, 0, 9, 0, 3, 0])) == (0, {"S1": 1, "S3": 3, "S2": 0, "S4": 9})
    assert built.decode(0, message, bytes([2, 0, 0, 0, 9, 0, 3, 0]))[0] == -2


def test_a_message_that_is_asked_for_by_name_is_not_left_out(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD + bad_message("scale")[0])
    with pytest.raises(CompileError, match="has the scale 0"):
        read_messages(path, only=("Bad",))
