# SPDX-License-Identifier: MIT
"""The guide's CAN driver and main() for a board compile as they stand, over what a vendor's library has."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

from canopy.cli import main
from integration.codec_harness import WARNINGS

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs/leaves.md").read_text(encoding="utf-8")
BOARD = """\
#include <stdbool.h>
#include <stdint.h>
#include "canopy/can.h"
uint64_t board_microseconds(void);
void board_init(void);
void board_reset(void);
void board_sleep(void);
void board_kick_watchdog(void);
bool board_can_read(canopy_can_frame_t *frame, uint16_t *stamp);
uint32_t board_can_timer(void);
uint32_t board_can_lost(void);
void board_can_write(uint8_t mailbox, const canopy_can_frame_t *frame);
bool board_can_is_pending(uint8_t mailbox);
bool board_can_was_acknowledged(uint8_t mailbox);
void board_can_abort(uint8_t mailbox);
void board_can_pend_tx_interrupt(void);
void board_can_clear_tx_interrupt(void);
bool board_can_is_bus_off(void);
void board_can_recover(void);
void board_can_init(void);
void CAN_RX_IRQHandler(void);
void CAN_TX_IRQHandler(void);
extern const canopy_can_t board_can;
"""


def block(language: str, marker: str) -> str:
    """The first block of the guide in this language that has the marker in it."""
    found: list[str] = re.findall(rf"^```{language}\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
    return next(text for text in found if marker in text)


@pytest.mark.parametrize("marker", ["CAN_TX_IRQHandler", "board_init();"])
def test_the_boards_code_compiles(tmp_path: Path, marker: str) -> None:
    (tmp_path / "charge.xml").write_text(block("xml", "DriveToCharger"), encoding="utf-8")
    (tmp_path / "charge_state.h").write_text("typedef struct { int ticks; } drive_state_t;\n", encoding="utf-8")
    (tmp_path / "board.h").write_text(BOARD, encoding="utf-8")
    (tmp_path / "code.c").write_text(block("c", marker), encoding="utf-8")
    arguments = ["compile", str(tmp_path / "charge.xml"), "--dbc", str(ROOT / "examples/nao/nao.dbc")]
    arguments += ["--node", "Controller", "--period-ms", "50", "--include", "charge_state.h", "-o", str(tmp_path)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    includes = [f"-I{tmp_path}", f"-I{ROOT / 'runtime/include'}"]
    subprocess.run(["gcc", *WARNINGS, *includes, "-c", str(tmp_path / "code.c"), "-o", "/dev/null"], check=True)
