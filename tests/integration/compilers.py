# SPDX-License-Identifier: MIT
"""The compilers that generated C has to please: gcc in every run, clang where `make check-all` has installed it."""

from __future__ import annotations

import pytest

COMPILERS = ["gcc", pytest.param("clang", marks=pytest.mark.clang)]
