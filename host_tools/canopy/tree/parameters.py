# SPDX-License-Identifier: MIT
"""Attributes of built-in nodes that become 32-bit parameters: a number, or an entry that gives one."""

from __future__ import annotations

from canopy.compiler.blackboard import Entry, Scope, Use, pointer
from canopy.compiler.errors import CompileError
from canopy.compiler.node_types import Parameter
from canopy.compiler.port_types import ANY
from canopy.compiler.scripted import Context
from canopy.compiler.tree import Script
from canopy.compiler.xml_reader import Element

# Least value of a parameter; the others may be any 32-bit number.
LEAST = {"num_attempts": -1, "num_cycles": -1, "msec": 0, "delay_msec": 0, "then_skip": 0}
# Parameters that are a number of children: 1 to N, or -1 (all) down to -N.
THRESHOLDS = ("success_count", "failure_count", "max_failures")


def read_parameter(context: Context, element: Element, parameter: Parameter, scope: Scope) -> int | Script:
    """The parameter's value, or the script that reads its entry.

    Raises:
        CompileError: it is not given, no whole number, or outside its range.
    """
    name = parameter.name
    text = element.attributes.get(name, parameter.default)
    if not text:
        raise CompileError(element.place, f"<{element.tag}> needs the attribute {name}", f'for example {name}="3"')
    if pointer(text, name) is not None:
        return _entry_parameter(context, element, name, scope)
    if text in ("true", "false"):
        text = "1" if text == "true" else "0"
    try:
        value = int(text)
    except ValueError:
        raise CompileError(element.place, f"{name}='{text}' is not a whole number") from None
    least = LEAST.get(name, -(2**31))
    if not least <= value < 2**31:
        raise CompileError(element.place, f"{name}={value} is outside [{least}, {2**31 - 1}]")
    count = len(element.children)
    if name in THRESHOLDS and not (1 <= value <= count or -count <= value <= -1):
        raise CompileError(
            element.place,
            f"{name}={value} can never be met by {count} children, or needs none",
            f"1 to {count}, or -1 (all) down to -{count}",
        )
    return value


def _entry_parameter(context: Context, element: Element, name: str, scope: Scope) -> Script:
    script = context.script("parameter", element, name, scope)
    inner = pointer(script.text, name)
    assert inner is not None
    script.target = scope.resolve(inner, script.place())
    script.least = LEAST.get(name, -(2**31))
    if isinstance(script.target, Entry):
        script.target.connect(Use(ANY, script.place(), f"<{element.tag} {name}>", False))
    return script
