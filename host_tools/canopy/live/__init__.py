# SPDX-License-Identifier: MIT
"""Watching and telling what runs: over LCM and CAN."""
