# SPDX-License-Identifier: MIT
"""Exit statuses of the tools that watch a bus: they tell ended as asked, ended by an error, and never saw anything."""

DONE = 0
"""Ended as asked, by a signal or after its time, and frames came."""

NOTHING = 1
"""Nothing to show for it: the bus, the file or the model cannot be used, or no frame ever came."""

FAILED = 3
"""Began, and was ended by an error, e.g. a full disk. (2 is a wrong command line.)"""
