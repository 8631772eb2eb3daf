# SPDX-License-Identifier: MIT
"""`&&` and `<` as people write them into scripts: no XML parser takes them in an attribute, and their meaning is plain.

The text is read only as far as is needed to tell attributes from what stands around them. Where quotes are missing
nothing is found, and the parser's own message stands.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

_SKIPPED = ((b"<!--", b"-->"), (b"<![CDATA[", b"]]>"), (b"<?", b"?>"), (b"</", b">"))
_OPENING = re.compile(rb"<[A-Za-z_:][^\s/>]*")
_ATTRIBUTE = re.compile(rb"\s*[^\s=/><\"']+\s*=\s*(?:\"(?P<double>[^\"]*)\"|'(?P<single>[^']*)')")
_RAW = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#\d{1,7}|#x[0-9A-Fa-f]{1,6});)|<")
_RAW_IN_TEXT = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#\d{1,7}|#x[0-9A-Fa-f]{1,6});)")
WRITTEN = {b"&": b"&amp;", b"<": b"&lt;"}


def find(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Where a raw `&` or `<` stands in an attribute, or a raw `&` in a text."""
    position = 0
    while position < len(data):
        start = data.find(b"<", position)
        end = len(data) if start < 0 else start
        for match in _RAW_IN_TEXT.finditer(data, position, end):
            yield match.start(), match[0]
        if start < 0:
            return
        ending = next((end for begin, end in _SKIPPED if data.startswith(begin, start)), None)
        if ending is not None:
            position = data.find(ending, start + 2)
            if position < 0:
                return
            position += len(ending)
            continue
        opening = _OPENING.match(data, start)
        position = opening.end() if opening is not None else start + 1
        attribute = _ATTRIBUTE.match(data, position)
        while attribute is not None:
            group = "double" if attribute["double"] is not None else "single"
            for match in _RAW.finditer(data, *attribute.span(group)):
                yield match.start(), match[0]
            position = attribute.end()
            attribute = _ATTRIBUTE.match(data, position)


def repaired(data: bytes) -> bytes:
    """The data with each of them written as XML wants it."""
    parts = []
    before = 0
    for place, raw in find(data):
        parts += [data[before:place], WRITTEN[raw]]
        before = place + 1
    return b"".join([*parts, data[before:]])
