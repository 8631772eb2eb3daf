# SPDX-License-Identifier: MIT
"""`canopy fmt`: tree files in one canonical form (docs/tools.md)."""
