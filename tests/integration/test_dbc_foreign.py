# SPDX-License-Identifier: MIT
"""KCD, SYM and ARXML: the same bus is the same codec, the overlay works, and what is unreadable is named."""

from __future__ import annotations

from pathlib import Path

import cantools.database
import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from canopy.compiler.bus_reader import read_bus, read_messages

DBC = """\
VERSION ""

NS_ :

BS_:

BU_: ECU Robot

BO_ 256 Drive: 8 Robot
 SG_ Speed : 0|16@1+ (0.1,-10) [-10|100] "m/s" ECU
 SG_ Motor : 23|16@0- (1,0) [0|0] "" ECU
 SG_ Mode : 32|2@1+ (1,0) [0|3] "" ECU

BO_ 2566844926 Wide: 8 ECU
 SG_ Level : 0|32@1+ (1,0) [0|0] "" Robot

BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 256 20;
VAL_ 256 Mode 0 "Off" 1 "On" ;
"""


def _signal(name: str, length: int) -> str:
    """An ISignal, and the system signal behind it."""
    return (
        f"<I-SIGNAL><SHORT-NAME>{name}</SHORT-NAME><LENGTH>{length}</LENGTH><SYSTEM-SIGNAL-REF DEST='SYSTEM-SIGNAL'>"
        f"/P/Sys{name}</SYSTEM-SIGNAL-REF></I-SIGNAL><SYSTEM-SIGNAL><SHORT-NAME>Sys{name}</SHORT-NAME></SYSTEM-SIGNAL>"
    )


def _mapping(name: str, start: int, order: str) -> str:
    return (
        f"<I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>{name}</SHORT-NAME>"
        f"<I-SIGNAL-REF DEST='I-SIGNAL'>/P/{name}</I-SIGNAL-REF>"
        f"<PACKING-BYTE-ORDER>{order}</PACKING-BYTE-ORDER><START-POSITION>{start}</START-POSITION>"
        "</I-SIGNAL-TO-I-PDU-MAPPING>"
    )


LITTLE, BIG = "MOST-SIGNIFICANT-BYTE-LAST", "MOST-SIGNIFICANT-BYTE-FIRST"
ARXML = f"""<?xml version="1.0" encoding="UTF-8"?>
<AUTOSAR xmlns="http://autosar.org/schema/r4.0" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:schemaLocation="http://autosar.org/schema/r4.0 AUTOSAR_4-2-1.xsd"><AR-PACKAGES><AR-PACKAGE>
<SHORT-NAME>P</SHORT-NAME><ELEMENTS>
<CAN-CLUSTER><SHORT-NAME>C</SHORT-NAME><CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL><PHYSICAL-CHANNELS>
<CAN-PHYSICAL-CHANNEL><SHORT-NAME>Ch</SHORT-NAME><FRAME-TRIGGERINGS><CAN-FRAME-TRIGGERING><SHORT-NAME>T</SHORT-NAME>
<FRAME-REF DEST="CAN-FRAME">/P/Drive</FRAME-REF><CAN-ADDRESSING-MODE>STANDARD</CAN-ADDRESSING-MODE>
<IDENTIFIER>256</IDENTIFIER></CAN-FRAME-TRIGGERING></FRAME-TRIGGERINGS></CAN-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS>
</CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS></CAN-CLUSTER>
<CAN-FRAME><SHORT-NAME>Drive</SHORT-NAME><FRAME-LENGTH>8</FRAME-LENGTH><PDU-TO-FRAME-MAPPINGS><PDU-TO-FRAME-MAPPING>
<SHORT-NAME>M</SHORT-NAME><PACKING-BYTE-ORDER>{LITTLE}</PACKING-BYTE-ORDER>
<PDU-REF DEST="I-SIGNAL-I-PDU">/P/Pdu</PDU-REF><START-POSITION>0</START-POSITION></PDU-TO-FRAME-MAPPING>
</PDU-TO-FRAME-MAPPINGS></CAN-FRAME>
<I-SIGNAL-I-PDU><SHORT-NAME>Pdu</SHORT-NAME><LENGTH>8</LENGTH><I-SIGNAL-TO-PDU-MAPPINGS>
{_mapping("Speed", 0, LITTLE)}{_mapping("Motor", 23, BIG)}{_mapping("Mode", 32, LITTLE)}
</I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>
{_signal("Speed", 16)}{_signal("Motor", 16)}{_signal("Mode", 2)}
</ELEMENTS></AR-PACKAGE></AR-PACKAGES></AUTOSAR>
"""


def codec(path: Path) -> Result:
    return CliRunner().invoke(main, ["codec", str(path), "-o", str(path.parent / "out")])


def written(folder: Path, kind: str) -> Path:
    """The bus in a file of that kind, by cantools; of ARXML, which it does not write, one message by hand."""
    database = cantools.database.load_string(DBC, database_format="dbc")
    assert isinstance(database, cantools.database.can.Database)
    texts = {"dbc": DBC, "kcd": database.as_kcd_string(), "sym": database.as_sym_string(), "arxml": ARXML}
    (folder / f"bus.{kind}").write_text(texts[kind])
    return folder / f"bus.{kind}"


@pytest.mark.parametrize("kind", ["kcd", "sym", "arxml"])
def test_a_kind_gives_the_layout_that_the_dbc_gives(tmp_path: Path, kind: str) -> None:
    wanted = {m.name: m for m in read_messages(written(tmp_path, "dbc")).messages}
    path = written(tmp_path, kind)
    result = codec(path)
    assert result.exit_code == 0, result.output
    found = read_messages(path).messages
    assert [m.name for m in found] == (["Drive"] if kind == "arxml" else ["Drive", "Wide"])
    for message in found:
        like = wanted[message.name]
        assert (message.id, message.extended, message.length) == (like.id, like.extended, like.length)
        for signal in message.signals:
            (other,) = (s for s in like.signals if s.name == signal.name)
            assert (signal.start, signal.length, signal.little_endian) == (
                other.start,
                other.length,
                other.little_endian,
            )
            if kind != "arxml":  # this one says nothing of values
                assert (signal.scale, signal.offset, signal.low, signal.high) == (
                    other.scale, other.offset, other.low, other.high,
                )  # fmt: skip
                assert signal.signed == other.signed and signal.choices == other.choices


@pytest.mark.parametrize("kind", ["kcd", "sym", "arxml"])
def test_the_same_overlay_works_for_each(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, kind)
    (tmp_path / "bus.overlay.toml").write_text(
        '[message.Drive]\nreceivers = ["Pilot"]\ntimeout_ms = 70\nsenders = ["Robot"]\n'
        "[message.Drive.signal.Speed]\nrange = [0, 10]\n"
    )
    bus = read_bus(path, "Pilot", 10)
    assert [(m.name, m.timeout_us) for m in bus.receive] == [("Drive", 70_000)]
    made = CliRunner().invoke(main, ["dbc", "overlay", str(path), "--node", "Pilot", "-o", "-"])
    assert made.exit_code == 0 and "Nothing is missing" in made.stdout


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("bus.xls", "x", "a .xls file cannot be read: DBC, KCD, SYM and ARXML can"),
        ("bus.json", "{}", "pip install canmatrix; canconvert bus.json bus.dbc"),
        ("bus.ldf", "LIN_description_file;", "a .ldf file describes a LIN bus, not a CAN bus"),
        ("bus.kcd", "<x", "bus.kcd: error: not a KCD file that can be read"),
        ("bus.kcd", '<!DOCTYPE a [<!ENTITY b "c">]><a/>', "with a DOCTYPE or an ENTITY is not read"),
        ("bus.sym", "FormatVersion=5.0", "Only SYM version 6.0 is supported"),
        ("bus.arxml", ARXML.replace("<AUTOSAR ", "<OTHER ", 1), "bus.arxml: error: not a ARXML file"),
        ("bus.arxml", ARXML.replace("/P/Pdu", "/P/Gone"), "bus.arxml: error: not a ARXML file that can be read"),
        ("bus.arxml", ARXML.replace("<FRAME-LENGTH>8</FRAME-LENGTH>", ""), "it has parts that cantools does not know"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named(tmp_path: Path, name: str, content: str, text: str) -> None:
    (tmp_path / name).write_text(content)
    result = codec(tmp_path / name)
    assert result.exit_code == 2 and text in result.stderr, result.output
    assert "NoneType" not in result.stderr and "Traceback" not in result.stderr
