# SPDX-License-Identifier: MIT
"""The checker of certificates that `canopy verify` writes: small, without a solver, and apart from what it checks.

It reads tree and model by itself, and works out by itself what has to be shown. A certificate only has the numbers that
show it. Nothing here imports canopy.verify or canopy.compiler.
"""
