# SPDX-License-Identifier: MIT
"""Canopy: behaviour trees as robot firmware. The host side: compile, and watch what runs."""

__version__ = "0.1.0"
