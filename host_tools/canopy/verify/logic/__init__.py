# SPDX-License-Identifier: MIT
"""`canopy verify --never` and `--always`: what a tree's logic guarantees, whatever its leaves answer (docs/verify.md).

One tick becomes a circuit: nodes (cells, control, decorators), and what they ask (scripts, expressions, words) of
entries and signals (board, memory). The formula is a few bits of memory beside it (formula, monitor), and berkeley-abc
decides whether they can ever say "violated" (engine). A violation is replayed in canopy.semantics (replay), with
scripts in plain arithmetic (runner).
"""
