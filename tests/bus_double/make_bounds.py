# SPDX-License-Identifier: MIT
"""Writes the compiler's bounds for a DBC at several loads by others as a C header, with which a test compares.

make_bounds.py DBC PERIOD_MS RECEIVED_MESSAGE HEADER
"""

from __future__ import annotations

import sys
from pathlib import Path

from canopy.compiler.bounds import Others, make_bounds
from canopy.compiler.bus_reader import Bus, read_bus

NODE = "Controller"
BITRATE = 500_000
LOADS = (0, 30, 60, 90)
BURST = 10
LATENCY_US = 10  # CONTROLLER_COMMON
TRACE_FRAMES = 6
"""Of what they wait for only the number of frames in a tick depends: what is printed."""


def _value(us: int | None) -> str:
    return "BOUND_NONE" if us is None else f"{us}u"


def _row(bus: Bus, received: str, load: int) -> str:
    others = Others(load, BURST if load else 0, LATENCY_US)
    bounds = make_bounds(bus, BITRATE, others, TRACE_FRAMES)
    age = next(bound.age_us for bound in bounds.inputs if bound.name == received)
    waits = ", ".join(_value(output.wait_us) for output in bounds.outputs)
    safe = _value(bounds.outputs[-1].safe_us)
    return f"    {{{load * 10}u, {_value(age)}, {safe}, {{{waits}}}}},"


def main() -> None:
    """Writes the header."""
    dbc, period_ms, received, header = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3], Path(sys.argv[4])
    bus = read_bus(dbc, NODE, period_ms)
    rows = "\n".join(_row(bus, received, load) for load in LOADS)
    header.write_text(
        f"""/* Made by make_bounds.py from {dbc.name}. Do not edit. */
#ifndef LOAD_BOUNDS_H
#define LOAD_BOUNDS_H

#include <stdint.h>

/** Nothing is promised. */
#define BOUND_NONE UINT32_MAX

/** What the compiler promises at a load by others, in bursts of {BURST} frames [us]. */
static const struct {{
    uint32_t per_mille;
    uint32_t age;  /* of {received} at a decision */
    uint32_t safe; /* from its last frame to the last of the safe values on the wire */
    uint32_t wait[{len(bus.send)}];
}} load_bounds[] = {{
{rows}
}};

#endif
""",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
