# SPDX-License-Identifier: MIT
"""A small bus for trees with scripts: a number with an offset, one with a table, and one that is multiplexed."""

from __future__ import annotations

from pathlib import Path

DBC = """VERSION ""

NS_ :

BS_:

BU_: Controller Room

BO_ 256 Climate: 8 Room
 SG_ Temperature : 0|12@1- (0.5,-10) [-60|60] "degC" Controller
 SG_ Door : 16|2@1+ (1,0) [0|2] "" Controller
 SG_ Kind M : 24|1@1+ (1,0) [0|1] "" Controller
 SG_ Extra m1 : 32|8@1+ (1,0) [0|200] "" Controller

BO_ 257 Desk: 1 Room
 SG_ Wanted : 0|8@1+ (1,0) [0|100] "" Controller

BO_ 512 FanCommand: 1 Controller
 SG_ Speed : 0|8@1+ (1,0) [0|100] "%" Room

BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ SG_ "GenSigInactiveValue" INT 0 255;
BA_DEF_DEF_ "GenMsgCycleTime" 100;
BA_DEF_DEF_ "GenSigInactiveValue" 0;
VAL_ 256 Door 0 "Shut" 1 "Open" 2 "Broken" ;
"""
NODE = "Controller"


def write_dbc(folder: Path) -> Path:
    """The bus as a file."""
    path = folder / "room.dbc"
    path.write_text(DBC)
    return path
