# SPDX-License-Identifier: MIT
"""`python -m canopy_sim` is canopy-sim."""

from canopy_sim.cli import main

main(prog_name="canopy-sim")
