# SPDX-License-Identifier: MIT
"""Texts and numbers that a file should not have: what ends a comment or a string, and what no C type holds."""

from __future__ import annotations

import random

MARKER = "CANOPY-FUZZ-INJECTED"
"""What a program prints, before it aborts, in which the text of a file has become code."""

# Calls the harness's canopy_fuzz_injected() before main(). On one line, and it may be there any number of times.
_PAYLOAD = '__asm__(".pushsection .init_array; .quad canopy_fuzz_injected; .popsection");'
# The same with lines of their own.
_GUARDED = (
    "#ifndef P\n#define P\nextern void canopy_fuzz_injected(void);\n__attribute__((constructor)) static void p(void) "
)
_GUARDED += "{ canopy_fuzz_injected(); }\n#endif"

# Where code would have to stand in the line to be compiled: after a comment, a text, a line, a directive.
_OPENINGS = ["*/\n", "*/ ", "\n", "\r", "\\\n", "??/\n", '"; ', '";\n', "'; ", "/*/ ", "// \\\n", "\x85", "\u2028"]
_CLOSINGS = ["\n/*", " /*", "\n", " //", "\n#if 0\n", '\nextern char x["', ""]
_ODD = [
    "*/", "/*", "//", "\\", "??/", "??/\n", '"', "'", "\n", "\r\n", "\t", "\x7f", "\x85", "\x9b31m", "\u202e", "\u2066",
    "\u2028", "%s%n", "{{ 7 * 7 }}", "{% if %}", "$(date)", "`date`", "${X}", "@X@", "#", ";", "]]>", "&", "<", "é",
    "電", "\U0001f600", "\u0301", "a" * 300, " ", "", "-", "..", "__LINE__", "int",
]  # fmt: skip

INTEGERS = [
    -(2**64), -(2**63) - 1, -(2**63), -(2**31) - 1, -(2**31), -65537, -65536, -500, -100, -2, -1, 0, 1, 2, 3, 7, 127,
    128, 255, 256, 32767, 32768, 65534, 65535, 65536, 65537, 6553600, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1,
    2**63, 2**64 - 1, 2**64, 10**30,
]  # fmt: skip
_NUMBERS = [
    "1e99999999",
    "-1e99999999",
    "1e-99999999",
    "1e400",
    "1e-400",
    "1e39",
    "1e-46",
    "0x10",
    "1_0",
    "0.1",
    "33.3",
]
_NUMBERS += [
    "-0",
    "+5",
    "1.",
    ".5",
    "1e5",
    "nan",
    "inf",
    "",
    "١",
    "9" * 5000,
    "0" * 50 + "1",
    "1e308",
    "-1e308",
    "5e-324",
]


class Hostile:
    """Draws them."""

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        # Many cases have little that is bad: one bad thing is not to be hidden behind another.
        self._boldness = rng.choice([0.1, 0.1, 1.0])
        self._texts = rng.choice([0.3, 1.0])

    def text(self, plain: str, chance: float = 0.3) -> str:
        """`plain`, or with a given chance something around, behind or in the place of it."""
        rng = self._rng
        if rng.random() >= chance * self._texts:
            return plain
        if rng.random() < 0.5:
            around = ("*/\n", "\n/*") if rng.random() < 0.4 else (rng.choice(_OPENINGS), rng.choice(_CLOSINGS))
            return f"{plain}{around[0]}{rng.choice([_PAYLOAD, _PAYLOAD, _GUARDED])}{around[1]}"
        odd = "".join(rng.choice(_ODD) for _ in range(rng.randint(1, 3)))
        return rng.choice([odd, plain + odd, odd + plain])

    def integer(self, plain: int | str, chance: float = 0.04) -> str:
        """`plain`, or another number, or what is none."""
        rng = self._rng
        if rng.random() >= chance * self._boldness:
            return str(plain)
        return str(rng.choice(INTEGERS)) if rng.random() < 0.75 else rng.choice(_NUMBERS)

    def damaged(self, text: str) -> str:
        """A text with a few characters taken out, put in or repeated."""
        rng = self._rng
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(text))
            to = min(len(text), at + rng.choice([1, 2, 8, 60]))
            text = (
                rng.choice(
                    [
                        text[:at] + text[to:],
                        text[:to] + text[at:],
                        text[:at] + rng.choice(_ODD) + text[at:],
                        text[:at] * 1,
                    ]
                )
                or text
            )
        return text
