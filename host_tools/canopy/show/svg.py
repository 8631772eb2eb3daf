# SPDX-License-Identifier: MIT
"""A tree as SVG: no library, no network, one file that any browser shows."""

from __future__ import annotations

import textwrap

from canopy.compiler.tree_reader import Tree
from canopy.escape import markup
from canopy.show.layout import Box, place
from canopy.show.order import in_order
from canopy.show.symbols import Look, look

_FONT = 12
_LINE = 15.0
_CHARACTER = 6.9  # mean width of a character at this size, in the widest of the usual sans-serif fonts
_SIGN_FONT = 20
_SIGN_CHARACTER = 13.0
_MARGIN = 16.0
_WRAP = 16
_FONTS = "system-ui, 'DejaVu Sans', 'Segoe UI', Helvetica, Arial, sans-serif"


def _lines(text: str) -> list[str]:
    """Lines of about equal length: the narrowest that need no more lines than _WRAP does."""

    def wrapped(width: int) -> list[str]:
        return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)

    best = wrapped(_WRAP)
    for width in range(_WRAP - 1, 0, -1):
        narrower = wrapped(width)
        if len(narrower) > len(best):
            break
        best = narrower
    return best


def _size(shown: Look) -> tuple[float, float]:
    lines = _lines(shown.text)
    text_width = max((len(line) for line in lines), default=0) * _CHARACTER
    if not shown.sign:
        return text_width + (34 if shown.shape == "oval" else 18), len(lines) * _LINE + (
            18 if shown.shape == "oval" else 12
        )
    sign_width = max(34.0, len(shown.sign) * _SIGN_CHARACTER + 16)
    if len(shown.sign) > 3:
        sign_width = len(shown.sign) * _CHARACTER + 18
    return max(sign_width, text_width + 18), 30 + len(lines) * _LINE


def _shape(box: Box, shown: Look) -> str:
    paint = f'fill="{shown.fill}" stroke="{shown.line}" stroke-width="1.4"'
    left, top = box.x - box.width / 2, box.y
    if shown.shape == "oval":
        return (
            f'<ellipse cx="{box.x:.1f}" cy="{top + box.height / 2:.1f}" rx="{box.width / 2:.1f}" '
            f'ry="{box.height / 2:.1f}" {paint}/>'
        )
    rounded = ' rx="9"' if shown.shape == "diamond" else ' rx="1"'
    return f'<rect x="{left:.1f}" y="{top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}"{rounded} {paint}/>'


def _words(box: Box, shown: Look) -> list[str]:
    parts = []
    lines = _lines(shown.text)
    y = box.y + (box.height - len(lines) * _LINE) / 2 + 11.5
    if shown.sign:
        size = _SIGN_FONT if len(shown.sign) <= 3 else _FONT
        parts.append(
            f'<text x="{box.x:.1f}" y="{box.y + 22:.1f}" font-size="{size}" font-weight="bold" fill="{shown.line}">'
            f"{markup.text(shown.sign)}</text>"
        )
        y = box.y + 39
    for number, line in enumerate(lines):
        parts.append(f'<text x="{box.x:.1f}" y="{y + number * _LINE:.1f}">{markup.text(line)}</text>')
    return parts


def svg(tree: Tree) -> str:
    """The drawing. Each node has a tooltip with its type and place."""
    boxes: list[Box] = []
    made: dict[int, Box] = {}
    for node, parent, depth in in_order(tree.root):
        box = Box(node, *_size(look(node)), depth)
        made[id(node)] = box
        boxes.append(box)
        if parent is not None:
            made[id(parent)].children.append(box)
    width, height = place(boxes)
    size = f"{width + 2 * _MARGIN:.0f}", f"{height + 2 * _MARGIN:.0f}"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]}" height="{size[1]}" '
        f'viewBox="{-_MARGIN:.0f} {-_MARGIN:.0f} {size[0]} {size[1]}" font-family="{_FONTS}" font-size="{_FONT}" '
        f'text-anchor="middle" fill="#1a1a1a">'
    )
    parts = [
        head,
        f"<title>{markup.text(tree.id)}</title>",
        f'<rect x="{-_MARGIN:.0f}" y="{-_MARGIN:.0f}" width="{size[0]}" height="{size[1]}" fill="#ffffff"/>',
        '<g fill="none" stroke="#555555" stroke-width="1.3">',
    ]
    for box in boxes:
        bottom = box.y + box.height
        for child in box.children:
            middle = child.y - 15
            parts.append(f'<path d="M{box.x:.1f} {bottom:.1f}V{middle:.1f}H{child.x:.1f}V{child.y:.1f}"/>')
    parts.append("</g>")
    for box in boxes:
        kind = box.node.leaf.id if box.node.leaf is not None else box.node.type.name
        about = f"{kind} '{box.node.name}', line {box.node.place.line}"
        shown = look(box.node)
        parts += ["<g>", f"<title>{markup.text(about)}</title>", _shape(box, shown), *_words(box, shown), "</g>"]
    return "\n".join([*parts, "</svg>"]) + "\n"
