# SPDX-License-Identifier: MIT
"""`canopy plot`: pictures of what a tree does to a plant, from the model of `canopy verify` (docs/plot.md)."""
