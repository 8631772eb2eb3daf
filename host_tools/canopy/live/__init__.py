# SPDX-License-Identifier: MIT
"""A controller as its bus shows it, live or from a log: the parts of which `canopy.trace` is made."""
