# SPDX-License-Identifier: MIT
"""Which nodes the conformance table has: with how many children, and with which parameters."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from unit.conformance.node import NONE, RUN, Parameter, Script

R, S, F, K = 1, 2, 3, 4
"""Statuses as numbers, where a parameter is one."""


@dataclass(frozen=True)
class Case:
    """One node."""

    name: str
    children: int
    parameters: tuple[Parameter, ...] = ()


def cases() -> Iterator[Case]:
    """All of them."""
    yield from control_nodes()
    yield from decorators()
    yield from parameters_from_entries()
    yield from scripted_nodes()
    yield from attributes()
    yield from leaves()
    yield from own_nodes()


def control_nodes() -> Iterator[Case]:
    """Those without scripts."""
    for name in ("Sequence", "SequenceWithMemory", "AsyncSequence", "ReactiveSequence"):
        yield from (Case(name, children) for children in (1, 2, 3))
    for name in ("Fallback", "AsyncFallback", "ReactiveFallback"):
        yield from (Case(name, children) for children in (1, 2, 3))
    for children, counts in (
        (1, (-1, 1)),
        (2, (-1, 1)),
        (2, (1, 2)),
        (3, (-1, 1)),
        (3, (2, 2)),
        (3, (1, -1)),
        (3, (-2, 3)),
    ):
        yield Case("Parallel", children, counts)
    for children, most in ((1, 1), (2, 1), (3, 1), (3, 2), (3, -1)):
        yield Case("ParallelAll", children, (most,))
    for children, needed in ((1, 1), (2, 1), (2, 2), (2, -2), (3, 1), (3, 2), (3, 3), (3, -1)):
        yield Case("ReactiveParallel", children, (needed,))
    for name in ("IfThenElse", "WhileDoElse"):
        yield from (Case(name, children) for children in (2, 3))
    yield from (Case("TryCatch", children, (catch_on_halt,)) for catch_on_halt in (0, 1) for children in (2, 3))


def decorators() -> Iterator[Case]:
    """Those without scripts."""
    for name in ("Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure"):
        yield Case(name, 1)
    for name in ("Repeat", "RetryUntilSuccessful"):
        yield from (Case(name, 1, (most,)) for most in (-1, 0, 1, 2, 3))
    for name in ("Delay", "Timeout"):
        yield from (Case(name, 1, (milliseconds,)) for milliseconds in (0, 1, 2))
    yield from (Case("RunOnce", 1, (then_skip,)) for then_skip in (0, 1))


def parameters_from_entries() -> Iterator[Case]:
    """Parameters that an entry gives, anew each time the node looks at them; thresholds that no XML may have, too.

    A threshold is asked for at the same places however many children there are: one or two of them, then.
    """
    for name in ("Repeat", "RetryUntilSuccessful"):
        yield Case(name, 1, (Script((-1, 0, 1, 3)),))
    for name in ("Delay", "Timeout"):
        yield Case(name, 1, (Script((0, 1, 2)),))
    yield Case("RunOnce", 1, (Script((0, 1)),))
    yield from (Case("TryCatch", children, (Script((0, 1)),)) for children in (2, 3))
    yield Case("Parallel", 1, (Script((-2, -1, 0, 1, 2)), Script((0, 2))))
    yield Case("Parallel", 2, (Script((-1, 1, 3)), 1))
    yield Case("Parallel", 2, (-1, Script((0, 1, 2))))
    for name in ("ParallelAll", "ReactiveParallel"):
        yield Case(name, 1, (Script((-4, -2, -1, 0, 1, 2, 4)),))
        yield Case(name, 2, (Script((-3, 0, 3)),))


def scripted_nodes() -> Iterator[Case]:
    """Those whose attributes are scripts. 65536 and -1 are true, too."""
    yield from (Case("Precondition", 1, (Script((0, 1, -1, 65536)), otherwise)) for otherwise in (R, S, F, K))
    for name in ("SkipUnlessUpdated", "WaitValueUpdate"):
        yield Case(name, 1, (Script((0, 1, 65536)),))
    yield from (Case("Loop", 1, (Script((0, 1)), if_empty)) for if_empty in (R, S, F, K))
    # Every case, the default, and what lies outside.
    yield from (Case("Switch", children, (Script(tuple(range(-1, children + 1))),)) for children in (3, 4, 5, 6, 7))


def attributes() -> Iterator[Case]:
    """All of the 256 sets that a node can have."""
    scripts: list[Parameter] = [*(Script((0, true)) for true in (1, 2, -1, 65536)), RUN, RUN, RUN, RUN]
    for given in itertools.product((False, True), repeat=len(scripts)):
        yield Case("Attributes", 1, tuple(s if is_given else NONE for s, is_given in zip(scripts, given, strict=True)))


def leaves() -> Iterator[Case]:
    """Those that are built in."""
    yield Case("AlwaysSuccess", 0)
    yield Case("AlwaysFailure", 0)
    yield from (Case("Sleep", 0, (milliseconds,)) for milliseconds in (0, 1, 2))
    yield Case("Sleep", 0, (Script((0, 1, 2)),))
    yield Case("WasEntryUpdated", 0, (Script((0, 1, 65536)),))
    for status, milliseconds in itertools.product((S, F, K), (1, 2)):
        yield Case("TestNode", 0, (status, milliseconds, RUN, RUN, RUN))
    either: tuple[Parameter, ...] = (NONE, RUN)
    for status, *scripts in itertools.product((S, F, K), either, either, either):
        yield Case("TestNode", 0, (status, 0, *scripts))


def own_nodes() -> Iterator[Case]:
    """Nodes of the user's own. N is the next child; 0 is the node itself, and I no status to be done with."""
    wrong = (0, -1, "I")
    yield Case("Decorator", 1, (Script((1, *"SFRK", 2, *wrong)), Script((*"SFRK", 1, *wrong)), RUN))
    yield Case("Decorator", 1, (Script((1,)), Script(tuple("SFRK")), NONE))
    yield Case("Control", 2, (Script((1, 2, "R", 3)), Script((2, "R", "S", 1)), RUN))
    yield Case("Control", 3, (Script((1, "S")), Script(("N",)), RUN))


def left_out(definitions: str, chosen: Iterable[Case]) -> list[str]:
    """What nodes.def has and the table has not: types of nodes, and parameters that an entry could give.

    Condition, SyncAction and StatefulAction are the children; a parameter of a node that has scripts is never an entry.
    """
    known = list(chosen)
    missing = []
    line = re.compile(r'^CANOPY_NODE\((\w+), "(\w+)", \w+, [^"]*"([^"]*)"', re.MULTILINE)
    found = line.findall(definitions)
    scripted = False
    for type_name, name, parameters in found:
        own = [case for case in known if case.name == name]
        if not own and type_name not in ("CONDITION", "SYNC_ACTION", "STATEFUL_ACTION"):
            missing.append(name)
        scripted = scripted or type_name == "PRECONDITION"
        for which, parameter in enumerate(parameters.split()):
            asked = any(isinstance(case.parameters[which], Script) for case in own)
            if not asked and not scripted:
                missing.append(f"{name} {parameter.split('=')[0]}")
    return missing
