# SPDX-License-Identifier: MIT
"""One hash for all C files of a run: each includes it, and files of two runs do not compile together."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from canopy.escape.c import Code

PLACEHOLDER = Code("CANOPY_GENERATION")
"""Stands for the hash in files that are not tied yet."""


def tie(files: Mapping[str, str]) -> dict[str, bytes]:
    """The files' bytes, with the hash over all of them: every one changes when one does."""
    digest = hashlib.sha256()
    for name, text in sorted(files.items()):
        digest.update(f"{name}\0{text}\0".encode())
    constant = f"0x{digest.hexdigest()[:16]}u"
    return {name: text.replace(PLACEHOLDER, constant).encode() for name, text in files.items()}
