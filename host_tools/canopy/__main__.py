# SPDX-License-Identifier: MIT
"""`python -m canopy` is the command `canopy`."""

from canopy.cli import main

main(prog_name="canopy")
