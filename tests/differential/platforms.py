# SPDX-License-Identifier: MIT
"""Where BehaviorTree.CPP can be run."""

import platform
import sys

import pytest

# As in host_tools/pyproject.toml: there is no package elsewhere, so nothing to compare with. Where there is one, it has
# to be installed.
needs_btcpp = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64" or sys.version_info >= (3, 14),
    reason="behaviortreepy is made for x86-64 Linux and Python up to 3.13 only",
)
