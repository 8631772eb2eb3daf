# SPDX-License-Identifier: MIT
"""`canopy compile --stubs FILE.c`: a skeleton of every function that the user has to write."""

from __future__ import annotations

import re

from canopy.compiler.bus_reader import Bus
from canopy.compiler.emit import environment
from canopy.compiler.layout import layout
from canopy.compiler.leaf_model import Leaf
from canopy.compiler.table import Table
from canopy.escape.c import emits_c


@emits_c
def _body(leaf: Leaf, prototype: str) -> list[str]:
    """Statements that compile without a warning and do the least."""
    arguments = prototype[prototype.index("(") + 1 : -1].split(", ")
    names = [match[1] for part in arguments if (match := re.search(r"(\w+)$", part))]
    function = prototype.split("(")[0].rsplit("_", 1)[1]
    used: tuple[str, ...] = ()
    last: list[str] = []
    if leaf.is_inner and function == "enter":
        used, last = ("node",), ["return node + 1u; /* the first child */"]
    elif leaf.is_inner and function == "child":
        used = ("tree", "child", "status")
        last = [
            "if (status != CANOPY_RUNNING) {",
            "    canopy_reset_child(tree, child);",
            "}",
            "return canopy_done(status);",
        ]
    elif not prototype.startswith("void"):
        last = ["return CANOPY_FAILURE;"]
    return [*(f"(void){name};" for name in names if name not in used), *last]


def stubs(name: str, table: Table, bus: Bus) -> str:
    """The C file: every function once, in the order of <application>_leaves.h."""
    template = environment(bus).get_template("stubs.c.j2")
    return layout(template.render(name=name, users=table.users, bus=bus, body_of=_body))
