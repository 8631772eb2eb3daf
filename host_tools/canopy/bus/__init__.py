# SPDX-License-Identifier: MIT
"""Bus descriptions as they are met: the maker's file, what an application adds to it, and what is wrong with it."""
