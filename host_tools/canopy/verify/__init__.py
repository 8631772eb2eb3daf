# SPDX-License-Identifier: MIT
"""`canopy verify`: what a tree guarantees, given a model of its leaves (docs/theory.md, docs/verify.md)."""
