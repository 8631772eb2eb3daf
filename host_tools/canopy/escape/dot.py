# SPDX-License-Identifier: MIT
"""Text in DOT, Graphviz's language."""

from __future__ import annotations

from canopy.escape.visible import visible


def quoted(*lines: str) -> str:
    """A quoted string of these lines. A backslash is a character, not the start of an escape like \\N or \\G."""
    clean = (visible(line).replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + "\\n".join(clean) + '"'
