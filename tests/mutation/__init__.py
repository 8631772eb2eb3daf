# SPDX-License-Identifier: MIT
"""Small changes of the runtime, one at a time: does a unit test notice? PYTHONPATH=tests python -m mutation --help."""
