# SPDX-License-Identifier: MIT
"""Names of trees and buses as C identifiers."""

from __future__ import annotations

import re

C_KEYWORDS = frozenset(
    [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
        "bool",
        "true",
        "false",
        "_Bool",
        "_Alignas",
        "_Alignof",
        "_Atomic",
        "_Generic",
        "_Noreturn",
        "_Static_assert",
        "_Thread_local",
    ]
)


def snake(name: str) -> str:
    """`WalkHome`, `walk-home` and `Walk Home` become `walk_home`; `E2E_CRC` becomes `e2e_crc`."""
    text = re.sub(r"[^0-9A-Za-z]+", "_", name)
    # Between aB and before the last capital of ABc; looking back and ahead takes no longer for a longer name.
    text = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z0-9])(?=[A-Z][a-z])", "_", text)
    text = re.sub(r"_+", "_", text).strip("_").lower()
    if not text or text[0].isdigit() or text in C_KEYWORDS:
        text = f"_{text}" if text and text[0].isdigit() else f"{text}_"
    return text


def is_c_identifier(name: str) -> bool:
    """Can `name` stand in C as it is?"""
    return re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) is not None and name not in C_KEYWORDS
