# SPDX-License-Identifier: MIT
"""Enums of the user's: a type for ports, and names that scripts and literals may use.

    <Enum ID="Color">
      <value name="RED"/>
      <value name="GREEN" number="4"/>
    </Enum>

Without a number a value is one more than the one before, as in C++. In C it is an int32_t, and `APP_COLOR_RED` a
constant.
"""

from __future__ import annotations

from canopy.compiler.errors import CompileError
from canopy.compiler.names import is_c_identifier, snake
from canopy.compiler.numbers import exact
from canopy.compiler.port_types import INT32, PortType
from canopy.compiler.xml_reader import Element
from canopy.escape.c import mark_c
from canopy.tree.foreign import Foreign

MOST_VALUES = 1_000


def add_enum(element: Element, into: dict[str, PortType], foreign: Foreign) -> None:
    """Adds what an <Enum> declares. The same declaration in several files is accepted.

    Raises:
        CompileError: it is incomplete, or contradicts another one.
    """
    element.only(foreign, "ID", "description")
    enum_id = element.attributes.get("ID", "")
    if not is_c_identifier(snake(enum_id)) or not enum_id or not element.children:
        raise CompileError(
            element.place, "<Enum> needs an ID and values", '<Enum ID="Color"><value name="RED"/></Enum>'
        )
    values: dict[str, int] = {}
    number = 0
    for child in element.children[:MOST_VALUES]:
        child.only(foreign, "name", "number")
        name = child.attributes.get("name", "")
        if child.tag != "value" or not is_c_identifier(name) or name in values:
            raise CompileError(
                child.place, f"<Enum ID='{enum_id}'> has values with names, each once, not <{child.tag}>"
            )
        number = _number(child, number)
        values[name] = number
        number += 1
    if len(element.children) > MOST_VALUES:
        raise CompileError(element.place, f"<Enum ID='{enum_id}'> has more than {MOST_VALUES} values")
    kind = PortType("int", INT32.c, INT32.low, INT32.high, names=tuple(values.items()), label=enum_id)
    for other in into.values():
        for name, value in other.names:
            if values.get(name, value) != value or (other.label == enum_id and other != kind):
                raise CompileError(element.place, f"enum '{enum_id}' contradicts '{other.label}'", "scripts know both")
    into[enum_id] = kind


def _number(element: Element, otherwise: int) -> int:
    text = element.attributes.get("number", str(otherwise))
    try:
        value = exact(text)
    except ValueError:
        value = exact("0.5")
    if value.denominator != 1 or not INT32.low <= value <= INT32.high:
        raise CompileError(element.attribute_place("number"), f"number='{text}' is not a whole number of 32 bits")
    return int(value)


def constants(app: str, enums: dict[str, PortType]) -> list[tuple[str, list[tuple[str, int]]]]:
    """For each enum its name, and its values as C constants."""
    return [
        (name, [(mark_c(f"{app}_{snake(name)}_{snake(value)}".upper()), number) for value, number in kind.names])
        for name, kind in sorted(enums.items())
    ]


def names_of(enums: dict[str, PortType]) -> dict[str, int]:
    """What names mean in scripts."""
    return {name: number for kind in enums.values() for name, number in kind.names}
