# SPDX-License-Identifier: MIT
"""What a formula means: once as a circuit beside the tree's, and once on a trace, to judge the first."""

from __future__ import annotations

from collections.abc import Sequence

from canopy.semantics.spec import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS
from canopy.verify.logic.cells import STATUSES, Cell
from canopy.verify.logic.circuit import FALSE, TRUE, Circuit
from canopy.verify.logic.encode import Encoding
from canopy.verify.logic.formula import Formula
from canopy.verify.logic.replay import Moment, Shot

_RETURNED = {"SUCCESS": SUCCESS, "FAILURE": FAILURE, "SKIPPED": SKIPPED}


def _atom(circuit: Circuit, what: str, cell: Cell) -> int:
    if what == "RUNNING":
        return cell.now[RUNNING]
    if what == "IDLE":
        return circuit.any(cell.now[status] for status in STATUSES) ^ 1
    if what == "TICKED":
        return cell.ticked
    return cell.halted if what == "HALTED" else cell.returned[_RETURNED[what]]


def _delayed(circuit: Circuit, value: int, ticks: int) -> list[int]:
    """A literal's value now, and 1 to `ticks` ticks ago; before the first tick it is false."""
    values = [value]
    for _ in range(ticks):
        latch = circuit.latch()
        circuit.follow(latch, values[-1])
        values.append(latch)
    return values


def _since(circuit: Circuit, holds: int, start: int) -> int:
    latch = circuit.latch()
    result = circuit.either(start, circuit.both(holds, latch))
    circuit.follow(latch, result)
    return result


def _once(circuit: Circuit, value: int, ticks: int | None) -> int:
    return _since(circuit, TRUE, value) if ticks is None else circuit.any(_delayed(circuit, value, ticks))


def literal(encoding: Encoding, formula: Formula) -> int:
    """The literal that says whether a formula holds in this tick; its memory is added to the circuit."""
    circuit = encoding.circuit
    parts = [literal(encoding, part) for part in formula.parts]
    match formula.what:
        case "true" | "false":
            return TRUE if formula.what == "true" else FALSE
        case "not":
            return parts[0] ^ 1
        case "and":
            return circuit.all(parts)
        case "or":
            return circuit.any(parts)
        case "previous":
            return _delayed(circuit, parts[0], 1)[1]
        case "once":
            return _once(circuit, parts[0], formula.ticks)
        case "historically":
            return _once(circuit, parts[0] ^ 1, formula.ticks) ^ 1
        case "since":
            return _since(circuit, parts[0], parts[1])
        case "responds":
            ticks = formula.ticks or 0
            due = _delayed(circuit, parts[0], ticks)[ticks]
            return circuit.both(due, _once(circuit, parts[1], ticks) ^ 1) ^ 1
        case "fact":
            return encoding.told[formula.node]
    return _atom(circuit, formula.what, encoding.cells[formula.node])


def _at(moment: Moment, what: str) -> bool:
    if what in ("RUNNING", "IDLE"):
        return moment.code == (RUNNING if what == "RUNNING" else IDLE)
    if what == "TICKED":
        return moment.returned != IDLE
    return moment.halted if what == "HALTED" else moment.returned == _RETURNED[what]


def holds(formula: Formula, trace: Sequence[Shot]) -> list[bool]:
    """Whether a formula holds, in each tick of a trace; by the definition, from the trace alone."""
    ticks = range(len(trace))
    parts = [holds(part, trace) for part in formula.parts]
    first = [0 if formula.ticks is None else max(now - formula.ticks, 0) for now in ticks]
    match formula.what:
        case "true" | "false":
            return [formula.what == "true" for _ in ticks]
        case "not":
            return [not one for one in parts[0]]
        case "and":
            return [all(part[now] for part in parts) for now in ticks]
        case "or":
            return [any(part[now] for part in parts) for now in ticks]
        case "previous":
            return [False, *parts[0]][: len(trace)]
        case "once":
            return [any(parts[0][first[now] : now + 1]) for now in ticks]
        case "historically":
            return [all(parts[0][first[now] : now + 1]) for now in ticks]
        case "since":
            return [
                any(parts[1][then] and all(parts[0][then + 1 : now + 1]) for then in range(now + 1)) for now in ticks
            ]
        case "responds":
            wait = formula.ticks or 0
            return [now < wait or not parts[0][now - wait] or any(parts[1][now - wait : now + 1]) for now in ticks]
        case "fact":
            return [shot.facts[formula.node] for shot in trace]
    return [_at(shot.moments[formula.node], formula.what) for shot in trace]
