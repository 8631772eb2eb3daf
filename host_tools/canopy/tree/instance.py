# SPDX-License-Identifier: MIT
"""One instance of a tree, while it is read."""

from __future__ import annotations

from dataclasses import dataclass, field

from canopy.compiler.blackboard import Scope


@dataclass
class Instance:
    """One instance of a tree: its scope, its path for the host tools, and the tree IDs that led to it."""

    scope: Scope
    path: str
    chain: tuple[str, ...]
    names: dict[str, int] = field(default_factory=dict)

    def unique(self, name: str) -> str:
        """`name`, with `::2` and so on from the second use in this instance on."""
        self.names[name] = self.names.get(name, 0) + 1
        return name if self.names[name] == 1 else f"{name}::{self.names[name]}"
