# SPDX-License-Identifier: MIT
"""A compiled application in this process: set signals, tick, read. Several at once (docs/in-process.md).

library      the shared library that canopy_add_in_process() makes, and its functions
application  inputs, outputs, entries and statuses by the names of the DBC and the tree
"""

from canopy.inprocess.application import Application
from canopy.inprocess.library import InProcessError, Library

__all__ = ["Application", "InProcessError", "Library"]
