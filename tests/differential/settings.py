# SPDX-License-Identifier: MIT
"""What can be set from outside: CANOPY_SEED, and CANOPY_TREES, the number of trees of each comparison."""

import os

DEFAULT_SEED = 20261123
SEED = int(os.environ.get("CANOPY_SEED") or DEFAULT_SEED)
_TREES = os.environ.get("CANOPY_TREES")

MODEL_TREES = int(_TREES) if _TREES else 2_000
BTCPP_TREES = int(_TREES) if _TREES else 6_000

TIMEOUT_S = 120 + max(MODEL_TREES, BTCPP_TREES) // 50
"""For one comparison; some ten times what it takes."""
