# SPDX-License-Identifier: MIT
"""Only what pyproject.toml cannot say: the C extension that cffi makes from the plant's sources."""

from setuptools import setup

setup(cffi_modules=["canopy_sim/_plant_build.py:ffibuilder"])
