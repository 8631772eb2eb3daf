# SPDX-License-Identifier: MIT
"""Lists as literals: `1;2;3` of numbers or texts, for ports, entries and the Loop nodes."""

from __future__ import annotations

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.port_types import PORT_TYPES, PortType, literal
from canopy.compiler.script.compile import Texts
from canopy.escape.c import emits_c


def items_of(text: str) -> list[str]:
    """The items of a list, without the blanks around them; a list of nothing has none."""
    return [item.strip() for item in text.split(";") if item.strip()]


@emits_c
def item_literal(item: str, kind: PortType, where: str, place: Place, texts: Texts) -> str:
    """The C literal of one item of a queue's type."""
    if kind.holds_texts:
        return f"{texts.index(item)}u"
    return literal(item, PORT_TYPES[kind.item], where, place)


@emits_c
def queue_literal(text: str, kind: PortType, where: str, place: Place, texts: Texts) -> str:
    """The members of a queue's struct that hold this list.

    Raises:
        CompileError: an item is not of the type, or there are too many.
    """
    items = items_of(text)
    if len(items) > kind.capacity:
        raise CompileError(
            place,
            f"{where}: a list of {len(items)} items, and {kind} holds {kind.capacity}",
            f"make room: --type-map 'std::vector<T>=T[{len(items)}]', or type='T[{len(items)}]' in the model",
        )
    values = [item_literal(item, kind, where, place, texts) for item in items]
    return f".count = {len(items)}u" + (f", .items = {{{', '.join(values)}}}" if values else "")
