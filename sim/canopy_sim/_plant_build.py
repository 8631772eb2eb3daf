# SPDX-License-Identifier: MIT
"""Builds the extension `canopy_sim._plant` from the plant's C sources (run by setuptools, see setup.py).

API mode: cffi reads the declarations in the headers themselves, without comments and directives, and the C compiler
checks them once more, so they cannot drift apart.
"""

import re
from pathlib import Path

from cffi import FFI

PLANT = Path(__file__).resolve().parent.parent / "plant"
HEADERS = ("power", "posture", "nao", "figures", "robot")  # in the order in which they need each other
CONSTANTS = ("CANOPY_SIM_POWER_STEP_MS", "CANOPY_SIM_POSTURE_STEP_MS")


def declarations(header: str) -> str:
    """What a header declares, as cffi takes it."""
    text = (PLANT / "include" / "canopy_sim" / f"{header}.h").read_text(encoding="utf-8")
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    text = text.replace("\\\n", "")
    return re.sub(r"^#.*$", "", text, flags=re.MULTILINE)


ffibuilder = FFI()
for header in HEADERS:
    ffibuilder.cdef(declarations(header))
for constant in CONSTANTS:
    ffibuilder.cdef(f"#define {constant} ...")

# setuptools wants paths relative to setup.py.
ffibuilder.set_source(
    "canopy_sim._plant",
    '#include "canopy_sim/robot.h"',
    sources=[f"plant/src/{path.name}" for path in sorted((PLANT / "src").glob("*.c"))],
    include_dirs=["plant/include", "plant/src"],
    extra_compile_args=["-std=c11"],
)

if __name__ == "__main__":
    ffibuilder.compile(verbose=True)
