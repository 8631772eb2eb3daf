# SPDX-License-Identifier: MIT
"""Which node an element names: `<MoveTo>`, or in the explicit form `<Action ID="MoveTo">`."""

from __future__ import annotations

from canopy.compiler.xml_reader import Element

EXPLICIT = ("Action", "Condition", "Control", "Decorator")


def id_of(element: Element) -> str:
    """The node's ID; empty where the explicit form lacks it."""
    return element.attributes.get("ID", "") if element.tag in EXPLICIT else element.tag
