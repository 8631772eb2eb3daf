# SPDX-License-Identifier: MIT
"""Runs that take long: PYTHONPATH=tests python -m endurance long, or kill."""
