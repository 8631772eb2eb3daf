# SPDX-License-Identifier: MIT
"""Text in LCM messages: lcm-spy and its like show it as it comes, and a NUL ends it early."""

from __future__ import annotations

from canopy.escape.visible import visible as text

__all__ = ["text"]
