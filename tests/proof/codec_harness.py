# SPDX-License-Identifier: MIT
"""Writes the program that Frama-C looks at for a generated codec: any bytes of any length, any structs.

Usage: codec_harness.py NAME_codec.h >harness.c
"""

import re
import sys
from pathlib import Path

HEAD = """/* Made by codec_harness.py. */
#include "__fc_builtin.h"
#include "{header}"
"""

MESSAGE = """
static void {name}(void)
{{
    {name}_t object;
    uint8_t frame[{macro}_LENGTH];
    uint8_t data[{macro}_LENGTH];

    {name}_init(&object);
    (void){name}_encode(&object, data, sizeof data);
    Frama_C_make_unknown((char *)frame, sizeof frame);
    (void){name}_decode(&object, frame, Frama_C_unsigned_long_interval(0, SIZE_MAX));
    Frama_C_make_unknown((char *)&object, sizeof object);
{flags}    (void){name}_encode(&object, data, Frama_C_unsigned_long_interval(0, sizeof data));
}}
"""


def harness(header: Path) -> str:
    """The C text; a call of each function of each message."""
    text = header.read_text(encoding="utf-8")
    bodies = {
        name: body
        for body, name in re.findall(r"^typedef struct \{\n(.*?)^\} (\w+)_t;", text, re.MULTILINE | re.DOTALL)
    }
    names = re.findall(r"^canopy_codec_result_t (\w+)_decode\(", text, re.MULTILINE)
    parts = [HEAD.format(header=header.name)]
    for name in names:
        # Not any byte is a bool; any is what C lets a program have.
        flags = re.findall(r"^ +bool (\w+);", bodies[name], re.MULTILINE)
        lines = "".join(f"    object.{flag} = Frama_C_interval(0, 1) != 0;\n" for flag in flags)
        parts.append(MESSAGE.format(name=name, macro=name.upper(), flags=lines))
    parts += ["\nint main(void)\n{\n", *(f"    {name}();\n" for name in names), "    return 0;\n}\n"]
    return "".join(parts)


if __name__ == "__main__":
    sys.stdout.write(harness(Path(sys.argv[1])))
