# SPDX-License-Identifier: MIT
"""`canopy convert`: other architectures into trees, and back; each result is run to check it (docs/convert.md)."""
