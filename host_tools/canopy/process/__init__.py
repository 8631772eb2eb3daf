# SPDX-License-Identifier: MIT
"""What a host tool does as a process: how it ends, and how much it says."""
