# SPDX-License-Identifier: MIT
"""A controller's counters as words for people."""

from __future__ import annotations

from canopy.live.health import Health


def health_words(health: Health) -> str:
    """What it has counted, as far as it has been told; without most of what is as it should be."""
    unknown = "unknown filtered" if health.rx_filtered else f"{health.rx_unknown} unknown"
    parts = [f"{health.rx_rejected} refused", unknown] if health.rx_rejected is not None else []
    if health.longest_cycle_us is not None:
        parts.append(f"longest cycle {health.longest_cycle_us / 1000:.3f} ms")
    if health.latest_start_us is not None:
        parts.append(f"latest {health.latest_start_us / 1000:.2f} ms")
    for count, what in (
        (health.rx_lost, "lost by the driver"),
        (health.rx_backlogs, "backlogs"),
        (health.rx_errors, "receive errors"),
        (health.timeouts, "timeouts"),
        (health.tx_replaced, "replaced"),
        (health.tx_expired, "expired"),
        (health.trace_dropped, "trace frames dropped"),
        (health.bus_restarts, "restarts of the bus"),
        (health.slips, "cycles left out"),
        (health.leaf_faults, "leaf faults"),
    ):
        if count:
            parts.append(f"{count} {what}")
    return ", ".join(parts)
