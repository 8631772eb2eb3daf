# SPDX-License-Identifier: MIT
"""XML text into elements that know their line and column.

The standard library's expat does the parsing: it tells the position of each tag, which ElementTree and lxml do not. A
document type declaration is refused, and with it every entity trick.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from canopy.compiler.errors import CompileError, Place
from canopy.files import FileError, read_bytes
from canopy.tree import raw_markup
from canopy.tree.foreign import Foreign

MAX_DEPTH = 65_534


@dataclass
class Element:
    """An XML element: tag, attributes, child elements, text directly inside, and where its tag begins."""

    tag: str
    attributes: dict[str, str]
    place: Place
    children: list[Element] = field(default_factory=list)
    text: str = ""
    source: bytes = field(default=b"", repr=False)
    offset: int = 0
    _values: dict[bytes, tuple[int, int]] | None = field(default=None, repr=False)
    _characters: dict[str, list[int]] = field(default_factory=dict, repr=False)
    """Where each character of an attribute begins: scripts ask for many."""
    _begins: dict[str, Place] = field(default_factory=dict, repr=False)

    def attribute_place(self, name: str, index: int = 0) -> Place:
        """The place of character `index` of an attribute's value; the tag's place when the value cannot be found.

        Expat gives no places of attributes, so the tag is read again; `&lt;` and the like are one character.
        """
        if not index and name in self._begins:
            return self._begins[name]
        if self._values is None:
            self._values = self._read_again()
        start, end = self._values.get(name.encode(), (0, 0))
        if not end:
            return self.place
        if index:
            if name not in self._characters:
                self._characters[name] = [match.start() for match in _CHARACTER.finditer(self.source, start, end)]
            starts = self._characters[name]
            start = starts[index] if index < len(starts) else end
        place = self._place_of(start)
        if not index:
            self._begins[name] = place
        return place

    def only(self, foreign: Foreign, *known: str) -> None:
        """Looks at attributes that are not known: those of other namespaces are nobody's, others are `foreign`.

        Raises:
            CompileError: one looks like a known one, misspelt.
        """
        for name in self.attributes:
            if name not in known and ":" not in name and name != "xmlns":
                foreign.leave(name, self.attribute_place(name), f"<{self.tag}>", known)

    def _read_again(self) -> dict[bytes, tuple[int, int]]:
        """Where each attribute's value begins and ends."""
        values = {}
        position = _TAG_NAME.match(self.source, self.offset)
        while position is not None:
            position = _ATTRIBUTE.match(self.source, position.end())
            if position is not None:
                values[position["name"]] = (position.start("value") + 1, position.end("value") - 1)
        return values

    def _place_of(self, offset: int) -> Place:
        before = self.source[self.offset : offset].decode("utf-8", errors="replace")
        lines = before.count("\n")
        column = len(before) - before.rfind("\n") if lines else self.place.column + len(before)
        return Place(self.place.file, self.place.line + lines, column)


_TAG_NAME = re.compile(rb"<[^\s/>]+")
_ATTRIBUTE = re.compile(rb"\s+(?P<name>[^\s=/>]+)\s*=\s*(?P<value>\"[^\"]*\"|'[^']*')")
_CHARACTER = re.compile(rb"&[^;]*;|[\x00-\x7f\xc0-\xff][\x80-\xbf]*", re.DOTALL)


def unreadable_encoding(file: str, error: Exception) -> CompileError:
    """For what expat raises when it does not know the encoding in the XML declaration."""
    return CompileError(
        Place(file, 1, 1), f"the encoding that the file names cannot be read: {error}", "save it as UTF-8"
    )


def malformed(data: bytes, file: str, error: expat.ExpatError) -> CompileError:
    """For what expat raises; a raw & or < of a script is named, with what to write."""
    for offset, raw in raw_markup.find(data):
        line = data.count(b"\n", 0, offset) + 1
        start = data.rfind(b"\n", 0, offset) + 1
        if line > error.lineno:
            break
        written = raw_markup.WRITTEN[raw].decode()
        return CompileError(
            Place(file, line, len(data[start:offset].decode("utf-8", errors="replace")) + 1),
            f"not well-formed XML: a raw '{raw.decode()}'",
            f"in XML it is written {written}; canopy fmt --repair FILE mends all of them",
        )
    return CompileError(
        Place(file, error.lineno, error.offset + 1), f"not well-formed XML: {expat.ErrorString(error.code)}"
    )


class _Builder:
    def __init__(self, file: str) -> None:
        self._file = file
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._open: list[Element] = []
        self._texts: list[list[str]] = []  # of the open elements, as expat gives them: line by line
        self._root: Element | None = None
        self._data = b""

    def _here(self) -> Place:
        return Place(self._file, self._parser.CurrentLineNumber, self._parser.CurrentColumnNumber + 1)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, self._here(), source=self._data, offset=self._parser.CurrentByteIndex)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        if len(self._open) >= MAX_DEPTH:
            raise CompileError(element.place, f"elements are nested more than {MAX_DEPTH} deep")
        self._open.append(element)
        self._texts.append([])

    def _end(self, _tag: str) -> None:
        self._open.pop().text = "".join(self._texts.pop())

    def _text(self, data: str) -> None:
        if self._texts:
            self._texts[-1].append(data)

    def _doctype(self, *_: object) -> None:
        raise CompileError(
            self._here(), "a document type declaration (<!DOCTYPE …>) is not accepted", "remove it: trees need none"
        )

    def parse(self, data: bytes) -> Element:
        self._data = data
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            raise malformed(data, self._file, error) from error
        except (LookupError, ValueError) as error:
            raise unreadable_encoding(self._file, error) from error
        assert self._root is not None  # expat refuses a document without an element
        return self._root


def parse_xml(data: bytes, file: str) -> Element:
    """The root element of a file's bytes.

    Raises:
        CompileError: not well-formed XML without a DOCTYPE.
    """
    return _Builder(file).parse(data)


def read_xml(path: Path) -> Element:
    """The root element of the file.

    Raises:
        CompileError: the file cannot be read, is larger than 16 MiB, or is not well-formed XML without a DOCTYPE.
    """
    try:
        data = read_bytes(path)
    except FileError as error:
        raise CompileError(Place(str(path)), error.problem) from error
    return parse_xml(data, str(path))
