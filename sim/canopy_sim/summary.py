# SPDX-License-Identifier: MIT
"""What a run amounts to: one JSON object, or a few lines for people."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from canopy_sim.process import Simulation


def summarise(simulation: Simulation, mode: str, ended_by: str) -> dict[str, Any]:
    """The run in JSON's types.

    Args:
        simulation: The run, ended.
        mode: "lock-step" or "real time".
        ended_by: "steps", "signal", or "failure".

    Returns:
        mode, ended_by, steps (of the plant), final (fields of robot_state_t; modes by name), minimum_battery [%],
        frames (sent, dropped, received, accepted, ignored, unknown, errors, refused: count by reason),
        bus (the driver's own counters, where it has some), commands_timed_out, slips, repeats, lcm (None: ran without),
        phases (power mode, posture mode, steps in a row).
    """
    robot = simulation.robot
    final = asdict(robot.state)
    final.update(power_mode=robot.state.power_mode.name, posture_mode=robot.state.posture_mode.name)
    side = simulation.lcm_side
    return {
        "mode": mode,
        "ended_by": ended_by,
        "steps": robot.steps,
        "final": final,
        "minimum_battery": robot.minimum_battery / 10,
        "frames": {
            "sent": simulation.sent,
            "dropped": simulation.dropped,
            "received": simulation.received,
            "accepted": robot.accepted,
            "ignored": robot.ignored,
            "unknown": robot.unknown,
            "errors": robot.error_frames,
            "refused": dict(robot.refused),
        },
        "bus": dict(getattr(simulation.bus, "counters", {})),
        "commands_timed_out": robot.timeouts,
        "slips": simulation.slips,
        "repeats": simulation.repeats,
        "lcm": None
        if side is None
        else {"published": side.published, "commands": side.commands, "refused": side.refused},
        "phases": [list(phase) for phase in robot.phases],
    }


def summary_text(summary: dict[str, Any]) -> str:
    """The same for people."""
    final, frames = summary["final"], summary["frames"]
    refused = ", ".join(f"{count} {reason}" for reason, count in frames["refused"].items() if count) or "none"
    robot = (
        f"battery {final['battery']:.1f} % (least {summary['minimum_battery']:.1f} %), "
        f"charger {final['charger_distance']:.3f} m, "
        f"head at {final['head_x']:.2f} m, {final['head_height']:.2f} m high"
    )
    counts = ", ".join(f"{frames[name]} {name}" for name in ("sent", "dropped", "received", "accepted", "unknown"))
    bus = ", ".join(f"{count} {name}" for name, count in summary["bus"].items())
    lines = [
        f"{summary['mode']}, {summary['steps']} steps, ended by {summary['ended_by']}",
        f"robot     {robot}",
        f"frames    {counts}; refused: {refused}",
        *([f"bus       {bus}"] if bus else []),
        f"commands  timed out {summary['commands_timed_out']} times",
        f"cycles    {summary['repeats']} steps repeated, {summary['slips']} slips",
    ]
    if summary["lcm"] is not None:
        lcm = summary["lcm"]
        lines.append(f"lcm       {lcm['published']} published, {lcm['commands']} commands, {lcm['refused']} refused")
    lines += [f"phase     {power} / {posture}: {steps} steps" for power, posture, steps in summary["phases"]]
    return "\n".join(lines)
