# SPDX-License-Identifier: MIT
"""`canopy show`: a tree as a picture (docs/tools.md)."""
