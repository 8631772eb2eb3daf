# SPDX-License-Identifier: MIT
"""BehaviorTree.CPP as this project knows it: the reference model, changed by nothing but the listed differences.

A class overrides exactly the place where BehaviorTree.CPP acts otherwise, and calls `differs` in the ticks in which
that changes what happens. It stands in the file that has the name of the model's. A run of BehaviorTree.CPP is
explained when this model gives the same; and up to the first tick in which a rule fired, the engine has to give the
same as BehaviorTree.CPP, too. docs/differential.md lists the rules.
"""

from __future__ import annotations

from differential.differences.loadable import can_load
from differential.differences.node import BtCppNode
from differential.differences.nodes import NODES
from differential.differences.rules import RULES
from differential.differences.run import Explained, run_differing_model

__all__ = ["NODES", "RULES", "BtCppNode", "Explained", "can_load", "run_differing_model"]
