# SPDX-License-Identifier: MIT
"""An entry of the node table in C."""

from __future__ import annotations

from canopy.compiler.leaf_model import Leaf
from canopy.compiler.table import Row
from canopy.escape.c import emits_c


@emits_c
def place_constant(app: str, leaf: Leaf | None) -> str:
    """Name of the constant that is a kind's place in the table of leaves or of control nodes; None: runs scripts."""
    if leaf is None:
        return f"{app}_leaf_run_script".upper()
    return f"{app}_{'control' if leaf.is_inner else 'leaf'}_{leaf.c_name}".upper()


@emits_c
def row_fields(app: str, row: Row) -> list[str]:
    """The members of a node's entry in the node table; those that its type does not use are left out."""
    node = row.node
    fields = [f".type = {node.type.enum}"]
    if row.asks:
        fields.append(f".asks = {row.asks}")
    fields += [f".parent = {row.parent}", f".end = {row.end}"]
    if node.type.words:
        fields.append(f".state = {row.state}")
    if node.leaf is not None or node.script is not None:
        fields.append(f".leaf = {place_constant(app, node.leaf)}")
    if node.leaf is not None or node.script is not None or node.parameters:
        fields.append(f".parameter = {row.parameter}")
    return fields
