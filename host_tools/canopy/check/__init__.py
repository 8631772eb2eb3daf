# SPDX-License-Identifier: MIT
"""`canopy check`: what a compiler cannot refuse, but a robot may regret (docs/lint.md)."""
