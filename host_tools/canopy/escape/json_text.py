# SPDX-License-Identifier: MIT
"""JSON: readable where it can be, and without a character that a terminal or an editor would act on."""

from __future__ import annotations

import json
import re
from typing import Any

_HIDDEN = re.compile(r"[^ -~\n]")


def _escape(match: re.Match[str]) -> str:
    character = match[0]
    return character if character.isprintable() else json.dumps(character)[1:-1]


def dumps(value: Any, indent: int | None = None) -> str:
    """The value as JSON. Only texts can hold what is escaped here, so that the value stays the same."""
    return _HIDDEN.sub(_escape, json.dumps(value, indent=indent, ensure_ascii=False))


def sarif_message(text: str) -> str:
    """A SARIF message string (2.1.0, 3.11.5 and 3.11.6): braces are no placeholder, brackets no link."""
    return text.replace("](", "\\](").replace("{", "{{").replace("}", "}}")
