# SPDX-License-Identifier: MIT
"""`canopy verify --never` and `--always`: what a tree's logic guarantees, whatever its leaves answer (docs/verify.md).

One tick becomes a circuit (cells, control, decorators), the formula a few bits of memory beside it (formula, monitor),
and berkeley-abc decides whether they can ever say "violated" (engine). A violation is replayed in canopy.semantics
(replay).
"""
