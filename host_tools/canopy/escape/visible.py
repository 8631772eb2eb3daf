# SPDX-License-Identifier: MIT
"""Characters that one does not see, as escapes that one does see.

Control characters (C0 and C1) move a terminal's cursor and change its state, bidirectional ones show text in another
order than the compiler reads it, and line separators forge a line of their own. None of them is in a name on purpose.
"""

from __future__ import annotations

import unicodedata

LONGEST = 2_000
"""Of a text that is shown in a message; a name of a megabyte helps nobody."""


def _escape(character: str) -> str:
    if unicodedata.category(character) == "Zs":
        return " "  # as wide as a blank, and means one
    code = ord(character)
    if 0xDC80 <= code <= 0xDCFF:  # a byte of a file's name that is not UTF-8, as Python keeps it
        code -= 0xDC00
    named = {"\n": "\\n", "\r": "\\r", "\t": "\\t"}.get(character)
    return named or (f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}" if code < 65536 else f"\\U{code:08x}")


def visible(text: str, keep: str = "") -> str:
    """The text on one line: every character that cannot be printed as an escape (`\\x1b`), but those in `keep`."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else _escape(c) for c in text)


def brief(text: str) -> str:
    """visible(), with the middle left out where it is longer than any reader has patience for."""
    if len(text) > LONGEST:
        half = LONGEST // 2
        text = f"{text[:half]} … ({len(text) - LONGEST} characters) … {text[-half:]}"
    return visible(text)
