# SPDX-License-Identifier: MIT
"""An XML file with everything that a writer must give back: comments, CDATA, order of attributes, declaration."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.parsers import expat

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.xml_reader import MAX_DEPTH, malformed, unreadable_encoding
from canopy.files import LARGEST


@dataclass
class Text:
    """Characters; `cdata`: they stood in a <![CDATA[ ]]> section."""

    data: str
    cdata: bool = False


@dataclass
class Markup:
    """A comment or a processing instruction, as it is written."""

    source: str


@dataclass
class Element:
    """An element; attributes in the order of the file."""

    tag: str
    attributes: list[tuple[str, str]]
    children: list[Content] = field(default_factory=list)
    line: int = 0


Content = Element | Text | Markup


@dataclass
class Document:
    """A whole file: its XML declaration, for UTF-8, if it has one; and the root with what stands around it."""

    declaration: str | None = None
    content: list[Content] = field(default_factory=list)


class _Reader:
    def __init__(self, file: str, size: int) -> None:
        self.document = Document()
        self._file = file
        self._open: list[list[Content]] = [self.document.content]
        self._cdata = False
        self.parser = expat.ParserCreate()
        self.parser.ordered_attributes = True
        self.parser.buffer_size = max(size, 1)  # of bytes: so a text comes whole, and not line by line
        self.parser.buffer_text = True
        self.parser.XmlDeclHandler = self._declaration
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.CommentHandler = lambda data: self._open[-1].append(Markup(f"<!--{data}-->"))
        self.parser.ProcessingInstructionHandler = self._instruction
        self.parser.StartCdataSectionHandler = self._start_cdata
        self.parser.EndCdataSectionHandler = self._end_cdata
        self.parser.DefaultHandler = self._default

    def _declaration(self, version: str, _encoding: str | None, standalone: int) -> None:
        alone = f' standalone="{"yes" if standalone else "no"}"' if standalone >= 0 else ""
        self.document.declaration = f'<?xml version="{version}" encoding="UTF-8"{alone}?>'

    def _doctype(self, *_: object) -> None:
        place = Place(self._file, self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1)
        raise CompileError(place, "a document type declaration (<!DOCTYPE …>) is not accepted", "remove it")

    def _start(self, tag: str, attributes: list[str]) -> None:
        if len(self._open) > MAX_DEPTH:
            place = Place(self._file, self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1)
            raise CompileError(place, f"elements are nested more than {MAX_DEPTH} deep")
        element = Element(tag, list(zip(attributes[::2], attributes[1::2], strict=True)))
        element.line = self.parser.CurrentLineNumber
        self._open[-1].append(element)
        self._open.append(element.children)

    def _end(self, _tag: str) -> None:
        self._open.pop()

    def _start_cdata(self) -> None:
        self._cdata = True
        self._open[-1].append(Text("", cdata=True))

    def _end_cdata(self) -> None:
        self._cdata = False

    def _text(self, data: str) -> None:
        last = self._open[-1][-1] if self._open[-1] else None
        if isinstance(last, Text) and last.cdata == self._cdata:
            last.data += data
        else:
            self._open[-1].append(Text(data, self._cdata))

    def _instruction(self, target: str, data: str) -> None:
        self._open[-1].append(Markup(f"<?{target} {data}?>" if data else f"<?{target}?>"))

    def _default(self, data: str) -> None:
        """What no other handler takes: blanks outside of the root."""
        if len(self._open) == 1 and not data.strip():
            self._text(data)


def read_document(data: bytes, file: str) -> Document:
    """Reads a file's bytes.

    Raises:
        CompileError: not well-formed XML, a DOCTYPE, too large, or nested too deep.
    """
    if len(data) > LARGEST:
        raise CompileError(Place(file), f"the file has {len(data)} bytes; at most {LARGEST} are read")
    reader = _Reader(file, len(data))
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        raise malformed(data, file, error) from error
    except (LookupError, ValueError) as error:
        raise unreadable_encoding(file, error) from error
    return reader.document
