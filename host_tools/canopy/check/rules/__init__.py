# SPDX-License-Identifier: MIT
"""The rules, by what they look at. Importing this package registers them all, in this order."""

from canopy.check.rules import reach, parallel, reactive, guards, outcomes, declarations  # noqa: I001 - the table's order

__all__ = ["declarations", "guards", "outcomes", "parallel", "reach", "reactive"]
