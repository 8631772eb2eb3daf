# SPDX-License-Identifier: MIT
"""Everything that the tools print. Text cannot move the cursor, colour, hide, or look like a line of its own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click
from rich.text import Text

from canopy.escape.visible import visible


class Styled(str):
    """Text for a terminal that is printed as it is. Made by style(), and by the few lines that move the cursor."""

    __slots__ = ()


def style(text: str, **how: object) -> Styled:
    """The text in a colour; click drops the colour where the output is no terminal. `how`: as for click.style."""
    return Styled(click.style(visible(text), **how))  # type: ignore[arg-type]


def echo(*parts: str, err: bool = False, nl: bool = True) -> None:
    """Prints one line: parts without anything between them. A line break in a part is shown as `\\n`."""
    text = "".join(part if isinstance(part, Styled) else visible(part) for part in parts)
    stream = sys.stderr if err else sys.stdout
    encoding = getattr(stream, "encoding", None) or "utf-8"
    click.echo(text.encode(encoding, errors="backslashreplace").decode(encoding), err=err, nl=nl)


def echo_lines(text: str, *, err: bool = False) -> None:
    """Prints a text of several lines, whose line breaks are ours."""
    echo(Styled(visible(text.removesuffix("\n"), keep="\n")), err=err)


def styled(*parts: str | tuple[str, str], style: str = "") -> Text:
    """Text for rich, from texts and (text, style) pairs. Square brackets are text, not markup."""
    clean = [visible(part) if isinstance(part, str) else (visible(part[0]), part[1]) for part in parts]
    return Text.assemble(*clean, style=style)


@contextmanager
def _clean_usage_errors() -> Iterator[None]:
    try:
        yield
    except click.ClickException as error:
        vars(error)["message"] = visible(error.message)  # "final" to type checkers
        raise


class CleanCommand(click.Command):
    """A command, or with click.Group a group, whose usage errors show the command line's words harmless."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """As click's."""
        with _clean_usage_errors():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """As click's."""
        with _clean_usage_errors():
            return super().invoke(ctx)
