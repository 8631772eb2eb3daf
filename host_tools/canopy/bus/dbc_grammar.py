# SPDX-License-Identifier: MIT
"""The statements of a DBC as regular expressions: each is matched by itself, so one that is wrong costs only itself."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

KEYWORDS = (
    "BA_DEF_DEF_REL_", "BA_DEF_SGTYPE_", "BA_DEF_REL_", "BA_DEF_DEF_", "BA_SGTYPE_", "BA_DEF_", "BA_REL_", "BA_",
    "BO_TX_BU_", "BO_", "BS_", "BU_BO_REL_", "BU_EV_REL_", "BU_SG_REL_", "BU_", "CAT_DEF_", "CAT_", "CM_",
    "ENVVAR_DATA_", "EV_DATA_", "EV_", "FILTER", "NS_DESC_", "NS_", "SGTYPE_VAL_", "SGTYPE_", "SG_MUL_VAL_", "SG_",
    "SIGTYPE_VALTYPE_", "SIG_GROUP_", "SIG_TYPE_REF_", "SIG_VALTYPE_", "VAL_TABLE_", "VAL_", "VERSION",
)  # fmt: skip

_ANY = "|".join(KEYWORDS)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TEXT = r'"[^"\\]*(?:\\[\s\S][^"\\]*)*"'  # one way to match: no text makes it slow
_NAME = rf"(?!(?:{_ANY})\b)\w+"
# Behind the unit; a list may go on in the next line only behind a comma.
_LIST = rf"{_NAME}(?:(?:\s*,\s*|[ \t]+){_NAME})*"
_OBJECT = r"(?:BO_\s+(?P<message>\d+)|SG_\s+(?P<signal_of>\d+)\s+(?P<signal>\w+)|(?:BU_|EV_)\s+(?P<other>\w+))"
_PAIRS = rf"(?P<pairs>(?:\s*{_NUMBER}\s*{_TEXT})*)"
_END = r"\s*;?"

_PATTERNS = {
    "BU_": rf"BU_\s*:(?P<nodes>(?:[\s,]+{_NAME})*)",
    "BO_": r"BO_\s+(?P<id>\d+)\s+(?P<name>\w+)\s*:\s*(?P<length>\w+)" + rf"(?:[ \t]+(?P<sender>{_NAME}))?",
    "SG_": rf"SG_\s+(?P<name>\w+)(?:\s+(?P<mux>\w+))?\s*:\s*(?P<start>\d+)\s*\|\s*(?P<length>\d+)\s*@\s*(?P<order>[01])"
    rf"\s*(?P<sign>[-+])\s*\(\s*(?P<scale>{_NUMBER})\s*,\s*(?P<offset>{_NUMBER})\s*\)\s*\[\s*(?P<minimum>{_NUMBER})\s*"
    rf"\|\s*(?P<maximum>{_NUMBER})\s*\]\s*(?P<unit>{_TEXT})[ \t]*(?P<receivers>{_LIST})?",
    "CM_": rf"CM_\s+(?:{_OBJECT}\s+)?(?P<text>{_TEXT}){_END}",
    "VAL_": rf"VAL_\s+(?:(?P<message>\d+)\s+)?(?P<signal>\w+)(?:\s+(?P<table>{_NAME}(?=\s*;))|{_PAIRS}){_END}",
    "VAL_TABLE_": rf"VAL_TABLE_\s+(?P<name>\w+){_PAIRS}{_END}",
    "BA_DEF_": rf"BA_DEF_\s+(?:(?:BO_|SG_|BU_|EV_)\s+)?(?P<name>{_TEXT})\s+(?P<type>\w+)"
    rf"(?P<values>(?:[\s,]*(?:{_TEXT}|{_NUMBER}))*){_END}",
    "BA_DEF_DEF_": rf"BA_DEF_DEF_\s+(?P<name>{_TEXT})\s*(?P<value>{_TEXT}|{_NUMBER}|\w+){_END}",
    "BA_": rf"BA_\s+(?P<name>{_TEXT})\s*(?:{_OBJECT}\s+)?(?P<value>{_TEXT}|{_NUMBER}|\w+){_END}",
    "SIG_VALTYPE_": rf"SIG_VALTYPE_\s+(?P<message>\d+)\s+(?P<signal>\w+)\s*:?\s*(?P<type>\d+){_END}",
    "SG_MUL_VAL_": r"SG_MUL_VAL_\s+(?P<message>\d+)\s+(?P<signal>\w+)\s+(?P<mux>\w+)\s+"
    rf"(?P<ranges>\d+\s*-\s*\d+(?:[\s,]*\d+\s*-\s*\d+)*){_END}",
    "BO_TX_BU_": rf"BO_TX_BU_\s+(?P<message>\d+)\s*:\s*(?P<nodes>{_LIST}){_END}",
    # The list of keywords at the top: words that no colon follows.
    "NS_": r"NS_\s*:(?:\s+(?!BO_\s+\d)\w+(?!\w|\s*:))*",
    "VERSION": rf"VERSION\s+{_TEXT}",
    "BS_": r"BS_\s*:[^\n]*",
}
_COMPILED = {kind: re.compile(pattern) for kind, pattern in _PATTERNS.items()}
_START = re.compile(rf"//[^\n]*|(?<!\w)(?:{_ANY})(?!\w)|{_TEXT}")
_OTHER = re.compile(rf'(?:[^"\n;]|{_TEXT})*')

PAIR = re.compile(rf"({_NUMBER})\s*({_TEXT})")
RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")
TEXT = re.compile(_TEXT)
WORD = re.compile(r"\w+")


@dataclass(frozen=True)
class Statement:
    """One statement: `found` is None when it is not of the form of its kind."""

    kind: str
    start: int
    found: re.Match[str] | None


def statements(text: str) -> Iterator[Statement]:
    """The statements of a DBC, one after the other. O(length)."""
    place = 0
    while (start := _START.search(text, place)) is not None:
        place = start.end()
        kind = start[0]
        if kind[0] in '"/':
            continue
        pattern = _COMPILED.get(kind)
        found = pattern.match(text, start.start()) if pattern is not None else None
        rest = found or _OTHER.match(text, start.start())
        place = max(place, rest.end() if rest is not None else place)
        if pattern is not None:
            yield Statement(kind, start.start(), found)


def unquoted(text: str) -> str:
    """A text without its quotation marks; anything else as it is."""
    return text[1:-1].replace('\\"', '"') if text.startswith('"') else text
