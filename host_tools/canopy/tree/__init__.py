# SPDX-License-Identifier: MIT
"""What tree files say beyond Canopy's own: names of other tools, nodes that nobody declared, trees in other files."""
