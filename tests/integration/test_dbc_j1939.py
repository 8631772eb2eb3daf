# SPDX-License-Identifier: MIT
"""J1939 and NMEA 2000: logs with real parameter groups, several sources and packets reach the leaves as they should."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.bus.decode import IdTable
from canopy.cli import main
from canopy.compiler.bus_reader import read_bus, read_messages
from canopy.model import ModelError, load_model
from canopy.replay.log import Bus
from integration.codec_harness import ROOT, WARNINGS

HEAD = 'VERSION ""\n\nBU_: Gauge Vector__XXX\n\n'
J1939 = """
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_DEF_ "VFrameFormat" "J1939PG";
"""
# PGN 61444 (EEC1), 65265 (CCVS1), 65226 (DM1, 10 bytes in several packets), 0 (TSC1, which has a destination).
TRUCK = f"""{HEAD}BO_ 2364540158 EEC1: 8 Vector__XXX
 SG_ EngineSpeed : 24|16@1+ (0.125,0) [0|8031.875] "rpm" Gauge

BO_ 2566844926 CCVS1: 8 Vector__XXX
 SG_ Speed : 8|16@1+ (0.00390625,0) [0|250.996] "km/h" Gauge

BO_ 2566834942 DM1: 10 Vector__XXX
 SG_ Lamps : 0|16@1+ (1,0) [0|0] "" Gauge
 SG_ Spn1 : 16|16@1+ (1,0) [0|0] "" Gauge
 SG_ Spn2 : 48|16@1+ (1,0) [0|0] "" Gauge

BO_ 2348810494 TSC1: 8 Vector__XXX
 SG_ Torque : 24|8@1+ (1,-125) [-125|125] "%" Gauge
{J1939}"""
LEAF = """
#include <stdio.h>
#include "truck_leaves.h"

canopy_status_t look_tick(const truck_input_t *in)
{
    if (in->eec1_left.fresh) {
        printf("left %u ", (unsigned)in->eec1_left.engine_speed);
    }
    if (in->eec1_right.fresh) {
        printf("right %u ", (unsigned)in->eec1_right.engine_speed);
    }
    if (in->ccvs1.fresh) {
        printf("speed %u age %u ", (unsigned)in->ccvs1.speed, (unsigned)in->ccvs1.age_ms);
    }
    if (in->dm1.fresh) {
        printf("lamps %u spns %u %u ", (unsigned)in->dm1.lamps, (unsigned)in->dm1.spn1, (unsigned)in->dm1.spn2);
    }
    if (in->tsc1.fresh) {
        printf("torque %d ", (int)in->tsc1.torque - 125);
    }
    printf("\\n");
    return CANOPY_SUCCESS;
}
"""
TREE = """<root BTCPP_format="4"><BehaviorTree ID="T"><Look/></BehaviorTree>
<TreeNodesModel><Condition ID="Look"/></TreeNodesModel></root>"""
OVERLAY = """
[message.EEC1]
timeout_ms = 250
sources = { Left = 0, Right = 1 }
[message.CCVS1]
timeout_ms = 250
[message.DM1]
timeout_ms = 3000
[message.TSC1]
timeout_ms = 250
destination = 33
"""


def compile_it(folder: Path, dbc: str, overlay: str, name: str = "truck", more: tuple[str, ...] = ()) -> Result:
    (folder / f"{name}.dbc").write_text(dbc)
    (folder / f"{name}.overlay.toml").write_text(overlay)
    (folder / "t.xml").write_text(TREE)
    arguments = ["compile", str(folder / "t.xml"), "--dbc", str(folder / f"{name}.dbc"), "--node", "Gauge"]
    return CliRunner().invoke(main, [*arguments, "--period-ms", "100", "--name", name, "-o", str(folder), *more])


def play(folder: Path, leaf: str, log: list[str], name: str = "truck") -> list[str]:
    """What the leaf prints in each cycle, and the counters."""
    (folder / "leaf.c").write_text(leaf)
    sources = [folder / f"{name}_app.c", folder / f"{name}_bus.c", folder / "leaf.c"]
    player = ROOT / "tests" / "integration" / "dbc_met" / "log_player.c.in"
    (folder / "log_player.c").write_text(player.read_text())
    sources += [folder / "log_player.c", *(ROOT / "drivers" / "can" / "loopback").glob("*.c")]
    sources += (ROOT / "runtime" / "src").rglob("*.c")
    folders = [ROOT / "runtime" / "include", ROOT / "runtime" / "src", ROOT / "drivers" / "include", folder]
    define = [f"-DAPP={name}_app", f'-DAPP_H="{name}_app.h"']
    command = ["gcc", "-std=c11", "-D_POSIX_C_SOURCE=200809L", "-O1", *WARNINGS, "-fsanitize=address,undefined"]
    command += ["-fno-sanitize-recover=all", *define, *(f"-I{path}" for path in folders)]
    subprocess.run([*command, *map(str, sources), "-o", folder / "player"], check=True)
    text = "".join(f"({line.split()[0]}) can0 {line.split()[1]}\n" for line in log)
    result = subprocess.run([folder / "player"], input=text, capture_output=True, text=True, check=True)
    return [line.strip() for line in result.stdout.splitlines()]


def test_a_truck_is_seen_by_its_groups(tmp_path: Path) -> None:
    result = compile_it(tmp_path, TRUCK, OVERLAY)
    assert result.exit_code == 0, result.output
    log = [
        "0.010 0CF00400#FFFFFF6813FFFFFF",  # EEC1 of engine 0, priority 3: 621 rpm
        "0.020 0CF00401#FFFFFFD007FFFFFF",  # of engine 1
        "0.030 0CF00402#FFFFFFFFFFFFFFFF",  # of one that nobody asked for
        "0.050 18FEF117#FF00100000FFFFFF",  # CCVS1 of 0x17, priority 6
        "0.060 18FEF021#FFFFFFFFFFFFFFFF",  # another group
        "0.070 0C002103#000000AFFFFFFFFF",  # TSC1 to us: 50 %
        "0.080 0C000003#000000FAFFFFFFFF",  # TSC1 to the engine
        "0.110 1CECFF00#200A0002FFCAFE00",  # DM1 of the engine is announced: 10 bytes
        "0.150 0CF00400#FFFFFF0010FFFFFF",
        "0.160 1CEBFF00#0104005B00002701",
        "0.170 1CECFF21#20140003FFDAFE00",  # a broadcast of somebody else
        "0.180 1CEBFF21#0101020304050607",
        "0.210 1CEBFF00#02040001FFFFFFFF",
        "0.450 10FEF1FE#FF34120000FFFFFF",  # CCVS1 again, from another source and with another priority
    ]
    lines = play(tmp_path, LEAF, log)
    assert lines == [
        "left 4968 right 2000 speed 4096 age 50 torque 50",
        "left 4096 right 2000 speed 4096 age 150 torque 50",
        "left 4096 lamps 4 spns 91 1025 torque 50",
        "lamps 4 spns 91 1025",
        "speed 4660 age 50 lamps 4 spns 91 1025",
        "accepted 7 unknown 2 rejected 0",
    ]


def test_a_boat_is_seen_by_its_groups(tmp_path: Path) -> None:
    # NMEA 2000: PGN 127250 (vessel heading), 128267 (water depth), 130306 (wind), from two compasses.
    dbc = (
        'VERSION ""\n\nBU_: Gauge\n\n'
        'BO_ 2314277630 Heading: 8 Vector__XXX\n SG_ Sid : 0|8@1+ (1,0) [0|253] "" Gauge\n'
        ' SG_ Heading : 8|16@1+ (0.0001,0) [0|6.5532] "rad" Gauge\n\n'
        'BO_ 2381646846 Depth: 8 Vector__XXX\n SG_ Depth : 8|32@1+ (0.01,0) [0|0] "m" Gauge\n\n'
        'BO_ 2315059966 Wind: 8 Vector__XXX\n SG_ Speed : 8|16@1+ (0.01,0) [0|655.32] "m/s" Gauge\n'
    )
    overlay = (
        'protocol = "j1939"\n[message.Heading]\ntimeout_ms = 500\nsources = { Bow = 35, Stern = 36 }\n'
        "[message.Depth]\ntimeout_ms = 500\n[message.Wind]\ntimeout_ms = 500\nsource = 7\n"
    )
    leaf = """
#include <stdio.h>
#include "boat_leaves.h"

canopy_status_t look_tick(const boat_input_t *in)
{
    printf("%d %u %d %u ", in->heading_bow.fresh, (unsigned)in->heading_bow.heading, in->heading_stern.fresh,
           (unsigned)in->heading_stern.heading);
    printf("%d %u %d %u\\n", in->depth.fresh, (unsigned)in->depth.depth, in->wind.fresh, (unsigned)in->wind.speed);
    return CANOPY_SUCCESS;
}
"""
    result = compile_it(tmp_path, dbc, overlay, "boat")
    assert result.exit_code == 0, result.output
    log = [
        "0.010 09F11223#01E803FF7FFF7FFD",
        "0.020 09F11224#01D007FF7FFF7FFD",
        "0.030 0DF50B10#01FA000000FF7FFF",
        "0.040 09FD0207#01B80B102701FFFF",
        "0.050 09FD0208#01FFFF102701FFFF",
        "0.060 19F21100#0011223344556677",
    ]
    assert play(tmp_path, leaf, log, "boat") == ["1 1000 1 2000 1 250 1 3000", "accepted 4 unknown 0 rejected 0"]


@pytest.mark.parametrize(
    ("overlay", "text"),
    [
        ("[message.EEC1]\nsource = 256", "message.EEC1.source is 256, and must be a whole number, 0 to 255"),
        ("[message.EEC1]\ndestination = 3", "parameter group 61444 of message 'EEC1' is for all"),
        ("[message.EEC1]\nsources = { 0x = 3 }", "'0x' cannot be the end of a message's name"),
        ('[message.EEC1]\nsenders = ["Gauge"]\ncycle_ms = 100', "'EEC1' is sent, and its id has no source address"),
        ('[message.DM1]\nsource = 1\nsenders = ["Gauge"]', "what comes in several packets can be received only"),
        ("[message.DM1]\ne2e_data_id = 1", "comes in several packets, and has an E2EDataId"),
    ],
)
def test_what_cannot_be_is_refused_at_its_line(tmp_path: Path, overlay: str, text: str) -> None:
    result = compile_it(tmp_path, TRUCK, overlay)
    assert result.exit_code == 2 and text in result.stderr, result.output


def test_an_address_needs_an_id_that_has_one(tmp_path: Path) -> None:
    dbc = f'{HEAD}BO_ 256 Plain: 8 Vector__XXX\n SG_ a : 0|8@1+ (1,0) [0|0] "" Gauge\n'
    result = compile_it(tmp_path, dbc, "[message.Plain]\nsource = 3\n")
    assert result.exit_code == 2 and "truck.overlay.toml:2: error: message 'Plain' has no J1939 id" in result.stderr


def test_two_messages_of_one_group_are_told_apart_by_the_sources_that_the_file_gives(tmp_path: Path) -> None:
    two = TRUCK.replace("BO_ 2566844926 CCVS1", 'BO_ 2364539915 EEC1_B: 8 Vector__XXX\n SG_ a : 0|8@1+ (1,0) [0|0] "" '
                        "Gauge\n\nBO_ 2566844926 CCVS1")  # fmt: skip
    assert compile_it(tmp_path, two, "").exit_code == 0
    masks = {message.name: message.mask for message in read_bus(tmp_path / "truck.dbc", "Gauge", 100).receive}
    assert masks["EEC1"] == masks["EEC1_B"] == 0x03FFFFFF and masks["CCVS1"] == 0x03FFFF00
    result = compile_it(tmp_path, two, '[message.EEC1]\nsource = "any"\n[message.EEC1_B]\nsource = "any"\n')
    assert "messages 'EEC1' and 'EEC1_B' have the same id" in result.stderr


def test_the_codec_says_which_bits_count(tmp_path: Path) -> None:
    (tmp_path / "truck.dbc").write_text(TRUCK)
    assert CliRunner().invoke(main, ["codec", str(tmp_path / "truck.dbc"), "-o", str(tmp_path)]).exit_code == 0
    header = (tmp_path / "truck_codec.h").read_text()
    assert "TRUCK_EEC1_MASK 0x3FFFF00u" in header and "parameter group 61444" in header


def test_a_replay_says_that_it_cannot_put_packets_together(tmp_path: Path) -> None:
    assert compile_it(tmp_path, TRUCK, OVERLAY, more=("--trace", "0x600")).exit_code == 0
    with pytest.raises(ModelError, match="DM1 comes in several packets"):
        Bus(load_model(tmp_path / "truck.model.json"))


def test_the_tools_find_messages_by_their_group(tmp_path: Path) -> None:
    (tmp_path / "truck.dbc").write_text(TRUCK)
    (tmp_path / "truck.overlay.toml").write_text(OVERLAY)
    ids = IdTable(read_messages(tmp_path / "truck.dbc").messages)
    names = {
        identifier: message.name if (message := ids.find(identifier, True)) is not None else None
        for identifier in (0x0CF00400, 0x18F00401, 0x18F00402, 0x10FEF1FE, 0x0C002103, 0x0C000003)
    }
    assert list(names.values()) == ["EEC1_Left", "EEC1_Right", None, "CCVS1", "TSC1", None]
    assert ids.find(0x400, False) is None
