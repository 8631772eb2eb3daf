# SPDX-License-Identifier: MIT
"""Text in XML: SVG for browsers."""

from __future__ import annotations

from xml.sax.saxutils import escape

from canopy.escape.visible import visible


def text(value: str) -> str:
    """The text between tags."""
    return escape(visible(value))
