# SPDX-License-Identifier: MIT
"""What a guard compares with a threshold: a condition by its declaration, a script by its text."""

from __future__ import annotations

from collections.abc import Iterable

from canopy.compiler.script.syntax import Comparison, Expression, Name, ScriptError, parse, parts
from canopy.compiler.tree import Node, Script

_ORDER = {"<", "<=", ">", ">="}


def of_guard(node: Node) -> tuple[str, ...]:
    """Signals with a threshold and without hysteresis that a condition asks; none for what is no condition."""
    if node.xml_name == "ScriptCondition" and node.script is not None:
        return of_script(node.script)
    leaf = node.leaf
    return () if leaf is None or leaf.kind != "Condition" or leaf.hysteresis else leaf.reads


def of_script(script: Script) -> tuple[str, ...]:
    """Signals that the script compares by order. One that asks an entry, too, has a memory: it may have hysteresis."""
    try:
        every = [part for statement in parse(script.text) for part in parts(statement)]
    except ScriptError:
        return ()  # without a bus scripts are not compiled; with one, this has been refused before
    chains = [part for part in every if isinstance(part, Comparison)]
    # Door == Open: a name beside a signal is one of the signal's values.
    values = {name for chain in chains if _asks_a_value(chain) for name in _names(chain.operands)}
    if any("." not in name and name not in values for name in _names(every)):
        return ()
    ordered = [operand for chain in chains if set(chain.operators) & _ORDER for operand in chain.operands]
    compared = [name for operand in ordered for name in _names(parts(operand))]
    return tuple(dict.fromkeys(name for name in compared if "." in name and not name.endswith(".fresh")))


def _names(expressions: Iterable[Expression]) -> list[str]:
    return [part.name for part in expressions if isinstance(part, Name)]


def _asks_a_value(chain: Comparison) -> bool:
    return not set(chain.operators) & _ORDER and any("." in name for name in _names(chain.operands))
