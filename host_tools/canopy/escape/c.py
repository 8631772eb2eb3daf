# SPDX-License-Identifier: MIT
"""Text in C. What is not marked as C may stand in comments, where it is escaped, and as a word; else it is refused.

The mark is the type `Code`. It is given by what makes C of checked parts: string(), header(), mark_c(), and functions
under @emits_c. tests/integration/test_escape.py has the list of them; a new one is reviewed there.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from markupsafe import Markup

from canopy.escape.visible import visible

P = ParamSpec("P")
T = TypeVar("T")

_WORD = re.compile(r"[A-Za-z0-9_]*", re.ASCII)
_HEADER = re.compile(r"[A-Za-z0-9_+.,=@~/ -]+", re.ASCII)
_BLANKS = re.compile(r"\s+")
# A backslash at a line's end joins the lines, and ??/ is one (trigraphs, C11 5.2.1.1).
_LAST_BACKSLASH = re.compile(r"\\(?=\s|$)")


class EscapeError(AssertionError):
    """A template or a generator would have written text as C that nothing has checked: a mistake of this program."""


class Code(str):
    """Text that is C because this program has made it from checked parts. With anything else it is text again."""

    __slots__ = ()

    def __html__(self) -> Code:
        """Jinja asks this of what it need not escape."""
        return self

    def __add__(self, other: object) -> str:
        text = str.__add__(self, str(other))
        return Code(text) if is_safe(other) else text

    def __radd__(self, other: object) -> str:
        text = str(other) + str(self)
        return Code(text) if is_safe(other) else text

    def __mod__(self, values: Any) -> str:
        text = str.__mod__(self, values)
        parts = values if isinstance(values, tuple) else (values,)
        return Code(text) if all(map(is_safe, parts)) else text


def is_safe(value: object) -> bool:
    """May it stand anywhere in C: C of ours, a whole number, or one word of letters, digits and underscores?"""
    if isinstance(value, str):
        return isinstance(value, (Code, Markup)) or _WORD.fullmatch(value) is not None
    return isinstance(value, int) and not isinstance(value, bool)


def in_code(value: object, where: str = "") -> Code:
    """What a template or a generator writes outside of comments.

    Raises:
        EscapeError: it is not is_safe().
    """
    if not is_safe(value):
        raise EscapeError(f"{where}: {value!r} is not marked as C; see canopy.escape.c")
    return Code(str(value))


def in_comment(value: object) -> Code:
    """What stands inside /* */: on one line, and neither an end nor a beginning of a comment."""
    text = str(value)
    if not text.isprintable():
        text = visible(_BLANKS.sub(" ", text))
    text = text.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    text = _LAST_BACKSLASH.sub(r"\\x5c", text)
    # Nor together with what stands beside it.
    return Code(
        f"{' ' if text[:1] in ('/', '*') else ''}{text}{' ' if text[-1:] in ('/', '*') else ''}" if text else ""
    )


def string(text: str) -> Code:
    """A string literal with exactly these characters, in UTF-8."""
    escaped = "".join(
        f"\\{chr(byte)}" if byte in b'"\\' else chr(byte) if 32 <= byte < 127 and byte != 63 else f"\\{byte:03o}"
        for byte in text.encode()
    )
    return Code(f'"{escaped}"')


def header(name: str) -> Code:
    """The name of a header between the quotes of an #include.

    Raises:
        ValueError: a compiler may read it as something else.
    """
    if _HEADER.fullmatch(name) is None:
        raise ValueError(f"'{name}' is not the name of a header: letters, digits and _+.,=@~/- only")
    return Code(name)


def mark_c(value: T) -> T:
    """Marks as C a text, or all texts of a list or tuple, that was made of checked parts only."""
    result: Any = value
    if isinstance(value, str):
        if not value.replace("\n", "").isprintable():
            raise EscapeError(f"{value!r} is no C: it has characters that cannot be seen")
        result = Code(value)
    elif isinstance(value, (list, tuple)):
        result = type(value)(map(mark_c, value))
    return result  # type: ignore[no-any-return]


def emits_c(function: Callable[P, T]) -> Callable[P, T]:
    """mark_c() for what a function returns."""

    @functools.wraps(function)
    def marked(*args: P.args, **kwargs: P.kwargs) -> T:
        return mark_c(function(*args, **kwargs))

    return marked
