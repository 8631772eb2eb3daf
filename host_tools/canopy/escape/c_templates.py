# SPDX-License-Identifier: MIT
"""Jinja templates of C that escape without being asked.

The extension looks at a template's tokens before it is parsed. It knows which text between the tags is inside of a
comment, and sends what a {{ tag }} gives through in_comment() or in_code(). A string in quotes is the template's own,
and so is C; `~` keeps that mark where both sides have it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

import jinja2
from jinja2.ext import Extension
from jinja2.lexer import Token, TokenStream
from jinja2.runtime import Context

from canopy.escape.c import Code, in_code, in_comment, is_safe

_DELIMITER = re.compile(r"/\*|\*/")


def _is_inside(data: str, inside: bool) -> bool:
    """Is the place behind this text in a comment?"""
    for delimiter in _DELIMITER.findall(data):
        inside = delimiter == "/*" if not inside else delimiter != "*/"
    return inside


class _Escaping(Extension):
    def filter_stream(self, stream: TokenStream) -> Iterator[Token]:
        inside = False
        for token in stream:
            line = token.lineno
            if token.type == "data":
                inside = _is_inside(token.value, inside)
            if token.type == "variable_begin":
                yield token
                yield Token(line, "lparen", "(")
            elif token.type == "variable_end":
                yield Token(line, "rparen", ")")
                yield Token(line, "pipe", "|")
                yield Token(line, "name", "_in_comment" if inside else "_in_code")
                yield token
            elif token.type == "string":
                yield Token(line, "lparen", "(")
                yield token
                yield Token(line, "pipe", "|")
                yield Token(line, "name", "_literal")
                yield Token(line, "rparen", ")")
            elif token.type == "tilde":
                yield Token(line, "add", "+")
            else:
                yield token
        if inside:
            raise jinja2.TemplateSyntaxError("the template ends inside a comment", 0, stream.name, stream.filename)


# Filters with the context are not computed when a template is compiled: a constant would lose its mark.
@jinja2.pass_context
def _literal(_context: Context, text: str) -> Code:
    return Code(text)


@jinja2.pass_context
def _in_code(context: Context, value: object) -> Code:
    return Code("") if type(value) is jinja2.Undefined else in_code(value, context.name or "")


@jinja2.pass_context
def _in_comment(_context: Context, value: object) -> Code:
    return Code("") if type(value) is jinja2.Undefined else in_comment(value)


def _join(values: Iterable[Any], between: str = "") -> str:
    """Jinja's, but the mark stays where all have it."""
    parts = list(values)
    text = str(between).join(map(str, parts))
    return Code(text) if all(map(is_safe, parts)) and isinstance(between, Code) else text


def environment(package: str) -> jinja2.Environment:
    """An environment for the templates of C in a package."""
    result = jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        undefined=jinja2.StrictUndefined,
        autoescape=True,  # what macros give is marked
        optimized=False,  # see _literal()
        extensions=[_Escaping],
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    result.filters |= {"_literal": _literal, "_in_code": _in_code, "_in_comment": _in_comment, "join": _join}
    return result
