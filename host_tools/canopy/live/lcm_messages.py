# SPDX-License-Identifier: MIT
"""The LCM messages that tell of a tree: words for people, and what they are made of."""

from __future__ import annotations

from typing import Any

from canopy.escape import lcm_text
from canopy.lcm_link import utime_now
from canopy.live.codes import was_ticked
from canopy.live.health import LATENESS_US, Health
from canopy.live.words import health_words
from canopy.model import CATEGORIES, Model
from canopy.trace import Status, TreeView

_NOT_TOLD = -1
_INT32_MAX = 2**31 - 1


def status_message(model: Model, view: TreeView, utime: int) -> Any:
    """A tree_status_t of a tick whose last frame came at `utime` [us since 1970]."""
    from canopy_msgs.tree_status_t import tree_status_t

    message = tree_status_t()
    message.utime = utime
    message.application = lcm_text.text(model.application)
    message.model_hash = model.hash
    message.tick = view.tick
    _add_words(message, model, view)
    message.num_values = len(view.values)
    message.value_name = [lcm_text.text(state.value.title) for state in view.values]
    message.value = [lcm_text.text(state.text) for state in view.values]
    message.value_certain = [state.certain for state in view.values]
    message.num_nodes = len(view.nodes)
    message.code = [state.code for state in view.nodes]
    message.certain = [state.certain for state in view.nodes]
    message.since = [_NOT_TOLD if state.since is None else state.since for state in view.nodes]
    message.since_exact = [state.exact for state in view.nodes]
    message.root_status = view.root_status
    message.complete = view.complete
    message.overruns = min(view.overruns, _INT32_MAX)
    message.trace_lost = view.lost
    message.crc_errors = view.crc_errors
    message.can_state = view.bus.can_state if view.bus else _NOT_TOLD
    message.overload = view.bus is not None and view.bus.overload
    message.returning = view.bus is not None and view.bus.returning
    _add_health(message, view.health)
    return message


def _add_words(message: Any, model: Model, view: TreeView) -> None:
    leaves = [
        (lcm_text.text(node.name), state)
        for node, state in zip(model.nodes, view.nodes, strict=True)
        if node.category in ("condition", "action")
    ]
    message.root = view.root_status.name
    message.bus = view.bus.text() if view.bus else "unknown"
    message.running = [name for name, state in leaves if state.status is Status.RUNNING]
    message.num_running = len(message.running)
    message.failed = [name for name, state in leaves if state.status is Status.FAILURE and was_ticked(state.code)]
    message.num_failed = len(message.failed)
    message.health = health_words(view.health)


def _add_health(message: Any, health: Health) -> None:
    for field, count in (
        ("rx_rejected", health.rx_rejected),
        ("rx_unknown", health.rx_unknown),
        ("rx_lost", health.rx_lost),
        ("rx_backlogs", health.rx_backlogs),
        ("rx_errors", health.rx_errors),
        ("timeouts", health.timeouts),
        ("tx_replaced", health.tx_replaced),
        ("tx_expired", health.tx_expired),
        ("trace_dropped", health.trace_dropped),
        ("bus_restarts", health.bus_restarts),
        ("leaf_faults", health.leaf_faults),
        ("longest_cycle", health.longest_cycle_us),
        ("latest_start", health.latest_start_us),
        ("slips", health.slips),
    ):
        setattr(message, field, _NOT_TOLD if count is None else count)
    message.lateness = health.lateness or [_NOT_TOLD] * (len(LATENESS_US) + 1)


def structure_message(model: Model) -> Any:
    """A tree_structure_t."""
    from canopy_msgs.tree_structure_t import tree_structure_t

    message = tree_structure_t()
    message.utime = utime_now()
    message.application = lcm_text.text(model.application)
    message.model_hash = model.hash
    message.tree_id = lcm_text.text(model.tree_id)
    message.num_nodes = len(model.nodes)
    message.parent = [-1 if node.parent is None else node.parent for node in model.nodes]
    message.type = [lcm_text.text(node.type) for node in model.nodes]
    message.name = [lcm_text.text(node.name) for node in model.nodes]
    message.category = [CATEGORIES.index(node.category) for node in model.nodes]
    return message
