# SPDX-License-Identifier: MIT
"""CAN buses as the host tools use them: where a unixbus is, how it is sent to, and how a tool outlives its bus."""
