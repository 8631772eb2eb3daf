# SPDX-License-Identifier: MIT
"""The canonical form.

Two blanks a level, up to 100 levels, one element a line; attributes on the tag's line if that has at most 120
characters, else one a line; double quotes; `<Node/>` when there is nothing inside; single blank lines between elements
stay, more become one; comments keep their text, and their place behind an element. Text is never touched, nor anything
beside it. UTF-8, LF, newline at the end. A loop, not recursion: trees may be as deep as they are large.
"""

from __future__ import annotations

from unicodedata import category

from canopy.fmt.document import Content, Document, Element, Text

WIDTH = 120
INDENT = "  "
DEEPEST = 100
"""Deeper levels are indented as this one: the file grows with the tree, and not with its depth."""

_IN_TEXT = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"})
_IN_ATTRIBUTE = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
)


def _references(text: str) -> str:
    """Characters that one does not see, as references: `&#x202e;` turns nothing around in an editor."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" or category(c) == "Zs" else f"&#x{ord(c):x};" for c in text)


def _text(text: Text) -> str:
    return f"<![CDATA[{text.data}]]>" if text.cdata else _references(text.data.translate(_IN_TEXT))


def _attributes(element: Element) -> list[str]:
    return [f'{name}="{_references(value.translate(_IN_ATTRIBUTE))}"' for name, value in element.attributes]


def _tag(element: Element, indent: str, end: str) -> str:
    """The start tag; `end` is what closes it."""
    attributes = _attributes(element)
    line = " ".join([f"<{element.tag}", *attributes]) + end
    if len(indent) + len(line) <= WIDTH or len(attributes) < 2:
        return line
    return f"<{element.tag}\n" + "\n".join(f"{indent}{INDENT * 2}{attribute}" for attribute in attributes) + end


def _is_blank(content: Content) -> bool:
    return isinstance(content, Text) and not content.cdata and not content.data.strip(" \t\r\n")


def _has_text(element: Element) -> bool:
    """Text, or a wish to keep blanks: then nothing inside is moved."""
    if ("xml:space", "preserve") in element.attributes:
        return True
    return any(isinstance(part, Text) and not _is_blank(part) for part in element.children)


def _verbatim(element: Element) -> str:
    """The element and all in it, without a blank more or less."""
    parts: list[str] = []
    waiting: list[Content | str] = [element]
    while waiting:
        item = waiting.pop()
        if isinstance(item, str):
            parts.append(item)
        elif isinstance(item, Text):
            parts.append(_text(item))
        elif isinstance(item, Element):
            start = " ".join([f"<{item.tag}", *_attributes(item)])
            parts.append(start + (">" if item.children else "/>"))
            if item.children:
                waiting.append(f"</{item.tag}>")
                waiting.extend(reversed(item.children))
        else:
            parts.append(item.source)
    return "".join(parts)


class _Writer:
    def __init__(self) -> None:
        self.parts: list[str] = []

    def _begin_line(self, gap: str, indent: str, content: Content, first: bool) -> None:
        """What stands before `content`: a space when it is a comment behind something, else a new line."""
        newlines = gap.count("\n")
        if newlines == 0 and not isinstance(content, Element) and not first:
            self.parts.append(" ")
        else:
            self.parts.append(("\n\n" if newlines > 1 and not first else "\n") + indent)

    def children(self, top: list[Content], level: int) -> None:
        """Writes a list of elements, comments and blanks, and all below them."""
        # (children still to write, indent, closing tag): the innermost open element is last
        stack: list[tuple[list[Content], str, str]] = [(list(reversed(top)), INDENT * level, "")]
        first, gap = True, ""
        while stack:
            rest, indent, closing = stack[-1]
            if not rest:
                stack.pop()
                if stack:
                    self.parts.append(f"\n{stack[-1][1]}{closing}")
                first, gap = False, ""
                continue
            content = rest.pop()
            if isinstance(content, Text):
                gap += content.data
                continue
            self._begin_line(gap, indent, content, first)
            first, gap = False, ""
            if not isinstance(content, Element):
                self.parts.append(content.source)
            elif not content.children or (all(map(_is_blank, content.children)) and not _has_text(content)):
                self.parts.append(_tag(content, indent, "/>"))
            elif _has_text(content):
                self.parts.append(_tag(content, indent, ">") + _verbatim(content).partition(">")[2])
            else:
                self.parts.append(_tag(content, indent, ">"))
                deeper = indent + INDENT if len(indent) < DEEPEST * len(INDENT) else indent
                stack.append((list(reversed(content.children)), deeper, f"</{content.tag}>"))
                first = True


def write_document(document: Document) -> str:
    """The canonical text of a document."""
    writer = _Writer()
    if document.declaration is not None:
        writer.parts.append(document.declaration)
    writer.children(document.content, 0)
    return "".join(writer.parts).lstrip("\n") + "\n"
